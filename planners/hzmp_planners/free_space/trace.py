"""Polylines through a free space: which leaf holds which part."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._links import component_labels
from hzmp_planners._ragged import counts_of, reduced, spans, starts_of
from hzmp_planners.constants import MEMBERSHIP_TOL
from hzmp_planners.free_space.boxes import overlapping_bounds

_ROOM = 1e-6  # between a segment and the box of a leaf that may hold a part of it [m at S = 1]

if TYPE_CHECKING:
    from hzmp_planners.free_space.free_space import FreeSpace


def trace(space: FreeSpace, polyline: Floats) -> tuple[Floats, Ints] | None:
    """The same polyline with a waypoint wherever it changes its leaf, and the leaf of each segment.

    Of the leaves that hold a point, the one that holds most of what follows is taken.

    Args:
        space: the free space.
        polyline: shape (k, n), k >= 2 [m].

    Returns:
        Waypoints (K+1, n) [m] and leaves (K,); None when a part of the polyline is not free, or
        squeezes through where obstacles touch.
    """
    tol = MEMBERSHIP_TOL * space.scale
    tails, heads = polyline[:-1], polyline[1:]
    low, high = np.minimum(tails, heads), np.maximum(tails, heads)
    segment, leaf_near = overlapping_bounds(low, high, *space.leaf_boxes, -_ROOM * space.scale)
    enters, exits = _shares_inside(space, leaf_near, tails[segment], heads[segment], tol)
    ends = np.searchsorted(segment, np.arange(len(polyline))).tolist()
    points = [polyline[0]]
    leaves: list[int] = []
    for (p, q), (begin, end) in zip(pairwise(polyline), pairwise(ends), strict=True):
        near, first, last = leaf_near[begin:end], enters[begin:end], exits[begin:end]
        slack = tol / max(float(np.linalg.norm(q - p)), tol)
        share = 0.0
        while share < 1.0 - slack or not leaves:
            held = np.flatnonzero(first <= share + slack)
            row = int(held[last[held].argmax()]) if len(held) else -1
            if row < 0 or (last[row] <= share + slack and share < 1.0 - slack):
                return None
            leaf = int(near[row])
            at = p + share * (q - p)
            if leaves and not _connected(space, at, leaves[-1], leaf):
                return None
            share = min(1.0, float(last[row]))
            leaves.append(leaf)
            points.append(q if share >= 1.0 - slack else p + share * (q - p))
    return np.array(points), np.array(leaves, dtype=np.int64)


def _shares_inside(
    space: FreeSpace, leaves: Ints, p: Floats, q: Floats, tol: float
) -> tuple[Floats, Floats]:
    """Where segments from p to q (k, n) enter and leave a leaf each, as shares of it, shape (k,).

    A leaf that its segment misses has inf for the first.
    """
    A, b, starts = space.halfspaces
    counts = counts_of(starts)[leaves]
    rows = spans(starts[leaves], counts)
    owner = np.arange(len(leaves)).repeat(counts)
    A, b, starts = A.take(rows, axis=0), b.take(rows), starts_of(counts)
    height = np.einsum("ij,ij->i", A, p.take(owner, axis=0)) - b - tol
    slope = np.einsum("ij,ij->i", A, (q - p).take(owner, axis=0))
    level = np.abs(slope) <= tol
    crossing = -height / np.where(level, 1.0, slope)
    enters = np.where(level, np.where(height > 0.0, np.inf, -np.inf), -np.inf)
    enters[~level & (slope < 0.0)] = crossing[~level & (slope < 0.0)]
    exits = np.where(~level & (slope > 0.0), crossing, np.inf)
    first = np.maximum(reduced(np.maximum, enters, starts), 0.0)
    last = np.minimum(reduced(np.minimum, exits, starts), 1.0)
    missed = first > last
    return np.where(missed, np.inf, first), np.where(missed, -np.inf, last)


def _connected(space: FreeSpace, x: Floats, one: int, two: int) -> bool:
    """Whether leaves around a point lead from one leaf to another through faces at that point."""
    graph = space.graph
    if one == two or two in graph.ends[graph.faces_at(one)]:
        return True
    leaves = np.union1d(space.leaves_at(x), [one, two])
    faces = np.flatnonzero(np.isin(graph.ends, leaves).all(axis=1))
    labels = component_labels(np.searchsorted(leaves, graph.ends[faces]), len(leaves))
    here, there = np.searchsorted(leaves, [one, two])
    return bool(labels[here] == labels[there])
