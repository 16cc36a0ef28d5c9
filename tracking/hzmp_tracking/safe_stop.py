"""The fastest stop that is proved to stay in a cell: what a loop flies when nothing else is safe.

Braking each axis as fast as its limits allow is the fastest stop of all; where it stays in the cell
and within the limits on norms it is the answer, and so is braking on the line of motion where norms
alone are bounded. Where neither does (in a slanted cell, say, one axis must brake later), a spline
is looked for (`quick_spline`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, as_point
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking.arguments import start_state
from hzmp_tracking.constants import LIMIT_TOL
from hzmp_tracking.limits import Limits
from hzmp_tracking.quick_spline import quick_stop
from hzmp_tracking.stops import Pieces, box_for, brake_straight, from_state
from hzmp_tracking.trajectory import Trajectory

_RESOLUTION = 0.01  # of the duration: a stop that is longer by less is as good
_LONGER = (1.2, 2.0)  # times the fastest stop of all


def stop_trajectory(
    position: ArrayLike,
    velocity: ArrayLike,
    cells: Polytope | Sequence[Polytope],
    limits: Limits,
    acceleration: ArrayLike | None = None,
) -> Trajectory:
    """Come to rest as fast as possible, inside one cell at every instant.

    Args:
        position: shape (n,) [m].
        velocity: shape (n,) [m/s].
        cells: convex cells; the stop is in the one in which it is fastest.
        limits: bounds on axes and norms.
        acceleration: shape (n,) [m/s^2]; zero when None.

    Returns:
        Trajectory with `containment` at most 0. Where braking each axis on its own stays in a cell
        and within all limits no stop is faster; else it is the fastest that was found.

    Raises:
        ShapeError: shapes that do not fit each other, or no cell.
        QueryError: a state beyond the limits, or no stop inside any cell was found.
    """
    chain = (cells,) if isinstance(cells, Polytope) else tuple(cells)
    if not chain:
        raise ShapeError("cells must hold at least one Polytope, got none")
    n = chain[0].n
    point = as_point(position, "position", n)
    v, a = start_state(velocity, acceleration, limits, n)
    # Without the norms: within all limits no stop is faster.
    axes_only = replace(limits, speed=None, total_acceleration=None, total_jerk=None)
    braking = from_state(point, v, a, None, axes_only, (0, 1))
    stops = [_in_cell(braking, cell, limits) for cell in chain]
    safe = [stop for stop in stops if _safe(stop)]
    if safe:
        return safe[0]
    straight = brake_straight(point, v, a, limits, (0, 1))
    lines = [] if straight is None else [_in_cell(straight, cell, limits) for cell in chain]
    found = [line for line in lines if _safe(line)]
    if not found or found[0].duration > (1.0 + _RESOLUTION) * braking.duration:
        start = np.array([point, v, a])
        searched = [_spline_stop(start, cell, limits, braking.duration) for cell in chain]
        found += [stop for stop in searched if stop is not None]
    if not found:
        least = min(stop.containment for stop in stops)
        raise QueryError(
            f"no stop inside the cell was found from {point.tolist()} at {v.tolist()} m/s: "
            f"braking on every axis at once leaves it by {least:.3g} m"
        )
    return min(found, key=lambda stop: stop.duration)


def _safe(stop: Trajectory) -> bool:
    return bool(stop.containment <= 0.0 and stop.limit_usage.max() <= 1.0 + LIMIT_TOL)


def _in_cell(pieces: Pieces, cell: Polytope, limits: Limits) -> Trajectory:
    times = np.concatenate([[0.0], np.cumsum(pieces.durations)])
    owners = np.zeros(len(pieces.durations), dtype=np.int64)
    ends = np.array([pieces.coefficients[0, 0], pieces.end])
    return Trajectory(times, pieces.coefficients, owners, (cell,), ends, limits)


def _spline_stop(
    start: Floats, cell: Polytope, limits: Limits, shortest: float
) -> Trajectory | None:
    """A spline to rest, expected to take a little or much longer than the fastest stop of all."""
    for longer in _LONGER:
        pieces = quick_stop(
            start, cell, Limits(*box_for(start[1], start[2], limits)), longer * shortest
        )
        if pieces is not None:
            stop = _in_cell(pieces, cell, limits)
            if _safe(stop):
                return stop
    return None
