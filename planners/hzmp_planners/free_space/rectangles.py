"""Rectangles along the axes of the world: where two of them overlap is no matter of clipping."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import counts_of
from hzmp_planners.free_space.polygons import Polygons

_ROUND = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.bool_)
"""Where corners are at the upper end along the two axes of the plane, counter-clockwise."""
_AXES = np.array([[1, 2], [0, 2], [0, 1]])
"""The axes of the plane at right angles to each axis."""


def are_rectangles(polygons: Polygons, dropped: Ints, tol: float) -> Bools:
    """Which polygons are rectangles at right angles to an axis, with sides along the others.

    Args:
        polygons: in space, whose corners are distinct.
        dropped: the axis that each one's normal is nearest to, shape (m,).
        tol: by which corners may be off [m]: round-off.
    """
    low, high = polygons.bounds
    owner = polygons.vertex_owner
    at_end = polygons.vertices <= (low + tol).take(owner, axis=0)
    at_end |= polygons.vertices >= (high - tol).take(owner, axis=0)
    rows = np.arange(len(polygons))
    found = counts_of(polygons.vertex_starts) == 4
    found &= high[rows, dropped] - low[rows, dropped] <= tol
    found[owner[~at_end.all(axis=1)]] = False
    return np.asarray(found)


def common_rectangles(polygons: Polygons, one: Ints, two: Ints, dropped: Ints) -> Floats:
    """What pairs of rectangles that overlap have in common, shape (k, 4, 3) [m].

    Args:
        polygons: in space.
        one: a rectangle of each pair, shape (k,).
        two: the other, on the same plane.
        dropped: the axis that their normals are along, shape (k,).
    """
    low, high = polygons.bounds
    start = np.maximum(low.take(one, axis=0), low.take(two, axis=0))
    stop = np.minimum(high.take(one, axis=0), high.take(two, axis=0))
    rows = np.arange(len(one))
    level = low[one, dropped]
    corners = np.empty((len(one), 4, 3))
    corners[rows, :, dropped] = level[:, None]
    for side in (0, 1):
        axis = _AXES[dropped, side]
        ends = np.stack([start[rows, axis], stop[rows, axis]], axis=1)
        corners[rows, :, axis] = ends[:, _ROUND[:, side].astype(np.int64)]
    return corners
