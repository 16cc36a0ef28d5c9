"""Overlapping maximal leaves: fewer and larger ones, with doors where they meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import counts_of, extents, owners_of, spans, starts_of
from hzmp_planners.constants import FACE_TOL, PLANE_TOL
from hzmp_planners.free_space.boxes import overlapping_bounds
from hzmp_planners.free_space.cells import Cells, clip, join_cells
from hzmp_planners.free_space.complexes import Complex, empty_complex
from hzmp_planners.free_space.grow import grow_cells
from hzmp_planners.free_space.leaf_graph import LeafGraph
from hzmp_planners.free_space.outlines import outlines
from hzmp_planners.free_space.planes import PlaneTable
from hzmp_planners.free_space.polygons import Polygons
from hzmp_planners.free_space.shared_faces import wide

if TYPE_CHECKING:
    from hzmp_planners.free_space.free_space import FreeSpace

_BATCHES = 24  # of leaves that grow at the same time, if none covered others


@dataclass(frozen=True, eq=False)
class Cover:
    """Convex free leaves that may overlap, and together are the free space."""

    leaves: Complex
    table: PlaneTable
    beside: Ints
    """Leaves of the cover that may meet each disjoint leaf, end to end."""
    beside_starts: Ints
    """Shape (N + 1,) for N disjoint leaves."""


def maximal_cover(space: FreeSpace) -> Cover:
    """Grow the largest disjoint leaves as far as they stay convex and free, until all are covered.

    A disjoint leaf that a grown one contains needs not be grown itself; a grown leaf is dropped
    when every disjoint leaf in it is in another one.

    Args:
        space: with disjoint leaves.
    """
    whole, tol = space._world.leaves, PLANE_TOL * space.scale
    order = np.argsort([-leaf.volume() for leaf in space.leaves], kind="stable")
    open_ = np.ones(len(whole), dtype=np.bool_)
    bodies, normals, offsets = [], [], []
    held: list[Ints] = []
    batch = max(8, len(whole) // _BATCHES)
    while open_.any():
        chosen = order[open_[order]][:batch]
        cells, A, b = grow_cells(space, chosen.tolist(), [[]] * len(chosen))
        for i in range(len(cells)):
            facets = cells.facets[cells.facet_starts[i] : cells.facet_starts[i + 1]]
            inside = _contained(whole, A[facets], b[facets], 4.0 * tol)
            inside[chosen[i]] = True
            held.append(inside.nonzero()[0])
            open_[held[-1]] = False
        bodies.append(cells)
        normals.append(A[cells.facets])
        offsets.append(b[cells.facets])
    if not bodies:
        return Cover(empty_complex(space.n), space._world.table, *[np.zeros(0, np.int64)] * 2)
    table, codes = space._world.table.extended(np.concatenate(normals), np.concatenate(offsets))
    cells = join_cells(bodies).relabelled(codes)
    kept = _needed(held, len(whole))
    leaves, _ = empty_complex(space.n).with_cells(cells.take(kept), space.scale)
    held_by, beside = overlapping_bounds(*whole.bounds, *leaves.bounds, -tol)
    starts = starts_of(np.bincount(held_by, minlength=len(whole)))
    return Cover(leaves, table, beside, starts)


def _contained(whole: Complex, A: Floats, b: Floats, tol: float) -> Bools:
    """Which leaves satisfy A x <= b."""
    inside = np.asarray(np.all(whole.vertices @ A.T <= b + tol, axis=1))
    rows, starts = whole.members
    return np.asarray(np.logical_and.reduceat(inside[rows], starts[:-1]))


def _needed(held: list[Ints], count: int) -> Ints:
    """Grown leaves without those whose disjoint leaves are all in others, smallest first."""
    times = np.bincount(np.concatenate(held), minlength=count)
    kept = np.ones(len(held), dtype=np.bool_)
    for i in sorted(range(len(held)), key=lambda i: len(held[i])):
        if (times[held[i]] > 1).all():
            times[held[i]] -= 1
            kept[i] = False
    return kept.nonzero()[0]


def build_door_graph(cover: Cover, scale: float) -> LeafGraph:
    """Doors between overlapping or touching leaves.

    A path that leaves leaf i into leaf j crosses the boundary of i inside j, and one that comes
    back crosses it too: the pieces of i's facets inside j, where j goes on beyond them, are all
    that can be crossed. The pieces of j's boundary inside i do as well, so the side with fewer
    pieces is taken. For leaves that only touch both are the shared face.

    Args:
        cover: the leaves.
        scale: unit of the tolerances [m].
    """
    whole, table, tol = cover.leaves, cover.table, FACE_TOL * scale
    plane = whole.facets >> 1
    facets = outlines(whole, table.normals[plane])
    facet, leaf = _beyond(whole, facets, table, tol)
    A, b = table.halfspaces(whole.facets)
    counts = counts_of(whole.leaf_starts)[leaf]
    rows = spans(whole.leaf_starts[leaf], counts)
    # The facet's own plane cuts nothing off it.
    other = plane[rows] != plane[facet].repeat(counts)
    pair = np.arange(len(facet)).repeat(counts)[other]
    rows = rows[other]
    starts = starts_of(np.bincount(pair, minlength=len(facet)))
    faces: Cells
    if whole.n == 2:
        faces, kept = _clip_segments(facets.take(facet), A[rows], b[rows], starts, 1e-4 * tol)
    else:
        faces, kept = clip(facets.take(facet), A[rows], b[rows], rows, starts, 1e-4 * tol)
    facet, leaf = facet[kept], leaf[kept]
    normals, offsets = A[facet], b[facet]
    room = wide(faces.vertices, faces.vertex_starts, normals, tol).nonzero()[0]
    owner = whole.facet_owner[facet]
    room = room[_fewer(owner[room], leaf[room], len(whole))]
    doors = faces.take(room)
    return LeafGraph.from_lists(
        len(whole),
        np.column_stack([owner, leaf])[room],
        doors.vertices,
        doors.vertex_starts,
        normals[room],
        offsets[room],
    )


def _beyond(whole: Complex, facets: Polygons, table: PlaneTable, tol: float) -> tuple[Ints, Ints]:
    """Pairs of a facet and another leaf that may contain a piece of it and goes on beyond it."""
    facet, leaf = overlapping_bounds(*facets.bounds, *whole.bounds, -tol)
    apart = whole.facet_owner[facet] != leaf
    facet, leaf = facet[apart], leaf[apart]
    A, b = table.halfspaces(whole.facets[facet])
    _, highest = extents(whole.corners, whole.members[1], leaf, A)
    beyond = highest > b + tol
    return facet[beyond], leaf[beyond]


def _clip_segments(
    segments: Polygons, A: Floats, b: Floats, starts: Ints, tol: float
) -> tuple[Polygons, Ints]:
    """The part of each segment inside its list of half-spaces, if there is one."""
    ends = segments.vertices.reshape(-1, 2, 2)
    owner = owners_of(starts)
    first = np.einsum("ij,ij->i", A, ends[owner, 0]) - b
    last = np.einsum("ij,ij->i", A, ends[owner, 1]) - b
    low, high = np.zeros(len(ends)), np.ones(len(ends))
    outside = (first > tol) & (last > tol)
    low[owner[outside]] = np.inf
    for here, there, bound in ((first, last, low), (last, first, high)):
        cut = ((here > tol) & (there <= tol)).nonzero()[0]
        share = here[cut] / (here[cut] - there[cut])
        if bound is low:
            np.maximum.at(low, owner[cut], share)
        else:
            np.minimum.at(high, owner[cut], 1.0 - share)
    kept = (low < high).nonzero()[0]
    t = np.stack([low[kept], high[kept]], axis=1)[:, :, None]
    points = ends[kept, :1] * (1.0 - t) + ends[kept, 1:] * t
    corners = 2 * np.arange(len(kept) + 1)
    return Polygons.of(
        points.reshape(-1, 2), corners, np.zeros(2 * len(kept), dtype=np.int64)
    ), kept


def _fewer(owner: Ints, leaf: Ints, count: int) -> Ints:
    """Of the doors on i's boundary and those on j's, the rows of the side that has fewer."""
    ordered = np.sort(owner * count + leaf)
    mine, theirs = (
        np.searchsorted(ordered, keys, "right") - np.searchsorted(ordered, keys)
        for keys in (owner * count + leaf, leaf * count + owner)
    )
    kept = (theirs == 0) | (mine < theirs) | ((mine == theirs) & (owner < leaf))
    return np.asarray(kept.nonzero()[0])
