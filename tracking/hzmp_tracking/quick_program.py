"""The linear program for a cubic spline in a corridor whose steps are fixed shares of its duration.

With c the control points and T the duration,

    |V(c)| <= v T,    |A(c)| <= a T^2,    |J(c)| <= j T^3,    V, A, J for T = 1,

and the tangents of T^2 and T^3 lie below them: the linear program in c and T that they leave keeps
the limits wherever it is solved. A start in motion fixes two more control points, the second of
which is quadratic in T; only this is made up for afterwards. Bezier points lie in the cells, up to
an excess that has a price, so that there is always a solution.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import sparse

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._clarabel import solve_socp
from hzmp_planners._ragged import spans, starts_of
from hzmp_planners.sets import Polytope
from hzmp_tracking.constants import INTERIOR_MARGIN
from hzmp_tracking.facets import Facets
from hzmp_tracking.spline import C_WINDOW, Spline

MARGIN = 0.5 * INTERIOR_MARGIN
"""[m] to the facets; less of it may be lost to the solver."""

_TOLERANCE = 1e-6  # of the program: its solution is an interior point
_END_MARGIN = 1e-7  # [m] where the start or the goal lies on a facet
_OUTSIDE_COST = 500.0  # [s/m] of leaving the cells: above what any detour was seen to cost
_SLACK = 1e-5  # of a limit, above the tolerance, where time cannot be stretched
_MOVING_SHARE = 0.99  # of the first limits, for what the change of the second control point costs
_LATE = 1.5  # times the expected duration: what is out of reach by then is left out


class Frame(NamedTuple):
    """The spline for a duration of 1, and what is given."""

    d: Floats
    """Steps, shape (m,)."""
    owner: Ints
    """Cell of each piece, shape (m,), ascending."""
    start: Floats
    """Position, velocity and acceleration, (3, n)."""
    goal: Floats | None
    """None: anywhere."""
    limits: Floats
    """Of velocity, acceleration and jerk on each axis, (3, n)."""

    @property
    def resting(self) -> bool:
        """Whether the start is at rest: then time can be stretched afterwards."""
        return not self.start[1:].any()


class Solution(NamedTuple):
    """What the program found."""

    coefficients: Floats
    """Ascending powers of local time of each piece, shape (m, 4, n)."""
    durations: Floats
    """Of the pieces, shape (m,) [s]."""
    outside: float
    """Excess over the cells with their margins [m]."""


class _Maps(NamedTuple):
    """Matrices from the control points to what is bounded."""

    derivatives: Floats
    """To V, A and J, shape (3 m + 3, m + 3)."""
    points: Floats
    """To the Bezier points B1, B2 and the inner knots, shape (3 m - 1, m + 3)."""


class _Unknowns(NamedTuple):
    """Control points as a function of the free ones, of which there are `count`, and T."""

    fixed: Floats
    """At the expected T, where the free ones are zero, (m + 3, n)."""
    rate: Floats
    """Derivative by T, (m + 3, n)."""
    free: Floats
    """Of each axis by its free ones, (m + 3, count)."""


def solve(frame: Frame, cells: Sequence[Polytope], expected: float) -> Solution | None:
    """The fastest spline, linearised at the expected duration [s]; None when the solver fails.

    Unknowns: free control points axis by axis, the change of the duration, the excess.
    """
    m, n = frame.d.size, frame.start.shape[1]
    spline = Spline(np.zeros((m + 3, 1)), frame.d)
    free = np.eye(m + 3)[:, 3:m]
    if frame.goal is None:  # the last three are one point: rest
        free = np.column_stack([free, np.eye(m + 3)[:, m:].sum(axis=1)])
    unknowns = _Unknowns(*_ends(frame, spline, expected), free)
    maps = _maps(spline)
    limit_rows, limit_room = _limit_rows(frame, maps.derivatives, unknowns, expected)
    cell_rows, cell_room = _cell_rows(frame, maps.points, unknowns, cells, expected)
    least = np.zeros((1, limit_rows.shape[1]))  # the excess is not negative
    least[0, -1] = -1.0
    program = _sparse(np.concatenate([limit_rows, cell_rows, least]))
    right = np.concatenate([limit_room, cell_room, [0.0]])
    cost = np.zeros(program.shape[1])
    cost[-2:] = 1.0, _OUTSIDE_COST
    solution = solve_socp(
        cost, program, right, [("nonnegative", right.size)], tolerance=_TOLERANCE, refine=False
    )
    if not solution.solved:
        return None
    duration = expected + float(solution.x[-2])
    control, _ = _ends(frame, spline, duration)
    control += free @ solution.x[:-2].reshape(n, -1).T
    coefficients = _pieces(maps, control, frame.d) / duration ** np.arange(4.0)[:, None]
    return Solution(coefficients, frame.d * duration, float(solution.x[-1]))


def _ends(frame: Frame, spline: Spline, T: float) -> tuple[Floats, Floats]:
    """Control points that the ends determine (the others zero) and their derivative by T."""
    x, v, a = frame.start
    control = np.zeros((frame.d.size + 3, x.size))
    rate = np.zeros_like(control)
    one, two = float(spline.steps_1[0]) / 3.0, float(spline.steps_1[1]) / 3.0
    half = float(spline.steps_2[0]) / 2.0
    control[0] = x
    control[1] = x + one * T * v
    control[2] = control[1] + two * T * (v + half * T * a)
    rate[1] = one * v
    rate[2] = rate[1] + two * (v + 2.0 * half * T * a)
    if frame.goal is not None:
        control[-3:] = frame.goal
    return control, rate


def _maps(spline: Spline) -> _Maps:
    """Of a spline with these steps."""
    jerk = spline.change_3.by_c / spline.d[:, None]
    derivatives = (spline.V.by_c, spline.A.by_c, jerk)
    points = (spline.left.by_c, spline.right.by_c, spline.knots.by_c)
    first = [np.arange(len(part)) for part in (*derivatives, *points)]
    windows = np.concatenate(first)[:, None] + np.arange(C_WINDOW)
    # The last windows reach beyond the control points, with zeros there.
    matrix = np.zeros((len(windows), spline.m + 2 + C_WINDOW))
    np.put_along_axis(matrix, windows, np.concatenate([*derivatives, *points]), axis=1)
    split = 3 * spline.m + 3
    return _Maps(matrix[:split, : spline.m + 3], matrix[split:, : spline.m + 3])


def _pieces(maps: _Maps, control: Floats, d: Floats) -> Floats:
    """Cubics in powers of local time for a duration of 1, shape (m, 4, n)."""
    m = d.size
    points, derivatives = maps.points @ control, maps.derivatives @ control
    starts = np.concatenate([control[:1], points[2 * m :]])
    velocity = 3.0 * (points[:m] - starts) / d[:, None]
    acceleration, jerk = derivatives[m + 2 : 2 * m + 2], derivatives[2 * m + 3 :]
    return np.stack([starts, velocity, acceleration / 2.0, jerk / 6.0], axis=1)


def _limit_rows(
    frame: Frame, derivatives: Floats, unknowns: _Unknowns, T: float
) -> tuple[Floats, Floats]:
    """Rows and right-hand sides of both signs of the limits, as shares of them."""
    m, n = frame.d.size, frame.start.shape[1]
    counts = (m + 2, m + 1, m)
    share = np.full(3 * m + 3, 1.0 if frame.resting else 1.0 - _SLACK)
    if not frame.resting:  # those that the second control point enters
        share[m + 2 : m + 6] = share[2 * m + 3 : 2 * m + 7] = _MOVING_SHARE
    moves = derivatives @ unknowns.free
    used = np.abs(moves).max(axis=1) > 0.0
    power = np.repeat((1.0, 2.0, 3.0), counts)[used]
    unit = (np.repeat(frame.limits, counts, axis=0)[used] * T ** power[:, None]).T  # (n, rows)
    matrix, share = derivatives[used], share[used]
    at, rate = (matrix @ unknowns.fixed).T / unit, (matrix @ unknowns.rate).T / unit
    count = moves.shape[1]
    rows = np.zeros((2, n, power.size, n * count + 2))
    for axis in range(n):
        rows[0, axis, :, axis * count : (axis + 1) * count] = moves[used] / unit[axis, :, None]
    rows[0, :, :, -2] = rate
    rows[1] = -rows[0]
    rows[..., -2] -= share * power / T
    return rows.reshape(-1, rows.shape[-1]), np.concatenate([share - at, share + at]).ravel()


def _cell_rows(
    frame: Frame, points: Floats, unknowns: _Unknowns, cells: Sequence[Polytope], T: float
) -> tuple[Floats, Floats]:
    """Rows and right-hand sides of a.x <= b for every Bezier point and facet of its cells."""
    facets = Facets.of(cells)
    A, b, starts = facets
    offsets = b - MARGIN
    for end, k in ((frame.start[0], 0), (frame.goal, len(cells) - 1)):
        if end is not None:
            own = slice(starts[k], starts[k + 1])
            room = 0.5 * np.maximum(b[own] - A[own] @ end, _END_MARGIN)
            offsets[own] = np.maximum(offsets[own], b[own] - room)
    moves = points @ unknowns.free
    point, cell = _pairs(frame.owner)
    used = np.abs(moves[point]).max(axis=1) > 1e-12
    point, cell = point[used], cell[used]
    facet, counts = facets.facing(cell)
    point = point.repeat(counts)
    knots = point >= 2 * frame.d.size
    # The spline passes through a face that two cells share itself.
    bound = np.where(knots & facets.shared()[facet], b[facet], offsets[facet])
    near = _reachable(frame, point, A[facet], bound, T)
    point, normals, bound = point[near], A[facet[near]], bound[near]
    by_axis = normals[:, :, None] * moves[point][:, None, :]
    rate = ((points @ unknowns.rate)[point] * normals).sum(axis=1)
    at = ((points @ unknowns.fixed)[point] * normals).sum(axis=1)
    rows = np.column_stack(
        [
            by_axis.reshape(len(point), normals.shape[1] * moves.shape[1]),
            rate,
            np.full(len(point), -1.0),
        ]
    )
    return rows, bound - at


def _pairs(owner: Ints) -> tuple[Ints, Ints]:
    """Bezier points and the cells that they have to lie in.

    A knot inside of a cell lies between two points that do; others lie in both cells.
    """
    m = owner.size
    changes = np.flatnonzero(np.diff(owner))
    counts = owner[changes + 1] - owner[changes] + 1
    point = np.concatenate([np.arange(2 * m), 2 * m + changes.repeat(counts)])
    return point, np.concatenate([owner, owner, spans(owner[changes], counts)])


def _reachable(frame: Frame, point: Ints, normals: Floats, bound: Floats, T: float) -> Bools:
    """Whether points could be beyond half-spaces, from the start and to the goal in their time."""
    v, a, _ = frame.limits
    ends = np.cumsum(frame.d)
    begins = ends - frame.d
    until = np.concatenate([ends, ends, ends[:-1]]) * T * _LATE
    after = (1.0 - np.concatenate([begins, begins, ends[:-1]])) * T * _LATE
    sides = [(frame.start[0], np.abs(frame.start[1]), until)]
    sides += [] if frame.goal is None else [(frame.goal, 0.0 * v, after)]
    near = np.ones(point.size, dtype=np.bool_)
    for x, speed, time in sides:
        t = time[:, None]
        reach = np.minimum(v * t, speed * t + 0.5 * a * t**2)
        near &= normals @ x + (np.abs(normals) * reach[point]).sum(axis=1) > bound
    return near


def _sparse(matrix: Floats) -> sparse.csc_matrix:
    """The same matrix by columns; scipy's own conversion takes several times as long."""
    filled = np.flatnonzero(np.ascontiguousarray((matrix != 0.0).T))
    columns, rows = np.divmod(filled, len(matrix))
    starts = starts_of(np.bincount(columns, minlength=matrix.shape[1]))
    return sparse.csc_matrix((matrix[rows, columns], rows, starts), shape=matrix.shape)
