"""The fastest stop that is proved to stay in a cell: what a loop flies when nothing else is safe.

Braking each axis as fast as its limits allow is the fastest stop of all; where it stays in the cell
and within the limits on norms it is the answer, and so is braking on the line of motion where norms
alone are bounded. Where neither does (in a slanted cell, say, one axis must brake later), a spline
of even steps is looked for: control points inside the cell and derivatives within the limits are a
cone program for a given duration, which is bisected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from hzmp_planners._arrays import Floats, as_point
from hzmp_planners._clarabel import Cone, second_order_cones, solve_socp
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking.constants import LIMIT_TOL
from hzmp_tracking.limits import Limits
from hzmp_tracking.spline import Spline
from hzmp_tracking.stops import Pieces, brake_straight, from_state
from hzmp_tracking.timing import start_state
from hzmp_tracking.trajectory import Trajectory

_PIECES = 14
_LONGER = (1.2, 1.6, 2.2, 3.2)  # times the fastest stop of all; pieces of longer ones are coarse
_RESOLUTION = 0.01  # of the duration
_SHARE = 1.0 - 1e-7  # of limits and of the way to the facets: far above the solver's tolerance
_MARGIN = 1e-7  # [m] to the facets


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
        searched = [_spline_stop(point, v, a, cell, limits, braking.duration) for cell in chain]
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
    point: Floats, v: Floats, a: Floats, cell: Polytope, limits: Limits, shortest: float
) -> Trajectory | None:
    """The shortest spline found, by bisection between the fastest stop of all and a longer one."""
    low, best = shortest, None
    for longer in _LONGER:
        best = _stop_within(point, v, a, cell, limits, longer * shortest)
        if best is not None:
            break
        low = longer * shortest
    while best is not None and best.duration - low > _RESOLUTION * low:
        middle = 0.5 * (low + best.duration)
        trial = _stop_within(point, v, a, cell, limits, middle)
        if trial is None:
            low = middle
        else:
            best = trial
    return best


def _stop_within(
    point: Floats, v: Floats, a: Floats, cell: Polytope, limits: Limits, duration: float
) -> Trajectory | None:
    """A spline to rest with its control points in the cell and within the limits; None if none."""
    n, d = point.size, np.full(_PIECES, duration / _PIECES)
    # With the identity as control points the values are the matrices of the linear maps.
    maps = Spline(np.eye(_PIECES + 3), d)
    start = np.zeros((_PIECES + 3, n))
    start[0] = point
    start[1] = start[0] + v * maps.steps_1[0] / 3.0
    start[2] = start[1] + (v + a * maps.steps_2[0] / 2.0) * maps.steps_1[1] / 3.0
    free = np.eye(_PIECES + 3)[:, 3 : _PIECES + 1]
    free[-2:] = free[-3]  # the last three are one point: rest
    jerk = maps.change_3.value / d[:, None]
    rows: list[Floats] = []
    room: list[Floats] = []
    cones: list[Cone] = []
    cone_rows: list[Floats] = []
    cone_room: list[Floats] = []
    unknowns = free.shape[1]
    for matrix, bounds, norm in zip(
        (maps.V.value, maps.A.value, jerk), limits.per_axis(n), limits.norms, strict=True
    ):
        moves, fixed = matrix @ free, matrix @ start
        used = np.abs(moves).max(axis=1) > 0.0
        if np.isfinite(norm):
            count = int(used.sum())
            cone = np.zeros((count, n + 1, n, unknowns))
            cone[:, 1 + np.arange(n), np.arange(n)] = -moves[used, None]
            cone_rows.append(cone.reshape(-1, n * unknowns))
            tops = np.full((count, 1), _SHARE * norm)
            cone_room.append(np.hstack([tops, fixed[used]]).ravel())
            cones += second_order_cones(n + 1, count)
        for sign in (1.0, -1.0):
            for axis in range(n):
                block = np.zeros((int(used.sum()), n, moves.shape[1]))
                block[:, axis] = sign * moves[used]
                rows.append(block.reshape(len(block), -1))
                room.append(_SHARE * bounds[axis] - sign * fixed[used, axis])
    points = np.concatenate([maps.left.value, maps.right.value, maps.knots.value])
    moves, fixed = points @ free, points @ start
    inside = moves[:, None, None, :] * cell.A[None, :, :, None]  # point, facet, axis, unknown
    used = np.abs(moves).max(axis=1) > 0.0
    rows.append(inside[used].reshape(-1, n * moves.shape[1]))
    room.append((cell.b - _MARGIN - fixed[used] @ cell.A.T).ravel())
    A, b = np.concatenate(rows), np.concatenate(room)
    # The least excess over all facets, so that the program has an interior.
    excess = np.zeros((len(A) + sum(map(len, cone_rows)), 1))
    excess[len(A) - len(room[-1]) : len(A)] = -1.0
    cost = np.append(np.zeros(A.shape[1]), 1.0)
    program = sparse.csc_array(np.hstack([np.concatenate([A, *cone_rows]), excess]))
    offsets = np.concatenate([b, *cone_room])
    solution = solve_socp(cost, program, offsets, [("nonnegative", len(b)), *cones])
    if not solution.solved:
        return None
    control = start + free @ solution.x[:-1].reshape(n, -1).T
    spline = Spline(control, d)
    stop = _in_cell(Pieces(spline.coefficients(), d, ((0, 1),) * _PIECES), cell, limits)
    return stop if _safe(stop) else None
