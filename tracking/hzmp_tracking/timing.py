"""From a polyline in cells to a trajectory that is proved to stay in them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import QueryError
from hzmp_planners.sets import Polytope
from hzmp_tracking.arguments import checked_corridor, known_pieces, start_state
from hzmp_tracking.constants import WAYPOINT_TOL
from hzmp_tracking.corridor_spline import corridor_spline
from hzmp_tracking.cover import outside
from hzmp_tracking.limits import Limits
from hzmp_tracking.proved import fastest_proved, holds, proved, within
from hzmp_tracking.quick_spline import quick_spline
from hzmp_tracking.stops import Pieces, box_for, from_state, polyline, straight
from hzmp_tracking.trajectory import Trajectory
from hzmp_tracking.vias import Vias, place_vias

_DEFAULT_LIMITS = Limits()
_BEND = 1e-3  # [m] a polyline that turns by less within its shorter side runs straight on
_FIRST_STOPS = 4  # vias tried as the first place to rest when the start is moving


class _Query(NamedTuple):
    """What a trajectory is asked for, checked."""

    points: Floats
    """Waypoints, shape (K + 1, n) [m]."""
    chain: tuple[Polytope, ...]
    """K cells."""
    limits: Limits
    velocity: Floats
    """At the start, shape (n,) [m/s]."""
    acceleration: Floats
    """At the start, shape (n,) [m/s^2]."""
    known: Pieces | None
    """A way from the start to the last waypoint."""

    @property
    def moving(self) -> bool:
        """Whether the start is in motion."""
        return bool(self.velocity.any() or self.acceleration.any())

    @property
    def vias(self) -> Vias:
        """The waypoints as they are."""
        return Vias(self.points, np.zeros(len(self.points), dtype=np.bool_))


def time_parameterize(
    waypoints: ArrayLike,
    cells: Sequence[Polytope],
    limits: Limits = _DEFAULT_LIMITS,
    start_velocity: ArrayLike | None = None,
    start_acceleration: ArrayLike | None = None,
    *,
    quick: bool = False,
    previous: Trajectory | None = None,
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
        quick: for a control loop: a linear program or two (`quick_spline`) instead of dozens, some
            4 ms instead of 100 to 200, and a trajectory that takes a few per cent longer. The
            waypoints stay where they are: those of a shortest path give good times.
        previous: a known way from the start state to the last waypoint, such as the rest of the
            trajectory that is flown (`Trajectory.part`). It is kept where nothing faster is found
            and it lies in the cells given; it need not have been made for them.

    Returns:
        Trajectory that ends at rest. Its `containment` is the proof.

    Raises:
        ShapeError: shapes that do not fit each other, entries that are not finite.
        QueryError: a waypoint outside its cell, a start state beyond the limits, or one from which
            no stop inside the cells was found.
    """
    points, chain = checked_corridor(waypoints, cells)
    n = points.shape[1]
    velocity, acceleration = start_state(start_velocity, start_acceleration, limits, n)
    known = None
    if previous is not None:
        known = known_pieces(previous, points, limits, velocity, acceleration)
    query = _Query(points, chain, limits, velocity, acceleration, known)
    best = _quick(query) if quick else _thorough(query)
    if not within(best):
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


def _thorough(query: _Query) -> Trajectory:
    """The fastest proved of a spline with free steps and of everything that rests on its way."""
    points, chain, limits, velocity, acceleration, known = query
    vias = place_vias(points, chain)
    candidates = [_splines(vias, chain, limits, velocity, acceleration), known]
    if query.moving:
        candidates += _moving(vias, limits, velocity, acceleration, chain)
    else:
        candidates += _resting(points, vias, limits)
    return fastest_proved(candidates, chain, vias, limits)


def quick_trajectory(
    waypoints: ArrayLike,
    cells: Sequence[Polytope],
    limits: Limits = _DEFAULT_LIMITS,
    start_velocity: ArrayLike | None = None,
    start_acceleration: ArrayLike | None = None,
) -> Trajectory | None:
    """`time_parameterize(..., quick=True)` without its last resort: None where that takes long.

    For a loop that has something else to fly. Where it finds nothing, stops on the way might do.

    Raises:
        ShapeError: shapes that do not fit each other, entries that are not finite.
        QueryError: a waypoint outside its cell, or a start state beyond the limits.
    """
    points, chain = checked_corridor(waypoints, cells)
    v, a = start_state(start_velocity, start_acceleration, limits, points.shape[1])
    return _at_once(_Query(points, chain, limits, v, a, None))


def _quick(query: _Query) -> Trajectory:
    """What is found at once; if there is nothing, stops."""
    found = _at_once(query)
    if found is not None:
        return found
    points, chain, limits, velocity, acceleration, _ = query
    vias = query.vias
    if query.moving:
        candidates = _moving(vias, limits, velocity, acceleration, chain, quick=True)
    else:
        candidates = [polyline(points, range(len(points)), limits)]
    return fastest_proved(candidates, chain, vias, limits)


def _at_once(query: _Query) -> Trajectory | None:
    """The first proved of: the fastest motion without cells, and a spline of fixed steps."""
    points, chain, limits, velocity, acceleration, known = query
    vias = query.vias
    if query.moving:
        window = (0, len(chain))
        direct = from_state(points[0], velocity, acceleration, points[-1], limits, window)
        if not outside(direct.coefficients, direct.durations, chain):
            trial = proved(direct, chain, vias, limits)
            if holds(trial):
                return trial
    elif len(chain) == 1:
        return proved(polyline(points, (0, 1), limits), chain, vias, limits)
    old = None if known is None else proved(known, chain, vias, limits)
    safe = [] if old is None or not holds(old) else [old]
    # With a way on at hand, one program is all the time that a faster one is worth.
    rounds = 1 if safe else 3
    inner = Limits(*box_for(velocity, acceleration, limits))
    spline = quick_spline(points, chain, inner, velocity, acceleration, rounds)
    if spline is not None:
        new = proved(spline, chain, vias, limits)
        safe += [new] if holds(new) else []
    return min(safe, key=lambda trajectory: trajectory.duration, default=None)


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
    vias: Vias,
    limits: Limits,
    velocity: Floats,
    acceleration: Floats,
    cells: tuple[Polytope, ...],
    quick: bool = False,
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
            trial = proved(stopping, cells, vias, limits)
            reached = holds(trial)
        else:
            continue
        if reached:
            if quick:
                inner = Limits(*box_for(rested, rested, limits))
                on = quick_spline(points[k:], cells[k:], inner, rested, rested, rounds=1)
            else:
                on = _splines(vias.part(k, K), cells[k:], limits, rested, rested)
            candidates.append(on and Pieces.join([first, on.moved(k)]))
    stop = from_state(points[0], velocity, acceleration, None, limits, (0, K))
    cell = int(np.argmin([float(c.violation(stop.end[None])[0]) for c in cells]))
    on = straight(stop.end, points[cell + 1], limits, (cell, cell + 1))
    rest = [polyline(points, range(cell + 1, K + 1), limits)] if cell + 1 < K else []
    candidates.append(Pieces.join([stop, on, *rest]))
    return candidates
