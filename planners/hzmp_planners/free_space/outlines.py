"""Facets and leaves of a complex as polygons and polyhedra, in order."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import counts_of, order_within, owners_of, spans, starts_of
from hzmp_planners.free_space.boxes import box_cell
from hzmp_planners.free_space.cells import UNNAMED, Cells, clip, join_cells
from hzmp_planners.free_space.complexes import Complex
from hzmp_planners.free_space.planes import PlaneTable
from hzmp_planners.free_space.polygons import Polygons
from hzmp_planners.free_space.polyhedra import Polyhedra


def outlines(whole: Complex, normals: Floats, facets: Ints | None = None) -> Polygons:
    """The facets as polygons labelled with their vertices; in 2-D as segments.

    Each is counter-clockwise (a segment: ascending) in the chart of its plane: the coordinates
    without the normal's largest. Facets on the two sides of one plane turn the same way.

    Args:
        whole: the leaves.
        normals: normal of each facet's plane, shape (nf, n).
        facets: of which facets; all when not given.
    """
    n, rows, starts = whole.n, whole.rows, whole.facet_starts
    if facets is not None:
        sizes = counts_of(starts)[facets]
        rows, starts = rows[spans(starts[facets], sizes)], starts_of(sizes)
        normals = normals[facets]
    owner = owners_of(starts)
    points = whole.vertices.take(rows, axis=0)
    charts = np.array([[axis for axis in range(n) if axis != drop] for drop in range(n)])
    axes = charts[np.abs(normals).argmax(axis=1)][owner]
    entries = np.arange(len(owner))
    key = points[entries, axes[:, 0]]
    if n == 3 and len(owner):
        u, v, first = key, points[entries, axes[:, 1]], starts[:-1]
        sizes = counts_of(starts)
        middle = [(np.add.reduceat(x, first) / sizes).repeat(sizes) for x in (u, v)]
        key = np.arctan2(v - middle[1], u - middle[0])
    order = order_within(key, starts)
    return Polygons.of(points.take(order, axis=0), starts, rows.take(order))


def cells_of(whole: Complex, table: PlaneTable, tol: float) -> Cells:
    """The leaves as cells that can be cut.

    A leaf whose facets do not close up, as round-off may leave one of the size of the tolerance, is
    cut from a box by its half-spaces.

    Args:
        whole: the leaves.
        table: the planes of their facets.
        tol: nearer to a plane than this is on it [m].
    """
    cells: Cells
    cells, closed = _polygons(whole) if whole.n == 2 else _polyhedra(whole, table)
    if closed.all():
        return cells
    broken = (~closed).nonzero()[0]
    lo, hi = whole.vertices.min(axis=0) - 1.0, whole.vertices.max(axis=0) + 1.0
    walls = np.full(2 * whole.n, UNNAMED)
    boxes = box_cell(lo, hi, walls, len(broken))
    part = whole.take(broken)
    A, b = table.halfspaces(part.facets)
    cut, origin = clip(boxes, A, b, part.facets, part.leaf_starts, tol)
    everything = join_cells([cells, cut])
    rows = np.arange(len(whole))
    rows[broken[origin]] = len(whole) + np.arange(len(cut))
    return everything.take(rows)


def _polygons(whole: Complex) -> tuple[Polygons, Bools]:
    """Corners of the leaves in order, with the facet from each to the next."""
    members, starts = whole.members
    owner, points = owners_of(starts), whole.corners
    middle = np.add.reduceat(points, starts[:-1]) / counts_of(starts)[:, None]
    offset = points - middle[owner]
    order = order_within(np.arctan2(offset[:, 1], offset[:, 0]), starts)
    corners = Polygons.of(points[order], starts, members[order])
    width = max(1, len(whole.vertices))
    one, two = whole.rows.reshape(-1, 2).T
    known = (whole.facet_owner * width + one) * width + two
    by_key = known.argsort()
    near, far = corners.facets, corners.facets[corners.following]
    sought = (owner * width + np.minimum(near, far)) * width + np.maximum(near, far)
    place = np.minimum(np.searchsorted(known[by_key], sought), len(known) - 1)
    found = by_key[place]
    closed = np.logical_and.reduceat(known[found] == sought, starts[:-1])
    closed &= counts_of(starts) == counts_of(whole.leaf_starts)
    return corners.relabelled(whole.facets[found]), closed


def _polyhedra(whole: Complex, table: PlaneTable) -> tuple[Polyhedra, Bools]:
    """Edges of the leaves: sides that the outlines of two facets have in common."""
    faces = outlines(whole, table.normals[whole.facets >> 1])
    members, starts = whole.members
    width = max(1, len(whole.vertices))
    places = np.searchsorted(
        owners_of(starts) * width + members,
        whole.facet_owner[faces.vertex_owner] * width + faces.facets,
    )
    one, two = places, places[faces.following]
    keys = np.minimum(one, two) * len(members) + np.maximum(one, two)
    order = keys.argsort(kind="stable")
    keys = keys[order]
    same = np.zeros(len(keys) + 1, dtype=np.bool_)
    same[1:-1] = keys[1:] == keys[:-1]
    first = (same[1:] & ~same[:-1]).nonzero()[0]
    # Every side must be there exactly twice.
    single = ~same[1:] & ~same[:-1]
    many = same[1:] & same[:-1]
    leaf = whole.facet_owner[faces.vertex_owner]
    closed = np.ones(len(whole), dtype=np.bool_)
    closed[leaf[order[single | many]]] = False
    sides = order[first]
    edge_leaf = leaf[sides]
    by_leaf = edge_leaf.argsort(kind="stable")
    sides, partner = sides[by_leaf], order[first + 1][by_leaf]
    return (
        Polyhedra(
            whole.corners,
            starts,
            whole.facets,
            whole.leaf_starts,
            np.stack([one[sides], two[sides]]),
            np.stack([faces.vertex_owner[sides], faces.vertex_owner[partner]]),
            starts_of(np.bincount(edge_leaf, minlength=len(whole))),
        ),
        closed,
    )
