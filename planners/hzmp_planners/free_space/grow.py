"""Growing leaves into their neighbours while they stay convex and free."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ragged import counts_of, distinct, runs_of, spans, starts_of
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.free_space.boxes import box_cell
from hzmp_planners.free_space.cells import UNNAMED, Cells, clip
from hzmp_planners.sets import Polytope

if TYPE_CHECKING:
    from hzmp_planners.free_space.free_space import FreeSpace


def grow_leaves(
    space: FreeSpace, leaves: Sequence[int], toward: Sequence[Sequence[int]]
) -> list[Polytope]:
    """Convex free polytopes that contain some leaves: see `grow_cells`."""
    cells, A, b = grow_cells(space, leaves, toward)
    return _polytopes(cells, A, b)


def grow_cells(
    space: FreeSpace, leaves: Sequence[int], toward: Sequence[Sequence[int]]
) -> tuple[Cells, Floats, Floats]:
    """Convex free cells that contain some leaves, pushed outward facet by facet.

    Each facet in turn is moved out until the polytope would meet an obstacle or the workspace
    wall: first the facets shared with the leaves in `toward`, then the others. The order decides
    the shape; every result is free. All leaves grow at the same time, each on its own.

    Args:
        space: the free space.
        leaves: their indices.
        toward: for each of them, neighbours to grow into first.

    Returns:
        The cells, one for each leaf; their facets are labelled with rows of the half-spaces
        A x <= b that come with them.
    """
    tol = PLANE_TOL * space.scale
    A, b, starts = _ordered_halfspaces(space, leaves, toward, tol)
    counts = counts_of(starts)
    for k in range(int(counts.max(initial=0))):
        grown = (counts > k).nonzero()[0]
        facet = starts[grown] + k
        b[facet] = np.maximum(b[facet], _free_reach(space, A, b, starts, grown, k, tol))
    lo, hi = space.bounds
    eye = np.eye(space.n)
    walls = len(b) + np.arange(2 * space.n)
    cells, _ = clip(box_cell(lo, hi, walls, len(counts)), A, b, np.arange(len(b)), starts, tol)
    return cells, np.concatenate([A, eye, -eye]), np.concatenate([b, hi, -lo])


def _ordered_halfspaces(
    space: FreeSpace, leaves: Sequence[int], toward: Sequence[Sequence[int]], tol: float
) -> tuple[Floats, Floats, Ints]:
    """The half-spaces of each leaf, those that separate it from leaves in `toward` first."""
    normals, offsets = [np.zeros((0, space.n))], [np.zeros(0)]
    for leaf, others in zip(leaves, toward, strict=True):
        body = space.leaf(leaf)
        corners = [space.leaf(other).vertices() for other in others]
        behind = [(v @ body.A.T >= body.b - 2.0 * tol).all(axis=0) for v in corners]
        first = np.any([*behind, np.zeros(len(body.b), dtype=np.bool_)], axis=0)
        order = (~first).argsort(kind="stable")
        normals.append(body.A[order])
        offsets.append(body.b[order])
    counts = np.array([len(rows) for rows in offsets[1:]], dtype=np.int64)
    return np.concatenate(normals), np.concatenate(offsets), starts_of(counts)


def _free_reach(
    space: FreeSpace,
    A: Floats,
    b: Floats,
    starts: Ints,
    grown: Ints,
    k: int,
    tol: float,
) -> Floats:
    """How far facet k of each polytope can move out before it meets an obstacle [m]; inf: for good.

    A facet that nothing stops is given up: the others that grow after it count on that.
    """
    counts = counts_of(starts)[grown]
    rows = spans(starts[grown], counts)
    turned = np.where(rows == (starts[grown] + k).repeat(counts), -1.0, 1.0)
    boxes = box_cell(*space.bounds, np.full(2 * space.n, UNNAMED), len(grown))
    A_beyond, b_beyond = A[rows] * turned[:, None], b[rows] * turned
    beyond, origin = clip(boxes, A_beyond, b_beyond, rows, starts_of(counts), tol)
    facet = starts[grown] + k
    reach = np.full(len(grown), np.inf)
    outward = A[facet[origin]]
    world = space._world
    part, block = world.blocks.near(*beyond.bounds, tol)
    common, part, _ = world.blocks.common(beyond, part, block, world.table, tol)
    if len(part):
        heights = np.einsum("ij,ij->i", common.vertices, outward[part[common.vertex_owner]])
        np.minimum.at(reach, origin[part], np.minimum.reduceat(heights, common.vertex_starts[:-1]))
    return reach


def _polytopes(cells: Cells, A: Floats, b: Floats) -> list[Polytope]:
    """Cells whose facets are labelled with rows of A x <= b, without facets that are too small."""
    n = A.shape[1]
    cell, row, vertex = cells.incidence()
    keys = distinct((cell * len(b) + row) * len(cells.vertices) + vertex) // len(cells.vertices)
    runs = runs_of(keys)
    facets = keys[runs[:-1][counts_of(runs) >= n]]
    found = []
    for i in range(len(cells)):
        rows = facets[facets // len(b) == i] % len(b)
        corners = slice(cells.vertex_starts[i], cells.vertex_starts[i + 1])
        found.append(Polytope.from_both_forms(A[rows], b[rows], cells.vertices[corners]))
    return found
