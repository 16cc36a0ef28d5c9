"""The shortest path among boxes in the plane, exactly: the yardstick of the benchmarks in 2-D.

In the plane a shortest path bends at corners of obstacles only, around which it is locally taut.
So the nodes are the corners, and an edge is a free segment that leaves the boxes at both of its
ends on one side.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from hzmp_planners._arrays import Bools, Floats, Ints

GROWTH = 1e-9
"""Boxes are grown by this, relative to the workspace: what only touches leaves no way between. The
cost is too long by as much, and a gap narrower than twice this is closed."""
MOST_BOXES = 1000
"""More than these take too long: pairs of corners grow with their square, tests with the cube."""
_SLACK = 1e-3  # of the growth: a segment this deep in a box still only touches it
_CHUNK = 1_000_000  # tests of a segment with a box at once


def shortest_path(
    lo: Floats, hi: Floats, low: Floats, high: Floats, start: Floats, goal: Floats
) -> Floats | None:
    """Corners of a shortest path, shape (K+1, 2) [m], start and goal included; None: there is none.

    Args:
        lo: lower corner of the workspace, shape (2,) [m].
        hi: upper corner of it.
        low: lower corners of the boxes, shape (N, 2) [m].
        high: upper corners of them.
        start: shape (2,) [m].
        goal: shape (2,) [m].
    """
    growth = GROWTH * float((hi - lo).max())
    grown = low - growth, high + growth
    slack = _SLACK * growth
    inner = grown[0] + slack, grown[1] - slack
    corners, signs = _corners(*grown)
    within = np.flatnonzero(((corners >= lo) & (corners <= hi)).all(axis=1))
    use = within[~_inside(corners[within], *inner)]
    nodes = np.vstack([start, goal, corners[use]])
    # Start and goal are taut in every direction: no sign.
    sides = np.vstack([np.zeros((2, 2)), signs[use]])
    i, j = _taut_pairs(nodes, sides, slack)
    seen = _free(nodes[i], nodes[j], *inner)
    i, j = i[seen], j[seen]
    lengths = np.hypot(*(nodes[i] - nodes[j]).T)
    graph = csr_array((lengths, (i, j)), shape=(len(nodes), len(nodes)))
    distance, before = dijkstra(graph, directed=False, indices=[0], return_predecessors=True)
    if np.isinf(distance[0, 1]):
        return None
    path = [1]
    while path[-1] != 0:
        path.append(int(before[0, path[-1]]))
    return nodes[path[::-1]]


def _corners(low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Corners of boxes, shape (4 N, 2), and on which sides of its box each lies (+1 or -1)."""
    signs = np.array([(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)])
    ends = np.where(signs[:, None, :] < 0.0, low, high)
    return ends.reshape(-1, 2), np.repeat(signs, len(low), axis=0)


def _inside(points: Floats, low: Floats, high: Floats) -> Bools:
    """Which points (k, 2) are strictly inside a box."""
    x, y = points[:, 0, None], points[:, 1, None]
    inside = (x > low[:, 0]) & (x < high[:, 0]) & (y > low[:, 1]) & (y < high[:, 1])
    return np.asarray(inside.any(axis=1))


def _taut_pairs(nodes: Floats, sides: Floats, slack: float) -> tuple[Ints, Ints]:
    """Pairs of nodes whose line leaves the box at both ends on one side.

    At a corner with the signs (sx, sy) the box lies towards (-sx, -sy): the line along (dx, dy)
    cuts it when sx dx and sy dy have one sign.
    """
    i, j = np.triu_indices(len(nodes), 1)
    d = np.abs(nodes[j] - nodes[i]) > slack  # components that count
    rising = (np.sign(nodes[j] - nodes[i]) * d).prod(axis=1)
    taut = (rising * sides[i].prod(axis=1) <= 0.0) & (rising * sides[j].prod(axis=1) <= 0.0)
    return i[taut], j[taut]


def _free(p: Floats, q: Floats, low: Floats, high: Floats) -> Bools:
    """Which segments from p to q, each (k, 2), meet no box's interior.

    The open box holds p + t d for t between the last entry and the first exit of its two slabs.
    """
    free = np.ones(len(p), dtype=np.bool_)
    if not len(low):
        return free
    step = max(1, _CHUNK // len(low))
    for first in range(0, len(p), step):
        part = slice(first, first + step)
        enter, leave = np.zeros((2, len(p[part]), 1))
        leave = leave + 1.0
        with np.errstate(divide="ignore", invalid="ignore"):
            for axis in (0, 1):
                at, d = p[part, axis, None], (q - p)[part, axis, None]
                one, two = (low[:, axis] - at) / d, (high[:, axis] - at) / d
                # Along the other axis (d = 0) these are infinite, or nan on the edge: outside.
                enter = np.maximum(enter, np.minimum(one, two))
                leave = np.minimum(leave, np.maximum(one, two))
            free[part] = ~(enter < leave).any(axis=1)
    return free
