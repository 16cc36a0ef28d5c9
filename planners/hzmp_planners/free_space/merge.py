"""Merging leaves whose union is convex, and the shared vertices that makes this exact."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hzmp_planners._arrays import Floats, frozen
from hzmp_planners._cell import Cell, Facet
from hzmp_planners._links import component_labels
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.free_space.planes import PlaneTable

FacetVertices = dict[Facet, frozenset[int]]


@dataclass(frozen=True, eq=False)
class Complex:
    """Leaves on one list of vertices."""

    vertices: Floats
    """Distinct vertices, shape (nv, n) [m]."""
    leaves: tuple[FacetVertices, ...]
    """The facets of each leaf, and the vertices on each facet."""


def build_complex(cells: Sequence[Cell], scale: float) -> Complex:
    """Identify the vertices that cells have in common and drop facets that no longer bound.

    Cells smaller than the tolerance collapse and are left out.
    """
    points = np.vstack([cell.vertices for cell in cells])
    pairs = cKDTree(points).query_pairs(4.0 * PLANE_TOL * scale, output_type="ndarray")
    labels = component_labels(pairs, len(points))
    _, first, index = np.unique(labels, return_index=True, return_inverse=True)
    ids = index.tolist()
    leaves: list[FacetVertices] = []
    offset = 0
    n = points.shape[1]
    for cell in cells:
        on: FacetVertices = {}
        for bit, facet in enumerate(cell.facets):
            held = frozenset(
                ids[offset + i] for i, mask in enumerate(cell.incidence) if mask >> bit & 1
            )
            if len(held) >= n:
                on[facet] = held
        offset += len(cell.vertices)
        if len(on) > n:
            leaves.append(on)
    return Complex(points[first], tuple(leaves))


def merge_convex_unions(complex_: Complex, table: PlaneTable, scale: float) -> Complex:
    """Join pairs of leaves while a pair with a convex union is left.

    Two leaves on opposite sides of a plane have a convex union iff they meet in one whole facet
    and each satisfies the other's remaining half-spaces: then
    A u B = {half-spaces of A and of B without the common plane}.
    """
    vertices, n = complex_.vertices, complex_.vertices.shape[1]
    tol = 2.0 * PLANE_TOL * scale
    leaves: dict[int, FacetVertices] = dict(enumerate(complex_.leaves))
    owners: dict[tuple[int, frozenset[int]], set[int]] = defaultdict(set)
    for number, leaf in leaves.items():
        for (plane, _), held in leaf.items():
            owners[plane, held].add(number)
    queue = [key for key, users in owners.items() if len(users) == 2]
    # Large doors first: joining along them leaves few thin leaves over.
    size = {key: _spread(vertices[list(key[1])]) for key in queue}
    queue.sort(key=lambda key: (size[key], key[0], min(key[1])))
    following = len(leaves)
    while queue:
        key = queue.pop()
        users = owners.get(key, set())
        if len(users) != 2:
            continue
        first, second = sorted(users)
        joined = _join(leaves[first], leaves[second], key[0], vertices, table, tol, n)
        if joined is None:
            continue
        for number in (first, second):
            for (plane, _), held in leaves.pop(number).items():
                owners[plane, held].discard(number)
        leaves[following] = joined
        for (plane, _), held in joined.items():
            owners[plane, held].add(following)
            if len(owners[plane, held]) == 2:
                queue.append((plane, held))
        following += 1
    kept = tuple(leaves.values())
    used = sorted(set().union(*(held for leaf in kept for held in leaf.values())))
    rename = {old: new for new, old in enumerate(used)}
    renamed = tuple(
        {facet: frozenset(rename[v] for v in held) for facet, held in leaf.items()} for leaf in kept
    )
    return Complex(frozen(vertices[used]), renamed)


def _spread(points: Floats) -> float:
    return float(np.ptp(points, axis=0).sum())


def _join(
    one: FacetVertices,
    two: FacetVertices,
    plane: int,
    vertices: Floats,
    table: PlaneTable,
    tol: float,
    n: int,
) -> FacetVertices | None:
    """The union of two leaves that share a whole facet on `plane`, or None if it is not convex."""
    for leaf, other in ((one, two), (two, one)):
        points = vertices[sorted(frozenset().union(*other.values()))]
        for facet in leaf:
            if facet[0] == plane or facet in other:
                continue
            height = points @ table.normals[facet[0]] - table.offsets[facet[0]]
            if float((height * facet[1]).max()) > tol:
                return None
    joined: FacetVertices = {}
    for leaf in (one, two):
        for facet, held in leaf.items():
            if facet[0] != plane:
                joined[facet] = joined.get(facet, frozenset()) | held
    # A vertex of the common facet stays only where the remaining facets pin it down.
    common = one.get((plane, 1), frozenset()) | one.get((plane, -1), frozenset())
    dropped = set()
    for vertex in common:
        normals = table.normals[[facet[0] for facet, held in joined.items() if vertex in held]]
        if len(normals) < n or np.linalg.matrix_rank(normals, tol=1e-9) < n:
            dropped.add(vertex)
    return {facet: held - dropped for facet, held in joined.items()}
