"""A good cubic spline in a corridor from a single linear program.

Where `corridor_spline` moves the steps of the spline in many programs, here the steps and the
times at which it changes cells are fractions of the duration T that a fast estimate gives
(`pace`). Knots are for the derivatives alone: a piece that changes cells is subdivided there, and
the Bezier points of each part lie in its cell. With c the control points,

    |V(c)| <= v T,    |A(c)| <= a T^2,    |J(c)| <= j T^3,    V, A, J for T = 1,

and the tangents of T^2 and T^3, which lie below them, leave a linear program in c and T whose
every solution keeps the limits. A start in motion fixes two control points, of which the second
is quadratic in T; only this is made up for afterwards.
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
_FEWEST, _MOST = 8, 13  # pieces
_TOLERANCE = 1e-6  # of the program: its solution is an interior point, and judged exactly
_MARGIN = 0.5 * INTERIOR_MARGIN
_END_MARGIN = 1e-7  # [m] where the start or the goal lies on a facet
_SLACK = 1e-6  # of a limit, above the tolerance
_SAMPLES = 120
_LEAST = 1e-3
_OUTSIDE_COST = 20.0
_ROUNDS = 4  # programs at most, where a start in motion needs another duration than estimated
_MOVING_SHARE = 0.99  # of the limits, for what the change of the second control point costs


class _Frame(NamedTuple):
    """Everything that stays from one program to the next."""

    d: Floats
    start: Floats
    """Position, velocity and acceleration, (3, n)."""
    goal: Floats
    resting: bool
    limits: tuple[Floats, Floats, Floats]


def quick_spline(
    points: Floats,
    cells: Sequence[Polytope],
    limits: Limits,
    velocity: Floats,
    acceleration: Floats,
) -> Pieces | None:
    """A spline from the first to the last point, to rest; None when the program has no solution.

    Args:
        points: polyline whose segment k lies in cell k, shape (K + 1, n) [m].
        cells: K polytopes.
        limits: bounds on each axis.
        velocity: at the start, shape (n,) [m/s].
        acceleration: at the start, shape (n,) [m/s^2].
    """
    bounds = limits.per_axis(points.shape[1])
    times = segment_times(points, velocity, bounds)
    duration = float(times.sum())
    changes = np.cumsum(times)[:-1] / duration
    steps = _steps(duration, acceleration, bounds)
    resting = not (velocity.any() or acceleration.any())
    frame = _Frame(
        steps / duration, np.array([points[0], velocity, acceleration]), points[-1], resting, bounds
    )
    for _ in range(_ROUNDS):
        solved = _solve(frame, points, cells, changes, duration)
        if solved is None:
            return None
        control, duration, outside = solved
        spline = Spline(control, frame.d * duration)
        peaks = derivative_maxima(spline.coefficients(), spline.d)
        v, a, j = (float((p / bound).max()) for p, bound in zip(peaks, bounds, strict=True))
        stretch = max(v, float(np.sqrt(a)), float(np.cbrt(j)))
        if resting:
            spline = Spline(control, spline.d * stretch)
        if outside <= _MARGIN and (resting or stretch <= 1.0 + LIMIT_TOL):
            return _pieces(spline, changes)
        if outside > _MARGIN:
            changes = _changes(spline, cells)
    return None


def _changes(spline: Spline, cells: Sequence[Polytope]) -> Floats:
    """Times at which the spline changes over to the next cell, as fractions of its duration."""
    times = np.linspace(0.0, float(spline.d.sum()), _SAMPLES)
    knots = np.concatenate([[0.0], np.cumsum(spline.d)])
    piece = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, spline.m - 1)
    s = (times - knots[piece])[:, None]
    c0, c1, c2, c3 = spline.coefficients()[piece].transpose(1, 0, 2)
    at = c0 + s * (c1 + s * (c2 + s * c3))
    depth = [(at @ cell.A.T - cell.b).max(axis=1) for cell in cells]
    changes = np.empty(len(cells) - 1)
    first = 0
    for k, (here, there) in enumerate(pairwise(depth)):
        ahead = here - there  # the next cell holds better where this is positive
        later = np.flatnonzero(ahead[first + 1 :] > 0.0)
        i = first + 1 + int(later[0]) if later.size else _SAMPLES - 1
        before, after = float(ahead[i - 1]), float(ahead[i])
        share = before / (before - after) if before < 0.0 < after else 0.0
        changes[k] = (i - 1 + share) / (_SAMPLES - 1)
        first = i - 1
    least = _LEAST * np.arange(1, len(cells))  # parts of no length have no cell
    changes = np.maximum.accumulate(np.clip(changes, least, 1.0 - least[::-1]) - least) + least
    return np.minimum(changes, 1.0 - least[::-1])


def _steps(duration: float, acceleration: Floats, limits: tuple[Floats, Floats, Floats]) -> Floats:
    """Steps between knots, as even as possible; the first ones end the given accelerations."""
    ends = np.unique((np.abs(acceleration) / limits[2]).round(6))
    ends = ends[(ends > 1e-3) & (ends < 0.25 * duration)]
    first = np.diff(np.concatenate([[0.0], ends]))
    left = duration - float(first.sum())
    count = min(max(round(left / _STEP), _FEWEST), _MOST)
    return np.concatenate([first, np.full(count, left / count)])


def _pieces(spline: Spline, changes: Floats) -> Pieces:
    """The pieces of the spline; each may lie in the cells that it was subdivided for."""
    knots = np.concatenate([[0.0], np.cumsum(spline.d)]) / float(spline.d.sum())
    first = np.searchsorted(changes, knots[:-1], side="left")
    last = np.searchsorted(changes, knots[1:], side="right")
    windows = tuple(zip(first.tolist(), (last + 1).tolist(), strict=True))
    return Pieces(spline.coefficients(), spline.d, windows)


def _solve(
    frame: _Frame, points: Floats, cells: Sequence[Polytope], changes: Floats, duration: float
) -> tuple[Floats, float, float] | None:
    """Control points and the least duration within the limits, linearised at `duration`."""
    m, n = frame.d.size, points.shape[1]
    maps = Spline(np.eye(m + 3), frame.d)  # with the identity, values are the matrices of the maps
    first = 3
    count = m - first
    fixed, by_duration = _fixed(frame, maps, duration)
    rows: list[Floats] = []
    room: list[Floats] = []
    unknowns = n * count + 2
    jerk = maps.change_3.value / frame.d[:, None]
    for power, (matrix, bound) in enumerate(
        zip((maps.V.value, maps.A.value, jerk), frame.limits, strict=True), start=1
    ):
        scale = duration**power
        moves = matrix[:, first:m]
        share = np.full(len(matrix), 1.0 if frame.resting else 1.0 - _SLACK)
        if power > 1 and not frame.resting:
            share[:4] = _MOVING_SHARE
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
    for normals, offsets, where in _inside(frame, maps, points, cells, changes):
        _add(rows, room, normals, offsets, where, fixed, by_duration, first)
    least = np.zeros((1, unknowns))
    least[0, -1] = -1.0
    matrix = sparse.csc_array(np.concatenate([*rows, least]))
    right = np.concatenate([*room, [0.0]])
    cost = np.zeros(unknowns)
    cost[-2:] = 1.0, _OUTSIDE_COST
    solution = solve_socp(cost, matrix, right, [("nonnegative", len(right))], tolerance=_TOLERANCE)
    if not solution.solved:
        return None
    found = duration + float(solution.x[-2])
    control, _ = _fixed(frame, maps, found)
    control[first:m] = solution.x[:-2].reshape(n, count).T
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
    control[-3:] = frame.goal
    return control, rate


_Group = tuple[Floats, Floats, Floats]


def _inside(
    frame: _Frame, maps: Spline, points: Floats, cells: Sequence[Polytope], changes: Floats
) -> list[_Group]:
    """Half-spaces and planes with the Bezier points they hold for: normals, offsets, weights."""
    where, owner = _subdivided(frame.d, maps, changes)
    K, n = len(cells), points.shape[1]
    planes = [shared_plane(a, b) for a, b in pairwise(cells)]
    groups: list[_Group] = []
    for k, cell in enumerate(cells):
        slack = cell.b - points[[0, -1]] @ cell.A.T
        margin = np.full(cell.b.size, _MARGIN)
        for end, at in ((0, 0), (1, K - 1)):
            if k == at:
                margin = np.minimum(margin, 0.5 * np.maximum(slack[end], _END_MARGIN))
        offsets = cell.b - margin
        own = where[owner == k].reshape(-1, where.shape[2])
        inner = own[np.arange(len(own)) % 4 > 0][:-1]
        groups.append((cell.A, offsets, inner))
        for side, at in ((k - 1, 0), (k, -1)):
            if not 0 <= side < K - 1:
                continue
            plane, least = planes[side], offsets
            if plane is not None:  # the spline passes through the face itself
                least = np.where(np.abs(cell.A @ plane[:n]) > 1.0 - 1e-9, cell.b, offsets)
            groups.append((cell.A, least, own[[at]]))
    return groups


def _subdivided(d: Floats, maps: Spline, changes: Floats) -> tuple[Floats, Ints]:
    """Bezier points between all knots and changes of cells as weights of control points.

    Returns:
        Shape (parts, 4, m + 3), and the cell of each part.
    """
    identity = maps.c
    knots = np.concatenate([[0.0], np.cumsum(d)])
    knots[-1] = 1.0
    inner = maps.knots.value
    bezier = np.stack(
        [
            np.concatenate([identity[:1], inner]),
            maps.left.value,
            maps.right.value,
            np.concatenate([inner, identity[-1:]]),
        ],
        axis=1,
    )
    times = np.unique(np.concatenate([knots, changes]))
    middle = 0.5 * (times[:-1] + times[1:])
    piece = np.searchsorted(knots, middle) - 1
    s = (times[:-1] - knots[piece]) / d[piece]
    t = (times[1:] - knots[piece]) / d[piece]
    corners = (s, s, s), (s, s, t), (s, t, t), (t, t, t)
    weights = np.stack([_blossom(*corner) for corner in corners], axis=1)
    return weights @ bezier[piece], np.searchsorted(changes, middle)


def _blossom(r: Floats, s: Floats, t: Floats) -> Floats:
    """Weights of the four Bezier points in the polar form of a cubic, shape (k, 4)."""
    p, q, u = 1.0 - r, 1.0 - s, 1.0 - t
    return np.stack(
        [
            p * q * u,
            r * q * u + p * s * u + p * q * t,
            r * s * u + r * q * t + p * s * t,
            r * s * t,
        ],
        axis=1,
    )


def _add(
    rows: list[Floats],
    room: list[Floats],
    normals: Floats,
    offsets: Floats,
    where: Floats,
    fixed: Floats,
    by_duration: Floats,
    first: int,
) -> None:
    """Append a.x <= b (or = b) for every point with every normal."""
    moves = where[:, first:-3]
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
