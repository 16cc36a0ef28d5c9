"""From a polyline in cells to a trajectory that is proved to stay in them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, as_point, as_points
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking.constants import LIMIT_TOL, WAYPOINT_TOL
from hzmp_tracking.corridor_spline import corridor_spline
from hzmp_tracking.cover import cover
from hzmp_tracking.limits import Limits
from hzmp_tracking.stops import Pieces, from_state, polyline, straight
from hzmp_tracking.trajectory import Trajectory
from hzmp_tracking.vias import Vias, place_vias

_DEFAULT_LIMITS = Limits()
_BEND = 1e-3  # [m] a polyline that turns by less within its shorter side runs straight on
_FIRST_STOPS = 4  # vias tried as the first place to rest when the start is moving


def time_parameterize(
    waypoints: ArrayLike,
    cells: Sequence[Polytope],
    limits: Limits = _DEFAULT_LIMITS,
    start_velocity: ArrayLike | None = None,
    start_acceleration: ArrayLike | None = None,
) -> Trajectory:
    """Fast trajectory along a corridor of convex cells, proved inside it at every instant.

    The via points move to the shortest polyline through the overlaps of consecutive cells. Resting
    at its corners is the baseline that always exists (`stops`); a time-optimal cubic spline in the
    corridor (`corridor_spline`) replaces it when it is faster and its proof holds as well.

    Args:
        waypoints: shape (K + 1, n) [m]. The first and the last are kept; waypoint k in between
            lies in cells k - 1 and k and may move inside their intersection.
        cells: K convex polytopes with interiors, consecutive ones overlap or share a face.
            Segment k from waypoint k to waypoint k + 1 lies in cell k.
        limits: bounds on axes and norms, at every instant.
        start_velocity: shape (n,) [m/s]; at rest when None.
        start_acceleration: shape (n,) [m/s^2]; zero when None.

    Returns:
        Trajectory that ends at rest. Its `containment` is the proof.

    Raises:
        ShapeError: shapes that do not fit each other, entries that are not finite.
        QueryError: a waypoint outside its cell, a start state beyond the limits, or one from which
            no stop inside the cells was found.
    """
    points, chain = _checked(waypoints, cells)
    n = points.shape[1]
    velocity, acceleration = start_state(start_velocity, start_acceleration, limits, n)
    vias = place_vias(points, chain)
    candidates = [_splines(vias, chain, limits, velocity, acceleration)]
    if velocity.any() or acceleration.any():
        candidates += _moving(vias, limits, velocity, acceleration, chain)
    else:
        candidates += _resting(points, vias, limits)
    best = _fastest_proved(candidates, chain, vias, limits)
    if not _within(best):
        raise QueryError(
            f"from start_velocity {velocity.tolist()} and start_acceleration "
            f"{acceleration.tolist()} no stop within the limits on norms was found"
        )
    if best.containment > WAYPOINT_TOL:
        raise QueryError(
            f"start_velocity {velocity.tolist()} cannot be kept inside the cells: the best stop "
            f"found leaves them by {best.containment:.3g} m; a slower start would be valid"
        )
    return best


def _splines(
    vias: Vias, cells: Sequence[Polytope], limits: Limits, velocity: Floats, acceleration: Floats
) -> Pieces | None:
    """Splines between the vias that have to be met exactly, at rest there."""
    ends = [0, *np.nonzero(vias.pinched)[0].tolist(), len(cells)]
    parts: list[Pieces] = []
    for i, j in pairwise(ends):
        if i > 0:
            velocity = acceleration = np.zeros(vias.points.shape[1])
        own = vias.part(i, j)
        resting = not (velocity.any() or acceleration.any())
        part = None
        if not (resting and j == i + 1):  # from rest to rest in one cell, straight is best
            part = corridor_spline(own, cells[i:j], limits, velocity, acceleration)
        if part is None and resting:
            part = polyline(own.points, range(j - i + 1), limits)
        if part is None:
            return None
        parts.append(part.moved(i))
    return Pieces.join(parts)


def _resting(points: Floats, vias: Vias, limits: Limits) -> list[Pieces]:
    """Rest at the bends of the shortest polyline; at each of its vias; at each waypoint."""
    every = range(len(points))
    bends = [k for k in every if _bends(vias, k)]
    return [
        polyline(vias.points, bends, limits),
        polyline(vias.points, every, limits),
        polyline(points, every, limits),
    ]


def _bends(vias: Vias, k: int) -> bool:
    """Whether the polyline ends or turns at via k."""
    if k in (0, len(vias.points) - 1) or bool(vias.pinched[k]):
        return True
    before = vias.points[k] - vias.points[k - 1]
    after = vias.points[k + 1] - vias.points[k]
    a, b = float(np.linalg.norm(before)), float(np.linalg.norm(after))
    return min(a, b) == 0.0 or float(np.linalg.norm(after / b - before / a)) * min(a, b) > _BEND


def _moving(
    vias: Vias, limits: Limits, velocity: Floats, acceleration: Floats, cells: tuple[Polytope, ...]
) -> list[Pieces | None]:
    """Come to rest at one of the next vias, or anywhere as fast as possible; then go on from there.

    Going on is resting at each via, and from the first via that can be reached inside the cells, a
    spline.
    """
    points, K = vias.points, len(cells)
    candidates: list[Pieces | None] = []
    rested = np.zeros(points.shape[1])
    reached = False
    for k in range(1, min(K, _FIRST_STOPS) + 1):
        first = from_state(points[0], velocity, acceleration, points[k], limits, (0, k))
        rest = [polyline(points, range(k, K + 1), limits)] if k < K else []
        stopping = Pieces.join([first, *rest])
        candidates.append(stopping)
        if k < K and not reached:
            trial = _proved(stopping, cells, vias, limits)
            reached = trial.containment <= 0.0 and _within(trial)
        else:
            continue
        if reached:
            on = _splines(vias.part(k, K), cells[k:], limits, rested, rested)
            candidates.append(on and Pieces.join([first, on.moved(k)]))
    stop = from_state(points[0], velocity, acceleration, None, limits, (0, K))
    cell = int(np.argmin([float(c.violation(stop.end[None])[0]) for c in cells]))
    on = straight(stop.end, points[cell + 1], limits, (cell, cell + 1))
    rest = [polyline(points, range(cell + 1, K + 1), limits)] if cell + 1 < K else []
    candidates.append(Pieces.join([stop, on, *rest]))
    return candidates


def _fastest_proved(
    candidates: Sequence[Pieces | None],
    cells: tuple[Polytope, ...],
    vias: Vias,
    limits: Limits,
) -> Trajectory:
    """The fastest candidate that is within cells and limits; if none is, the one nearest to it."""
    trials: list[Trajectory] = []
    made = [pieces for pieces in candidates if pieces is not None]
    for pieces in sorted(made, key=lambda pieces: pieces.duration):
        trials.append(_proved(pieces, cells, vias, limits))
        if trials[-1].containment <= 0.0 and _within(trials[-1]):
            return trials[-1]
    return min(trials, key=lambda trial: (not _within(trial), trial.containment))


def _within(trial: Trajectory) -> bool:
    """Whether it keeps the limits on norms; those on the axes hold by construction."""
    return bool(trial.limit_usage[:, -1].max() <= 1.0 + LIMIT_TOL)


def _proved(pieces: Pieces, cells: tuple[Polytope, ...], vias: Vias, limits: Limits) -> Trajectory:
    """The pieces, split where they change cells, as a trajectory that can tell its containment."""
    coefficients, durations, owners = cover(
        pieces.coefficients, pieces.durations, pieces.windows, cells
    )
    times = np.concatenate([[0.0], np.cumsum(durations)])
    return Trajectory(times, coefficients, owners, cells, vias.points, limits)


def _checked(
    waypoints: ArrayLike, cells: Sequence[Polytope]
) -> tuple[Floats, tuple[Polytope, ...]]:
    chain = tuple(cells)
    if not chain:
        raise ShapeError("cells must hold at least one Polytope, got none")
    n = chain[0].n
    for k, cell in enumerate(chain):
        if cell.n != n:
            raise ShapeError(f"cell {k} has {cell.n} dimensions but cell 0 has {n}")
    points = as_points(waypoints, "waypoints", n)
    if len(points) != len(chain) + 1:
        raise ShapeError(f"{len(chain)} cells need {len(chain) + 1} waypoints, got {len(points)}")
    for k, cell in enumerate(chain):
        excess = cell.violation(points[k : k + 2])
        worst = int(np.argmax(excess))
        if excess[worst] > WAYPOINT_TOL:
            raise QueryError(
                f"waypoint {k + worst} {points[k + worst].tolist()} lies {excess[worst]:.3g} m "
                f"outside cell {k}; at most {WAYPOINT_TOL:g} m is accepted"
            )
    return points, chain


def start_state(
    velocity: ArrayLike | None, acceleration: ArrayLike | None, limits: Limits, n: int
) -> tuple[Floats, Floats]:
    """Velocity and acceleration at the start, checked against the limits."""
    v = as_point(np.zeros(n) if velocity is None else velocity, "start_velocity", n)
    a = as_point(np.zeros(n) if acceleration is None else acceleration, "start_acceleration", n)
    for name, state, norm in zip(("velocity", "acceleration"), (v, a), limits.norms, strict=False):
        size = float(np.linalg.norm(state))
        if size > norm * (1.0 + LIMIT_TOL):
            raise QueryError(f"start_{name} is {size:.6g} in all; the limit is {norm:g}")
    v_max, a_max, j_max = limits.per_axis(n)
    # Jerk needs |a| / j to end the acceleration, which adds a|a| / 2j to the velocity.
    peak = np.maximum(np.abs(v), np.abs(v + a * np.abs(a) / (2.0 * j_max)))
    for name, value, bound in (
        ("acceleration", np.abs(a), a_max),
        ("velocity, or the velocity that start_acceleration leads to,", peak, v_max),
    ):
        axis = int(np.argmax(value / bound))
        if value[axis] > bound[axis] * (1.0 + LIMIT_TOL):
            raise QueryError(
                f"start_{name} is {value[axis]:.6g} on axis {axis}; the limit is {bound[axis]:g}"
            )
    return v, a
