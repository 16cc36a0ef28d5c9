"""Polylines through a free space: which leaf holds which part."""

from __future__ import annotations

import math
from itertools import pairwise
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats, Ints
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
    # A leaf that its segment misses enters at inf: with the others as plain numbers it is found at
    # once, where arrays of a few entries would take most of the time.
    rows = list(zip(leaf_near.tolist(), enters.tolist(), exits.tolist(), strict=True))
    points = [polyline[0]]
    leaves: list[int] = []
    for (p, q), (begin, end) in zip(pairwise(polyline), pairwise(ends), strict=True):
        slack = tol / max(math.dist(p, q), tol)
        share = 0.0
        while share < 1.0 - slack or not leaves:
            held = [row for row in rows[begin:end] if row[1] <= share + slack]
            leaf, _, last = max(held, key=itemgetter(2), default=(-1, 0.0, -math.inf))
            if leaf < 0 or (last <= share + slack and share < 1.0 - slack):
                return None
            share = min(1.0, last)
            leaves.append(leaf)
            points.append(q if share >= 1.0 - slack else p + share * (q - p))
    waypoints, passed = np.array(points), np.array(leaves, dtype=np.int64)
    changes = np.flatnonzero(passed[1:] != passed[:-1])
    _, joined = space.graph.joining(passed[changes], passed[changes + 1])
    for k in np.delete(changes, joined).tolist():
        if not _connected(space, waypoints[k + 1], leaves[k], leaves[k + 1]):
            return None
    return waypoints, passed


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
    graph, around = space.graph, {*space.leaves_at(x).tolist(), two}
    queue = [one]
    while queue and two in around:
        leaf = queue.pop()
        beyond = set(graph.ends[graph.faces_at(leaf)].ravel().tolist()) & around
        around -= beyond
        queue += beyond
    return two not in around
