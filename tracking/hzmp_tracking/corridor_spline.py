"""Time-optimal cubic spline in a corridor, by sequential linear programming.

A `Spline` with a fixed number of pieces in each cell: its Bezier points lie in the cells (the curve
lies in their hull), its velocity control points, accelerations and jerks within the limits. All of
this is linear in the control points for given steps; in the steps it is linearised within a trust
region, and the sum of the steps is minimised again and again. Measured on the reference corridors
(nine cells in 3-D), this ends within 0.5 % of the best known durations. Many splines are as fast
(what one axis does is free while another one needs the time): the last program picks the shortest.

Whether the result keeps cells and limits is judged afterwards, exactly: no solver tolerance enters
the proof.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._clarabel import Cone, second_order_cones, solve_socp
from hzmp_planners.sets import Polytope
from hzmp_tracking.constants import LIMIT_TOL
from hzmp_tracking.corridor_program import Corridor, Program
from hzmp_tracking.limits import Limits
from hzmp_tracking.spline import Spline
from hzmp_tracking.stops import Pieces
from hzmp_tracking.vias import Vias

_PIECES = 40  # cubic pieces in all, shared evenly by the cells, 2 to 8 in each
_ROUNDS = (6, 16)  # linear programs at most: fewer for long corridors
_WORK = 1600  # pieces times rounds that fit into about a second
_TRUST = 0.4  # relative change of a step in one round
_SHARES = (1.0, 0.8, 0.6, 0.4, 0.25, 0.12, 0.05)  # of a round's change that are tried
_FULL = 0.8  # a share from which on the linearisation is good for more
_SHORTEST = 0.1  # of the mean step: jerk is too sensitive to shorter ones
_GROW, _BEYOND, _SHRINK = 2.0, 1.2, 0.1  # the trust region next: after a full share; beyond the
# change that was taken; after a round without gain
_GAIN = 1e-3  # relative, of a round worth its time
_CLEAN = 1e-7  # [m] of constraint violation that is left to the margins
_TRIES = 4  # stretches of a spline that starts in motion
_REACH = 2  # cells before and after its own that a piece may be proved in


def corridor_spline(
    vias: Vias,
    cells: Sequence[Polytope],
    limits: Limits,
    velocity: Floats,
    acceleration: Floats,
) -> Pieces | None:
    """The fastest spline found; None when the corridor has no room for one.

    Args:
        vias: via points of the corridor.
        cells: K polytopes.
        limits: bounds on axes and norms.
        velocity: at the start, shape (n,) [m/s].
        acceleration: at the start, shape (n,) [m/s^2].
    """
    K = len(cells)
    owner = np.repeat(np.arange(K), max(2, min(8, _PIECES // K)))
    corridor = Corridor.build(vias, cells, owner, limits, velocity, acceleration)
    control = np.repeat(vias.points[:1], owner.size + 3, axis=0)
    control[-3:] = vias.points[-1]
    spline = _fit(corridor, Spline(control, _first_steps(vias.points, owner, limits)))
    if spline is None:
        return None
    spline = _descend(corridor, Spline(spline.c, spline.d * corridor.stretch(spline)))
    spline = _finished(corridor, spline)
    if spline is None:
        return None
    spline = _straightened(corridor, spline)
    windows = tuple((max(k - _REACH, 0), min(k + _REACH + 1, K)) for k in owner.tolist())
    return Pieces(spline.coefficients(), spline.d, windows)


def _first_steps(points: Floats, owner: Ints, limits: Limits) -> Floats:
    """Steps for a run along the polyline: at full speed, with time to turn in each cell."""
    speed, acceleration = (float(box.min()) for box in limits.boxes(points.shape[1])[:2])
    turn = speed / acceleration
    times = np.linalg.norm(np.diff(points, axis=0), axis=1) / speed + 0.3 * turn
    times[[0, -1]] += 0.5 * turn
    return np.asarray((times / np.bincount(owner))[owner])


def _descend(corridor: Corridor, spline: Spline) -> Spline:
    """Linear programs within a trust region, until two in a row gain less than `_GAIN` each.

    A program costs as much as dozens of merits: the best of several shares of its change is taken,
    and tells how far the linearisation can be trusted.
    """
    best, trust, idle = corridor.merit(spline), _TRUST, 0
    fewest, most = _ROUNDS
    for _ in range(max(fewest, min(most, _WORK // spline.m))):
        trial = _advance(corridor, spline, trust)
        before, share = best, 0.0
        if trial is not None:
            best, share, spline = _best_share(corridor, spline, trial, best)
        if best < before:
            trust = min(_GROW * trust, _TRUST) if share >= _FULL else _BEYOND * share * trust
        else:
            trust *= _SHRINK
        idle = idle + 1 if before - best < _GAIN * before else 0
        if idle == 2:
            break
    return spline


def _best_share(
    corridor: Corridor, spline: Spline, trial: Spline, least: float
) -> tuple[float, float, Spline]:
    """Merit, share and spline of the best point on the way to a trial; as it is when none gains."""
    best, c, d = (least, 0.0, spline), trial.c - spline.c, trial.d - spline.d
    for share in _SHARES:
        moved = Spline(spline.c + share * c, spline.d + share * d)
        merit = corridor.merit(moved)
        if merit < best[0]:
            best = merit, share, moved
    merit, share, moved = best
    if corridor.resting and share:
        # Back within the limits by time alone, so that the next program starts feasible.
        moved = Spline(moved.c, moved.d * corridor.stretch(moved))
    return merit, share, moved


def _finished(corridor: Corridor, spline: Spline) -> Spline | None:
    """Within the limits by stretching time; cleaned of constraint violations where it has any.

    A start in motion fixes the velocity, so that stretched steps need new control points.
    """
    if corridor.resting:
        cleaned = _fit(corridor, spline) if corridor.violation(spline) > _CLEAN else spline
        return cleaned and Spline(cleaned.c, cleaned.d * corridor.stretch(cleaned))
    for _ in range(_TRIES):
        stretch = max(corridor.stretch(spline), 1.0)
        fitted = _fit(corridor, Spline(spline.c, spline.d * stretch))
        if fitted is None:
            return None
        spline = fitted
        if corridor.stretch(spline) <= 1.0 + LIMIT_TOL:
            return spline
    return None


def _fit(corridor: Corridor, spline: Spline) -> Spline | None:
    """Control points in the corridor that need least beyond the limits, for the steps as they are.

    Exact: for given steps every constraint is linear.
    """
    program = Program.build(corridor, spline)
    count = int(program.free[: spline.c.size].sum())
    others = program.values.size - program.steps.size
    multiple = sparse.csc_array(np.append(np.zeros(others), -program.steps)[:, None])
    rows = sparse.hstack([program.rows[:, :count], multiple], format="csc")
    # Limits that are exceeded now may stay so by as much: only the rest has to share the load.
    room = np.concatenate([-program.values[:others], -program.eased()[others:]])
    solution = solve_socp(np.append(np.zeros(count), 1.0), rows, room, program.cones(0))
    if not solution.solved:
        return None
    return program.moved(spline, np.append(solution.x[:-1], np.zeros(spline.m)))


def _straightened(corridor: Corridor, spline: Spline) -> Spline:
    """The spline with the shortest control polygon among those with the same steps.

    A second-order cone program: for given steps every constraint is linear. The spline stays as it
    is when the solver finds none that is shorter and as fast.
    """
    program = Program.build(corridor, spline)
    m, n, points = spline.m, spline.n, spline.c.shape[0]
    count = int(program.free[: spline.c.size].sum())
    free = np.flatnonzero(program.free[: spline.c.size])
    # Unknowns: changes of control points, then the lengths of the polygon's sides.
    sides = points - 1
    entries = np.arange(spline.c.size).reshape(n, points)
    side, axis = np.meshgrid(np.arange(sides), np.arange(n), indexing="ij")
    cone_rows = (side * (n + 1) + 1 + axis).ravel()
    shape = (sides * (n + 1), spline.c.size)
    ahead = sparse.csc_array(
        (-np.ones(cone_rows.size), (cone_rows, entries[axis, side + 1].ravel())), shape=shape
    )
    behind = sparse.csc_array(
        (np.ones(cone_rows.size), (cone_rows, entries[axis, side].ravel())), shape=shape
    )
    tops = np.arange(sides) * (n + 1)
    lengths = sparse.csc_array((-np.ones(sides), (tops, np.arange(sides))), shape=(shape[0], sides))
    polygon = np.zeros(shape[0])
    polygon[cone_rows] = np.diff(spline.c, axis=0)[side, axis].ravel()
    linear = program.rows[:, :count]
    rows = sparse.vstack(
        [
            sparse.hstack([linear, sparse.csc_array((linear.shape[0], sides))]),
            sparse.hstack([(ahead + behind)[:, free], lengths]),
        ],
        format="csc",
    )
    room = np.concatenate([-program.eased(), polygon])
    cones: list[Cone] = [*program.cones(0), *second_order_cones(n + 1, sides)]
    solution = solve_socp(np.append(np.zeros(count), np.ones(sides)), rows, room, cones)
    if not solution.solved:
        return spline
    trial = program.moved(spline, np.append(solution.x[:count], np.zeros(m)))
    if not corridor.resting:
        return trial if corridor.stretch(trial) <= 1.0 + LIMIT_TOL else spline
    trial = Spline(trial.c, trial.d * max(1.0, corridor.stretch(trial)))
    return trial if trial.d.sum() <= (1.0 + 1e-4) * spline.d.sum() else spline


def _advance(corridor: Corridor, spline: Spline, trust: float) -> Spline | None:
    """Control points and steps that minimise the total time, each step within +-trust of now."""
    program = Program.build(corridor, spline)
    m, count = spline.m, program.rows.shape[1] - spline.m
    box = sparse.hstack([sparse.csc_array((m, count)), sparse.eye_array(m)])
    rows = sparse.vstack([program.rows, box, -box], format="csc")
    least = _SHORTEST * float(spline.d.mean())
    shrink = np.clip(spline.d - least, 0.0, trust * spline.d)
    cost = np.concatenate([np.zeros(count), np.ones(m)])
    # The program bounds control points, the merit exact maxima: a good spline may violate the
    # program, by more than a small change can mend. Then at least it must not get worse.
    for values in (program.values, program.eased()):
        room = np.concatenate([-values, trust * spline.d, shrink])
        solution = solve_socp(cost, rows, room, program.cones(2 * m))
        if solution.solved:
            return program.moved(spline, solution.x)
    return None
