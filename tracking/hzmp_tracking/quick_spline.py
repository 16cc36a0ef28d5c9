"""A good cubic spline in a corridor from a single linear program.

Where `corridor_spline` moves the steps of the spline in many programs, here they are fixed
fractions of the duration, after an estimate of the time in each cell (`pace`); the program
(`quick_program`) finds control points and duration. Where the spline leaves the cells, the times at
which it changes cells are those for the next program.

As everywhere, what keeps cells and limits is judged afterwards, exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.sets import Polytope
from hzmp_tracking.constants import LIMIT_TOL
from hzmp_tracking.containment import derivative_maxima
from hzmp_tracking.limits import Limits
from hzmp_tracking.pace import segment_times
from hzmp_tracking.quick_program import MARGIN, Frame, solve
from hzmp_tracking.stops import Pieces

_STEP = 0.1  # [s] wanted between knots
_FEWEST, _MOST = 8, 13  # pieces, where cells do not ask for more
_STOP_PIECES = 12  # of a stop in one cell
_LEFT = 0.4  # of the excess, after timing again; above it a third program was not seen to help
_SAMPLES = 120  # of a spline, to see where it changes cells
_LEAST = 0.01  # [s] in a cell
_CLOSE = 2e-3  # [s] between knots: jerk is too sensitive to shorter steps


def quick_spline(
    points: Floats,
    cells: Sequence[Polytope],
    limits: Limits,
    velocity: Floats,
    acceleration: Floats,
    rounds: int = 3,
) -> Pieces | None:
    """A spline from the first to the last point, to rest; None when none was found.

    Args:
        points: polyline whose segment k lies in cell k, shape (K + 1, n) [m].
        cells: K polytopes.
        limits: bounds on each axis.
        velocity: at the start, shape (n,) [m/s].
        acceleration: at the start, shape (n,) [m/s^2].
        rounds: programs at most. One is enough unless a cell has no room for the spline at the
            time at which it was expected there, or a start in motion takes much longer or shorter
            than expected.
    """
    times = segment_times(points, velocity, limits.per_axis(points.shape[1]))
    start = np.array([points[0], velocity, acceleration])
    return _search(times, cells, start, points[-1], limits, 1, rounds)


def quick_stop(
    start: Floats, cell: Polytope, limits: Limits, expected: float, rounds: int = 3
) -> Pieces | None:
    """A spline to rest anywhere in one cell; None when none was found.

    Args:
        start: position, velocity and acceleration, shape (3, n).
        cell: holds the position.
        limits: bounds on each axis.
        expected: duration [s], roughly.
        rounds: programs at most.
    """
    return _search(np.array([expected]), (cell,), start, None, limits, _STOP_PIECES, rounds)


def _search(
    times: Floats,
    cells: Sequence[Polytope],
    start: Floats,
    goal: Floats | None,
    limits: Limits,
    fewest: int,
    rounds: int,
) -> Pieces | None:
    """Programs with times in each cell that follow from the one before, until one is kept."""
    bounds = np.array(limits.per_axis(start.shape[1]))
    before = np.inf  # excess over the cells
    for _ in range(rounds):
        expected = float(times.sum())
        d, owner = _knots(times, start[2], bounds[2], fewest)
        frame = Frame(d / expected, owner, start, goal, bounds)
        found = solve(frame, cells, expected)
        if found is None:
            return None
        coefficients, steps, outside = found
        shares = (np.array(derivative_maxima(coefficients, steps)) / bounds).max(axis=1)
        stretch = float((shares ** (1.0, 1.0 / 2.0, 1.0 / 3.0)).max())
        if frame.resting:
            coefficients = coefficients / stretch ** np.arange(4.0)[:, None]
            steps = steps * stretch
        if outside <= MARGIN and (frame.resting or stretch <= 1.0 + LIMIT_TOL):
            windows = tuple((max(k - 1, 0), min(k + 2, len(cells))) for k in owner.tolist())
            return Pieces(coefficients, steps, windows)
        times = times * (float(steps.sum()) / expected)
        if outside > MARGIN:
            if len(cells) == 1 or outside > _LEFT * before:  # timing again will not do
                return None
            before = outside
            times, fewest = _times(coefficients, steps, cells, times), 2
    return None


def _knots(times: Floats, acceleration: Floats, jerk: Floats, fewest: int) -> tuple[Floats, Ints]:
    """Steps between knots, even in each cell, and the cell of each piece.

    Further knots are where the given accelerations can have ended.
    """
    changes = np.cumsum(times)
    step = min(max(_STEP, changes[-1] / _MOST), changes[-1] / _FEWEST)
    counts = np.maximum(np.ceil(times / step - 0.5), fewest).astype(np.int64)
    ends = np.abs(acceleration) / jerk
    steps = np.repeat(times / counts, counts)
    knots = np.unique(np.concatenate([[0.0], np.cumsum(steps), ends[ends < 0.5 * changes[-1]]]))
    knots = knots[np.append(True, np.diff(knots) > _CLOSE)]
    middle = 0.5 * (knots[:-1] + knots[1:])
    return np.diff(knots), np.searchsorted(changes[:-1], middle)


def _times(
    coefficients: Floats, steps: Floats, cells: Sequence[Polytope], planned: Floats
) -> Floats:
    """Time that the spline spends in each cell, changing over where the next one holds it better.

    Between the changes before and after, next to where it was planned; there if there is none.
    """
    knots = np.concatenate([[0.0], np.cumsum(steps)])
    times = np.linspace(0.0, knots[-1], _SAMPLES)
    piece = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, steps.size - 1)
    s = (times - knots[piece])[:, None]
    c0, c1, c2, c3 = coefficients[piece].transpose(1, 0, 2)
    at = c0 + s * (c1 + s * (c2 + s * c3))
    depth = [(at @ cell.A.T - cell.b).max(axis=1) for cell in cells]
    old = np.concatenate([[0.0], np.cumsum(planned)])
    changes = old.copy()
    for k, (here, there) in enumerate(pairwise(depth), start=1):
        ahead = here - there
        i = 1 + np.flatnonzero((ahead[:-1] <= 0.0) & (ahead[1:] > 0.0))
        when = times[i - 1] + times[1] * ahead[i - 1] / (ahead[i - 1] - ahead[i])
        when = when[(when > changes[k - 1]) & (when < old[k + 1])]
        if when.size:
            changes[k] = when[np.argmin(np.abs(when - old[k]))]
    return np.maximum(np.diff(changes), _LEAST)
