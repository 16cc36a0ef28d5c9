"""Proof that a trajectory stays clear of what moves, at every instant, as it is predicted.

In a slab of time a moving obstacle lies in a polytope {A x <= b}; a point outside of one facet is
outside of all of it. A piece of the trajectory within a slab lies in the hull of its Bezier points,
so it is clear when all of them are outside of one facet. Pieces for which no facet will do are
halved (de Casteljau), until one does or they are too short to matter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_sim.replanning.commitment import Commitment
from hzmp_tracking import Trajectory

if TYPE_CHECKING:
    from hzmp_sim.motion.source import Slabs

_HALVINGS = 5  # of at most a slab
_TIME_TOL = 1e-9  # [s] pieces that are shorter are left out


class Conflict(NamedTuple):
    """The first instant from which a trajectory is not proved to be clear."""

    time: float
    """[s]"""
    number: int
    """Of the moving obstacle, in the order of the prediction."""


def first_conflict(commitment: Commitment, slabs: Slabs, since: float) -> Conflict | None:
    """Where a trajectory, or the rest at its end, is first not proved clear; None if it is.

    Args:
        commitment: the trajectory.
        slabs: where the centre must not be, slab by slab.
        since: simulated time from which it matters [s]; until the last slab.
    """
    if not slabs.b.size:
        return None
    times, points = _pieces(commitment, slabs, since)
    lengths = np.diff(times)
    times = times[:-1]
    slab = np.floor((times + 0.5 * lengths - slabs.start) / slabs.step).astype(np.int64)
    slab = slab.clip(0, len(slabs.b) - 1)
    inside = _unproved(points, slabs, slab)
    for _ in range(_HALVINGS):
        rows = np.flatnonzero(inside.any(axis=1))
        if not rows.size:
            return None
        times, lengths, slab = times[rows], 0.5 * lengths[rows], slab[rows]
        times = np.stack([times, times + lengths], axis=1).ravel()
        lengths, slab = lengths.repeat(2), slab.repeat(2)
        points = _halves(points[rows])
        inside = _unproved(points, slabs, slab)
    rows = np.flatnonzero(inside.any(axis=1))
    if not rows.size:
        return None
    first = rows[times[rows].argmin()]
    return Conflict(float(times[first]), int(inside[first].argmax()))


def _unproved(points: Floats, slabs: Slabs, slab: Ints) -> Bools:
    """Of each piece and obstacle whether no facet parts them, shape (pieces, obstacles).

    `points` are Bezier points, shape (pieces, 4, n).
    """
    # The first facets are those of a box: few pairs are left for the others.
    box = 2 * points.shape[2]
    lowest = _lowest(points, slabs.A[:, :box])
    inside = (lowest - slabs.b[slab, :, :box]).max(axis=2) < 0.0
    pieces, items = np.nonzero(inside)
    if pieces.size:
        heights = points[pieces] @ slabs.A[items].transpose(0, 2, 1)
        gaps = heights.min(axis=1) - slabs.b[slab[pieces], items]
        inside[pieces, items] = gaps.max(axis=1) < 0.0
    return np.asarray(inside)


def _lowest(points: Floats, normals: Floats) -> Floats:
    """Least heights of pieces (k, 4, n) along normals (g, F, n), shape (k, g, F)."""
    count, order, n = points.shape
    g, facets, _ = normals.shape
    heights = points.reshape(-1, n) @ normals.reshape(-1, n).T
    return np.asarray(heights.reshape(count, order, g, facets).min(axis=1))


def _pieces(commitment: Commitment, slabs: Slabs, since: float) -> tuple[Floats, Floats]:
    """Borders of the pieces (k + 1,) [s], and the Bezier points of each (k, 4, n) [m]."""
    trajectory, end = commitment.trajectory, slabs.start + slabs.step * len(slabs.b)
    borders = slabs.start + slabs.step * np.arange(len(slabs.b) + 1)
    breaks = commitment.begins + trajectory.breakpoints
    times = np.union1d(borders, breaks)
    times = times[(times > since + _TIME_TOL) & (times < end - _TIME_TOL)]
    times = np.concatenate([[since], times, [end]])
    return times, bezier_points(trajectory, times - commitment.begins)


def bezier_points(trajectory: Trajectory, times: Floats) -> Floats:
    """Bezier points of a trajectory between times (k + 1,) [s], shape (k, 4, n) [m].

    No breakpoint lies between two times. After its end the trajectory rests.
    """
    middle = 0.5 * (times[:-1] + times[1:])
    piece = np.searchsorted(trajectory.breakpoints, middle, side="right") - 1
    piece = piece.clip(0, len(trajectory.coefficients) - 1)
    c = trajectory.coefficients[piece]
    local = times.clip(0.0, trajectory.duration)
    u = (local[:-1] - trajectory.breakpoints[piece])[:, None]
    h = np.diff(local)[:, None]
    # Taylor expansion at u, in terms of the share of h that has passed.
    x0 = c[:, 0] + u * (c[:, 1] + u * (c[:, 2] + u * c[:, 3]))
    x1 = h * (c[:, 1] + u * (2.0 * c[:, 2] + 3.0 * u * c[:, 3]))
    x2 = h**2 * (c[:, 2] + 3.0 * u * c[:, 3])
    x3 = h**3 * c[:, 3]
    one = x0 + x1 / 3.0
    two = x0 + (2.0 * x1 + x2) / 3.0
    return np.stack([x0, one, two, x0 + x1 + x2 + x3], axis=1)


def _halves(points: Floats) -> Floats:
    """Bezier points of both halves of each piece, (2 k, 4, n), by de Casteljau."""
    a, b, c, d = points.transpose(1, 0, 2)
    ab, bc, cd = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + d)
    abc, bcd = 0.5 * (ab + bc), 0.5 * (bc + cd)
    middle = 0.5 * (abc + bcd)
    first = np.stack([a, ab, abc, middle], axis=1)
    last = np.stack([middle, bcd, cd, d], axis=1)
    return np.stack([first, last], axis=1).reshape(-1, 4, points.shape[2])
