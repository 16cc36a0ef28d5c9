"""Which convex obstacles a polyline passes through, and where first."""

from __future__ import annotations

import math

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.motion.hulls import Hulls

_TOUCH = 1e-9  # [m] a polyline that goes no deeper runs along the obstacle


def crossed(waypoints: Floats, obstacles: Hulls) -> tuple[list[int], float]:
    """Numbers of the obstacles whose interior a polyline meets, and how far it comes before [m].

    Args:
        waypoints: shape (k + 1, n) [m].
        obstacles: convex sets.

    Returns:
        The numbers in ascending order, and the length of the polyline until it first enters one;
        inf if it enters none.
    """
    count, facets, n = obstacles.A.shape
    begins, moves = waypoints[:-1], np.diff(waypoints, axis=0)
    normals = obstacles.A.reshape(-1, n).T
    # One row for each segment and obstacle.
    room = obstacles.b.ravel() - _TOUCH - begins @ normals
    room = room.reshape(len(moves), count, facets)
    rates = (moves @ normals).reshape(room.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = room / rates
    # Inside of a facet before the share where the way leaves it, after that where it enters.
    leave = np.where(rates > 0.0, shares, math.inf).min(axis=2)
    enter = np.where(rates < 0.0, shares, -math.inf).max(axis=2)
    never = ((rates == 0.0) & (room <= 0.0)).any(axis=2)
    enter, leave = np.maximum(enter, 0.0), np.minimum(leave, 1.0)
    meets = (enter < leave) & ~never
    if not meets.any():
        return [], math.inf
    lengths = np.linalg.norm(moves, axis=1)
    before = np.concatenate([[0.0], lengths.cumsum()])[:-1]
    reached = (before[:, None] + enter * lengths[:, None])[meets]
    return np.flatnonzero(meets.any(axis=0)).tolist(), float(reached.min())


def shortened(waypoints: Floats, length: float) -> Floats:
    """The first part of a polyline (k + 1, n), of that length or all of it [m]."""
    steps = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    before = np.concatenate([[0.0], steps.cumsum()])
    if length >= before[-1]:
        return waypoints
    last = int(np.searchsorted(before, length, side="right")) - 1
    share = (length - before[last]) / steps[last]
    end = waypoints[last] + share * (waypoints[last + 1] - waypoints[last])
    return np.vstack([waypoints[: last + 1], end])
