"""Estimate of how a fast run along a polyline divides its time among the segments."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats

_EFFORT = 0.85  # of the acceleration limit: what jerk leaves of it on average
_ROOM = 0.05  # [m] a corner can always be cut by
_LEAST = 0.02  # [s] in a segment


def segment_times(
    points: Floats, velocity: Floats, limits: tuple[Floats, Floats, Floats]
) -> Floats:
    """Time in each segment of a run that ends at rest, shape (K,) [s].

    Trapezoids of speed along the segments; a corner is passed at the speed at which the
    acceleration limit can turn the velocity within the shorter of its two segments. Within some
    15 % of the fastest run, and cheap: nothing is solved.

    Args:
        points: corners, shape (K + 1, n) [m].
        velocity: at the start, shape (n,) [m/s].
        limits: velocity, acceleration and jerk of each axis, each (n,).
    """
    sides = np.diff(points, axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    directions = sides / np.maximum(lengths, 1e-12)[:, None]
    shares = np.maximum(np.abs(directions), 0.2)  # a resting axis would allow any speed
    top = (limits[0] / shares).min(axis=1)
    thrust = _EFFORT * (limits[1] / shares).min(axis=1)
    turns = np.maximum(np.linalg.norm(np.diff(directions, axis=0), axis=1), 1e-9)
    room = np.minimum(lengths[:-1], lengths[1:]) + _ROOM
    corner = np.sqrt(np.minimum(thrust[:-1], thrust[1:]) / _EFFORT * room / turns)
    first = float(velocity @ directions[0])
    speeds = [max(first, 0.0), *np.minimum(corner, np.minimum(top[:-1], top[1:])).tolist(), 0.0]
    ways, tops, pushes = lengths.tolist(), top.tolist(), thrust.tolist()
    count = len(ways)
    for k in range(count):
        speeds[k + 1] = min(speeds[k + 1], (speeds[k] ** 2 + 2.0 * pushes[k] * ways[k]) ** 0.5)
    for k in reversed(range(1, count)):
        speeds[k] = min(speeds[k], (speeds[k + 1] ** 2 + 2.0 * pushes[k] * ways[k]) ** 0.5)
    times = np.empty(count)
    for k in range(count):
        before, after, push = speeds[k], speeds[k + 1], pushes[k]
        peak = min(tops[k], (push * ways[k] + 0.5 * (before**2 + after**2)) ** 0.5)
        peak = max(peak, before, after)
        changing = (2.0 * peak - before - after) / push
        covered = (2.0 * peak**2 - before**2 - after**2) / (2.0 * push)
        times[k] = max(changing + max(ways[k] - covered, 0.0) / max(peak, 1e-9), _LEAST)
    ramp = 0.5 * float((limits[1] / limits[2]).min())
    times[-1] += ramp
    if first <= 0.0:
        times[0] += ramp + 2.0 * max(-first, 0.0) / pushes[0]
    return times
