"""Trajectories that could be flown next: along a route, up to an obstacle, or out of the way."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import HzmpError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.result import path_length
from hzmp_planners.sets import Polytope
from hzmp_sim.replanning.commitment import Commitment, State
from hzmp_sim.replanning.crossing import shortened
from hzmp_sim.replanning.routes import Route
from hzmp_tracking import Limits, Trajectory, quick_trajectory, stop_trajectory

_AHEAD = 1.5  # [s] at full speed that a trajectory reaches ahead of the way to stop
_SHARES = (1.0, 1.3, 0.75, 1.7, 0.55)
"""Of that reach, in the order in which they are worth a try."""
Rests = Callable[[Floats, float], bool]
"""Whether the body could rest at a place (n,) [m] from a time on [s]."""
_OFF = 1e-3  # [m] that a place to rest is moved towards the middle of its cell
_SHORT = 1e-3  # [m] ends that are nearer than this are one


class Dynamics(NamedTuple):
    """How the body may move."""

    limits: Limits
    n: int

    @property
    def speed(self) -> float:
        """A bound on the length of the velocity [m/s]."""
        return float(np.linalg.norm(self.limits.per_axis(self.n)[0]))

    @property
    def reach(self) -> float:
        """How far ahead a trajectory ends [m]: no speed is lost where another one goes on."""
        return (_AHEAD + 0.5 * self.braking) * self.axis_speed

    @property
    def axis_speed(self) -> float:
        """Speed that is reached in each direction [m/s]."""
        return self._slowest[0]

    @property
    def braking(self) -> float:
        """How long it takes to stop from full speed [s]."""
        v, a, j = self._slowest
        return v / a + a / j

    def slowed(self, share: float, velocity: Floats) -> Limits:
        """With a share of the speed, but at least that of a velocity (n,) [m/s]."""
        v, a, j = self.limits.per_axis(self.n)
        return Limits(np.minimum(v, np.maximum(share * v, 1.01 * np.abs(velocity))), a, j)

    def needed(self, length: float, velocity: Floats) -> float:
        """Time [s] to rest after a way [m], about, with velocity (n,) [m/s] at its beginning."""
        speed = min(1.0, float(np.linalg.norm(velocity)) / self.axis_speed)
        return length / self.axis_speed + self.braking * (1.0 - 0.5 * speed)

    @property
    def _slowest(self) -> tuple[float, float, float]:
        """The least bounds of the axes."""
        v, a, j = (float(bound.min()) for bound in self.limits.per_axis(self.n))
        return v, a, j


def along(
    route: Route,
    state: State,
    begins: float,
    dynamics: Dynamics,
    length: float = np.inf,
    rests: Rests | None = None,
    most: int = 3,
    pace: float = 1.0,
) -> Iterator[Commitment]:
    """Follow a route: some way ahead, then ways of other lengths.

    Args:
        route: from where the state is.
        state: of the reference when the trajectory begins.
        begins: when that is [s].
        dynamics: how the body may move.
        length: of the route that may be used [m].
        rests: whether the body could rest at a place from a time on; such ends are tried first.
        most: how many are tried.
        pace: share of the speed.
    """
    whole = path_length(route.plan.waypoints)
    lengths: list[float] = []
    for share in _SHARES:
        wanted = min(share * dynamics.reach, length)
        if wanted >= whole - 0.25 * dynamics.reach and length >= whole:
            wanted = whole  # what is left would not be worth another plan
        if wanted > _SHORT and not any(abs(wanted - other) < _SHORT for other in lengths):
            lengths.append(wanted)
    ways = [shortened(route.plan.waypoints, wanted) for wanted in lengths]
    if rests is not None:
        times = [begins + dynamics.needed(wanted, state.velocity) / pace for wanted in lengths]
        good = [rests(way[-1], time) for way, time in zip(ways, times, strict=True)]
        order = sorted(range(len(ways)), key=lambda k: not good[k])
    else:
        order = list(range(len(ways)))
    cells: list[Polytope] = []
    for k in order[:most]:
        count = len(ways[k]) - 1
        if len(cells) < count:
            cells = route.plan.cells(route.space, count=count)
        way = ways[k]
        if lengths[k] < whole:
            way = np.vstack([way[:-1], _inside(cells[count - 1], way[-1])])
        trajectory = timed(way, cells[:count], state, dynamics, pace)
        if trajectory is not None:
            yield Commitment(trajectory, begins, max(0.0, whole - lengths[k]))


def _inside(cell: Polytope, point: Floats) -> Floats:
    """A point (n,) of a cell, moved off its facets.

    Paths run along them, and a body that rests on a facet may be found outside of the next cells
    by a rounding.
    """
    middle = cell.vertices().mean(axis=0)
    way = middle - point
    return np.asarray(point + _OFF / max(float(np.linalg.norm(way)), _OFF) * way)


def timed(
    waypoints: Floats,
    cells: Sequence[Polytope],
    state: State,
    dynamics: Dynamics,
    pace: float = 1.0,
) -> Trajectory | None:
    """A trajectory from a moving start, proved in its cells; None if none was found."""
    limits = dynamics.limits if pace == 1.0 else dynamics.slowed(pace, state.velocity)
    try:
        found = quick_trajectory(waypoints, cells, limits, state.velocity, state.acceleration)
    except HzmpError:
        return None
    return found and replace(found, limits=dynamics.limits)


def stopping(
    space: FreeSpace, state: State, begins: float, dynamics: Dynamics, remaining: float
) -> Iterator[Commitment]:
    """Come to rest as soon as possible, in the leaves that hold the body."""
    cells = [space.leaf(int(leaf)) for leaf in space.leaves_at(state.position)]
    if not cells:
        return
    try:
        stop = stop_trajectory(
            state.position, state.velocity, cells, dynamics.limits, state.acceleration
        )
    except HzmpError:
        return
    yield Commitment(stop, begins, remaining)
