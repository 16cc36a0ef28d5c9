"""Boxes: the workspace as a cell, and which bounds overlap."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.free_space.cells import Cells
from hzmp_planners.free_space.polygons import Polygons
from hzmp_planners.free_space.polyhedra import Polyhedra

_ROWS = 4096  # boxes whose pairs with all others are held at a time


def overlapping_bounds(
    lows: Floats, highs: Floats, other_lows: Floats, other_highs: Floats, room: float
) -> tuple[Ints, Ints]:
    """Pairs of a box and another that overlap on every axis by more than `room`.

    Args:
        lows: lowest coordinates of the boxes, shape (m, n) [m].
        highs: highest coordinates.
        other_lows: lowest coordinates of the others, shape (k, n) [m].
        other_highs: highest coordinates.
        room: [m]; below 0 boxes may be that far apart.

    Returns:
        Rows of both, ordered by the first.
    """
    found = [np.zeros((2, 0), dtype=np.int64)]
    for start in range(0, len(lows), _ROWS):
        rows = slice(start, start + _ROWS)
        meets = np.ones((len(lows[rows]), len(other_lows)), dtype=np.bool_)
        for axis in range(lows.shape[1]):
            meets &= lows[rows, axis, None] < other_highs[:, axis] - room
            meets &= highs[rows, axis, None] > other_lows[:, axis] + room
        one, two = meets.nonzero()
        found.append(np.stack([one + start, two]))
    one, two = np.concatenate(found, axis=1)
    return one, two


def along_axes(normals: Floats) -> Bools:
    """Which unit normals are along an axis, to the last bit."""
    return np.asarray(np.count_nonzero(normals, axis=1) == 1)


def box_cell(lo: Floats, hi: Floats, labels: Ints, copies: int = 1) -> Cells:
    """A box as a cell, or as several.

    Args:
        lo: lower corner, shape (n,) with n = 2 or 3 [m].
        hi: upper corner.
        labels: of its upper walls, then of its lower ones, shape (2 n,).
        copies: how many.
    """
    return _single(lo, hi, labels).take(np.zeros(copies, dtype=np.int64))


def _single(lo: Floats, hi: Floats, labels: Ints) -> Cells:
    if lo.size == 2:
        corners = np.array([[lo[0], lo[1]], [hi[0], lo[1]], [hi[0], hi[1]], [lo[0], hi[1]]])
        return Polygons.of(corners, np.array([0, 4]), labels[[3, 0, 1, 2]])
    bits = np.arange(8)[:, None] >> np.arange(3) & 1
    edges, facets = [], []
    for axis in range(3):
        for corner in (bits[:, axis] == 0).nonzero()[0].tolist():
            edges.append((corner, corner + (1 << axis)))
            facets.append([k if bits[corner, k] else 3 + k for k in range(3) if k != axis])
    return Polyhedra(
        np.where(bits == 1, hi, lo),
        np.array([0, 8]),
        labels,
        np.array([0, 6]),
        np.array(edges).T,
        np.array(facets).T,
        np.array([0, 12]),
    )
