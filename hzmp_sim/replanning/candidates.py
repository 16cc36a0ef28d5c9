"""Trajectories that could be flown next: along a route, up to an obstacle, or out of the way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
ALL_SHARES = (1.0, 0.55, 1.8)
"""Of that reach, which are worth a try where nothing else is there to fly."""
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
    shares: Sequence[float] = ALL_SHARES,
) -> Iterator[Commitment]:
    """Follow a route: some way ahead, then ways of other lengths.

    Args:
        route: from where the state is.
        state: of the reference when the trajectory begins.
        begins: when that is [s].
        dynamics: how the body may move.
        length: of the route that may be used [m].
        shares: of the way that a trajectory reaches ahead, tried one after the other.
    """
    whole = path_length(route.plan.waypoints)
    tried: list[float] = []
    cells: list[Polytope] = []
    for share in shares:
        wanted = min(share * dynamics.reach, length)
        if wanted >= whole - 0.25 * dynamics.reach and length >= whole:
            wanted = whole  # what is left would not be worth another plan
        if wanted <= _SHORT or any(abs(wanted - other) < _SHORT for other in tried):
            continue
        tried.append(wanted)
        waypoints = shortened(route.plan.waypoints, wanted)
        if len(cells) < len(waypoints) - 1:
            cells = route.plan.cells(route.space, count=len(waypoints) - 1)
        trajectory = timed(waypoints, cells[: len(waypoints) - 1], state, dynamics)
        if trajectory is not None:
            yield Commitment(trajectory, begins, max(0.0, whole - wanted))


def timed(
    waypoints: Floats, cells: Sequence[Polytope], state: State, dynamics: Dynamics
) -> Trajectory | None:
    """A trajectory from a moving start, proved in its cells; None if none was found."""
    try:
        return quick_trajectory(
            waypoints, cells, dynamics.limits, state.velocity, state.acceleration
        )
    except HzmpError:
        return None


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
