"""A good cubic spline in a corridor from a single linear program.

Where `corridor_spline` moves the steps of the spline in many programs, here they are fixed
fractions of the duration T, after an estimate of the time in each cell (`pace`). With c the control
points,

    |V(c)| <= v T,    |A(c)| <= a T^2,    |J(c)| <= j T^3,    V, A, J for T = 1,

and the tangents of T^2 and T^3 lie below them: the linear program in c and T that they leave keeps
the limits wherever it is solved. A start in motion fixes two more control points, the second of
which is quadratic in T; only this is made up for afterwards. Leaving the cells has a price, so that
there is always a solution: where it leaves them, the times at which it changes cells are those for
the next program.

As everywhere, what keeps cells and limits is judged afterwards, exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import sparse

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._clarabel import solve_socp
from hzmp_planners.sets import Polytope
from hzmp_tracking.constants import INTERIOR_MARGIN, LIMIT_TOL
from hzmp_tracking.containment import derivative_maxima
from hzmp_tracking.limits import Limits
from hzmp_tracking.pace import segment_times
from hzmp_tracking.spline import Spline
from hzmp_tracking.stops import Pieces
from hzmp_tracking.vias import shared_plane

_STEP = 0.1  # [s] wanted between knots
_FEWEST, _MOST = 8, 13  # pieces, where cells do not ask for more
_STOP_PIECES = 12  # of a stop in one cell
_TOLERANCE = 1e-6  # of the program: its solution is an interior point
_MARGIN = 0.5 * INTERIOR_MARGIN  # [m] to the facets; less of it may be lost to the solver
_END_MARGIN = 1e-7  # [m] where the start or the goal lies on a facet
_OUTSIDE_COST = 500.0  # [s/m] of leaving the cells: above what any detour was seen to cost
_SLACK = 1e-6  # of a limit, above the tolerance, where time cannot be stretched
_MOVING_SHARE = 0.99  # of the first limits, for what the change of the second control point costs
_SAMPLES = 120  # of a spline, to see where it changes cells
_LEAST = 0.01  # [s] in a cell
_CLOSE = 2e-3  # [s] between knots: jerk is too sensitive to shorter steps


class _Frame(NamedTuple):
    """The spline for a duration of 1, and what is given."""

    d: Floats
    """Steps, shape (m,)."""
    owner: Ints
    """Cell of each piece, shape (m,), ascending; every cell has one."""
    start: Floats
    """Position, velocity and acceleration, (3, n)."""
    goal: Floats | None
    """None: anywhere."""
    resting: bool
    limits: tuple[Floats, Floats, Floats]


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
    bounds = limits.per_axis(start.shape[1])
    resting = not start[1:].any()
    for _ in range(rounds):
        duration = float(times.sum())
        d, owner = _knots(times, start[2], bounds, fewest)
        frame = _Frame(d / duration, owner, start, goal, resting, bounds)
        solved = _solve(frame, cells, duration)
        if solved is None:
            return None
        control, found, outside = solved
        spline = Spline(control, frame.d * found)
        peaks = derivative_maxima(spline.coefficients(), spline.d)
        v, a, j = (float((p / bound).max()) for p, bound in zip(peaks, bounds, strict=True))
        stretch = max(v, float(np.sqrt(a)), float(np.cbrt(j)))
        if resting:
            spline = Spline(control, spline.d * stretch)
        if outside <= _MARGIN and (resting or stretch <= 1.0 + LIMIT_TOL):
            windows = tuple((max(k - 1, 0), min(k + 2, len(cells))) for k in owner.tolist())
            return Pieces(spline.coefficients(), spline.d, windows)
        times = times * (float(spline.d.sum()) / duration)
        if outside > _MARGIN:
            if len(cells) == 1:  # nothing to time again
                return None
            times, fewest = _times(spline, cells, times), 2
    return None


def _knots(
    times: Floats, acceleration: Floats, limits: tuple[Floats, Floats, Floats], fewest: int
) -> tuple[Floats, Ints]:
    """Steps between knots, even in each cell, and the cell of each piece.

    Further knots are where the given accelerations can have ended.
    """
    changes = np.cumsum(times)
    step = min(max(_STEP, changes[-1] / _MOST), changes[-1] / _FEWEST)
    counts = np.maximum(np.ceil(times / step - 0.5), fewest).astype(np.int64)
    ends = np.abs(acceleration) / limits[2]
    steps = np.repeat(times / counts, counts)
    knots = np.unique(np.concatenate([[0.0], np.cumsum(steps), ends[ends < 0.5 * changes[-1]]]))
    knots = knots[np.append(True, np.diff(knots) > _CLOSE)]
    middle = 0.5 * (knots[:-1] + knots[1:])
    return np.diff(knots), np.searchsorted(changes[:-1], middle)


def _times(spline: Spline, cells: Sequence[Polytope], planned: Floats) -> Floats:
    """Time that the spline spends in each cell, changing over where the next one holds it better.

    Between the changes before and after, next to where it was planned; there if there is none.
    """
    duration = float(spline.d.sum())
    times = np.linspace(0.0, duration, _SAMPLES)
    knots = np.concatenate([[0.0], np.cumsum(spline.d)])
    piece = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, spline.m - 1)
    s = (times - knots[piece])[:, None]
    c0, c1, c2, c3 = spline.coefficients()[piece].transpose(1, 0, 2)
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


def _solve(
    frame: _Frame, cells: Sequence[Polytope], duration: float
) -> tuple[Floats, float, float] | None:
    """Control points, least duration [s] and excess over the cells [m]; linearised at `duration`.

    Unknowns: free control points axis by axis, the change of the duration, the excess.
    """
    m, n = frame.d.size, frame.start.shape[1]
    maps = Spline(np.eye(m + 3), frame.d)  # with the identity, values are the matrices of the maps
    free = maps.c[:, 3:m]
    if frame.goal is None:  # the last three are one point: rest
        free = np.concatenate([free, maps.c[:, m:].sum(axis=1, keepdims=True)], axis=1)
    count = free.shape[1]
    fixed, by_duration = _fixed(frame, maps, duration)
    rows: list[Floats] = []
    room: list[Floats] = []
    unknowns = n * count + 2
    jerk = maps.change_3.value / frame.d[:, None]
    for power, (matrix, bound) in enumerate(
        zip((maps.V.value, maps.A.value, jerk), frame.limits, strict=True), start=1
    ):
        scale = duration**power
        moves = matrix @ free
        share = np.full(len(matrix), 1.0 if frame.resting else 1.0 - _SLACK)
        if power > 1 and not frame.resting:
            share[:4] = _MOVING_SHARE  # those that the second control point enters
        used = np.abs(moves).max(axis=1) > 0.0
        at, rate = matrix[used] @ fixed / scale, matrix[used] @ by_duration / scale
        moves, size = moves[used] / scale, share[used]
        for axis in range(n):
            block = np.zeros((2, len(moves), unknowns))
            block[0, :, axis * count : (axis + 1) * count] = moves
            block[0, :, -2] = rate[:, axis]
            block[1] = -block[0]
            block[:, :, -2] -= size * bound[axis] * power / duration
            rows.append(block.reshape(-1, unknowns) / bound[axis])
            limit = size * bound[axis]
            room += [(limit - at[:, axis]) / bound[axis], (limit + at[:, axis]) / bound[axis]]
    for normals, offsets, where in _inside(frame, maps, cells):
        _add(rows, room, normals, offsets, where, fixed, by_duration, free)
    least = np.zeros((1, unknowns))
    least[0, -1] = -1.0
    program = sparse.csc_array(np.concatenate([*rows, least]))
    right = np.concatenate([*room, [0.0]])
    cost = np.zeros(unknowns)
    cost[-2:] = 1.0, _OUTSIDE_COST
    solution = solve_socp(cost, program, right, [("nonnegative", len(right))], tolerance=_TOLERANCE)
    if not solution.solved:
        return None
    found = duration + float(solution.x[-2])
    control, _ = _fixed(frame, maps, found)
    control += free @ solution.x[:-2].reshape(n, count).T
    return control, found, float(solution.x[-1])


def _fixed(frame: _Frame, maps: Spline, T: float) -> tuple[Floats, Floats]:
    """Control points that the ends determine (the others zero) and their derivative by T."""
    x, v, a = frame.start
    control = np.zeros((frame.d.size + 3, x.size))
    rate = np.zeros_like(control)
    one, two = float(maps.steps_1[0]) / 3.0, float(maps.steps_1[1]) / 3.0
    half = float(maps.steps_2[0]) / 2.0
    control[0] = x
    control[1] = x + one * T * v
    control[2] = control[1] + two * T * (v + half * T * a)
    rate[1] = one * v
    rate[2] = rate[1] + two * (v + 2.0 * half * T * a)
    if frame.goal is not None:
        control[-3:] = frame.goal
    return control, rate


def _inside(
    frame: _Frame, maps: Spline, cells: Sequence[Polytope]
) -> list[tuple[Floats, Floats, Floats]]:
    """Half-spaces with the Bezier points that they hold for: normals, offsets, weights."""
    K, m = len(cells), frame.d.size
    planes = [shared_plane(a, b) for a, b in pairwise(cells)]
    groups: list[tuple[Floats, Floats, Floats]] = []
    for k, cell in enumerate(cells):
        margin = np.full(cell.b.size, _MARGIN)
        for end, at in ((frame.start[0], 0), (frame.goal, K - 1)):
            if k == at and end is not None:
                slack = cell.b - cell.A @ end
                margin = np.minimum(margin, 0.5 * np.maximum(slack, _END_MARGIN))
        offsets = cell.b - margin
        i, j = np.searchsorted(frame.owner, [k, k + 1])
        # A knot inside the cell lies between two of these points.
        inner = np.concatenate([maps.left.value[i:j], maps.right.value[i:j]])
        groups.append((cell.A, offsets, inner))
        for knot, side in ((i, k - 1), (j, k)):
            if 0 < knot < m:
                plane, least = planes[side], offsets
                if plane is not None:  # the spline passes through the face itself
                    aligned = np.abs(cell.A @ plane[:-1]) > 1.0 - 1e-9
                    least = np.where(aligned, cell.b, offsets)
                groups.append((cell.A, least, maps.knots.value[[knot - 1]]))
    return groups


def _add(
    rows: list[Floats],
    room: list[Floats],
    normals: Floats,
    offsets: Floats,
    where: Floats,
    fixed: Floats,
    by_duration: Floats,
    free: Floats,
) -> None:
    """Append a.x <= b (or = b) for every point with every normal."""
    moves = where @ free
    used = np.abs(moves).max(axis=1) > 1e-12
    moves, where = moves[used], where[used]
    block = moves[:, None, None, :] * normals[None, :, :, None]
    left = (where @ by_duration) @ normals.T
    size = len(moves) * len(normals)
    rows.append(
        np.concatenate(
            [
                block.reshape(size, normals.shape[1] * moves.shape[1]),
                left.reshape(size, 1),
                np.full((size, 1), -1.0),
            ],
            axis=1,
        )
    )
    room.append((offsets - (where @ fixed) @ normals.T).ravel())
