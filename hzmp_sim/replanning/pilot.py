"""The planner's stage: from what is predicted to the trajectory that is flown next."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Plan
from hzmp_sim.replanning.ahead import Ahead
from hzmp_sim.replanning.candidates import Dynamics, along, stopping
from hzmp_sim.replanning.commitment import Commitment, State
from hzmp_sim.replanning.crossing import crossed
from hzmp_sim.replanning.proof import Conflict
from hzmp_sim.replanning.refuges import refuges
from hzmp_sim.replanning.routes import Router
from hzmp_sim.replanning.sweeps import Sweeps
from hzmp_sim.replanning.worth import Worth
from hzmp_sim.settings import Replanning

if TYPE_CHECKING:
    from hzmp_sim.motion.forecast import Forecast
    from hzmp_sim.motion.hulls import Hulls
    from hzmp_sim.motion.source import Slabs

Reason = Literal["onward", "opened", "approach", "threat", "wait"]
"""Why a plan was taken: to go on; because a way has opened; to come nearer to where it is blocked;
since the old plan is not safe any more. "wait": the way is blocked, and none was taken."""

_LATER = 0.1  # [s] by which the conflict of an unproved plan must be later
_NEAR = 0.05  # [m] from where the way is blocked that is not worth a move
_BEFORE = 0.05  # [m] that a way ends before what blocks it
_REFUGES = 8
_HURRIED = 3  # trajectories that are tried where there is little time left


class _Attempt(NamedTuple):
    """How a way to the goal is looked for."""

    pace: float
    """Share of the speed."""
    timed: bool
    """Whether what moves is cut out at the times at which the last attempt met it."""


_ATTEMPTS = (_Attempt(1.0, False), _Attempt(1.0, True), _Attempt(0.55, False))
"""One a decision: the first, and the others in turn as long as there is a conflict."""


@dataclass(frozen=True, eq=False)
class Decision:
    """What the planner found at one instant."""

    commitment: Commitment | None
    """To be flown from when it begins; None: go on with the old one."""
    reason: Reason
    plan: Plan | None
    """The path to the goal that was found, if any."""
    proved: bool
    """Whether the commitment (None: the old one) is proved clear as predicted."""
    conflict: Conflict | None
    """Where the old one was not."""


class Pilot:
    """Decides what to fly, from one instant to the next.

    The body always has a commitment that ends at rest. A new one is taken only if it is proved: in
    its cells, and clear of everything that moves as predicted, until some time (the guard) after it
    has come to rest. Only when the old one is proved no longer is the best of what is left taken.

    Args:
        space: of the static obstacles.
        dynamics: how the body may move.
        settings: of the loop.
    """

    def __init__(self, space: FreeSpace, dynamics: Dynamics, settings: Replanning) -> None:
        self._space, self._dynamics, self._settings = space, dynamics, settings
        self._router = Router(space)
        self._waited = False
        self._met: dict[int, float] = {}
        self._tries = 0

    def rehearse(self, start: Floats, goal: Floats, prediction: Forecast) -> None:
        """Plan once in vain: what is made once, is made before the flight."""
        still = State(start, np.zeros_like(start), np.zeros_like(start))
        ahead, router = Ahead(prediction, 0.0, self._settings.guard), Router(self._space)
        slabs = ahead.until(self._settings.horizon)
        sweeps = Sweeps(prediction, slabs, start, self._dynamics.speed, {})
        found = router.route(start, goal, sweeps.around(goal, closely=False))
        if found is not None and found.found:
            for candidate in along(found, still, 0.0, self._dynamics, most=1):
                ahead.conflict(candidate)

    def decide(
        self, effect: float, current: Commitment, goal: Floats, prediction: Forecast
    ) -> Decision:
        """The trajectory to fly from a time on.

        Args:
            effect: simulated time from which the decision takes effect [s].
            current: what is flown until then.
            goal: shape (n,) [m].
            prediction: of what moves, made now.
        """
        ahead = Ahead(prediction, effect, self._settings.guard)
        state, conflict = current.state(effect), ahead.conflict(current)
        slabs = ahead.until(effect + self._settings.horizon)
        attempt = _ATTEMPTS[self._tries % len(_ATTEMPTS)]
        met_at = self._met if attempt.timed else {}
        sweeps = Sweeps(prediction, slabs, state.position, self._dynamics.speed, met_at)
        swept = sweeps.around(goal, closely=False)
        found = self._router.route(state.position, goal, swept)
        if found is None or not found.found:
            swept = sweeps.around(goal, closely=True)
            found = self._router.route(state.position, goal, swept)
        plan = found.plan if found else None
        self._tries = self._tries + 1 if attempt != _ATTEMPTS[0] else 0
        if found and found.found:
            # With time left on a way that is proved, a second try can wait for the next plan.
            hurry = conflict is not None or current.ends - effect < self._dynamics.braking
            worth = Worth(self._dynamics, effect, state.position, goal, found.plan.cost)
            for candidate in along(
                found,
                state,
                effect,
                self._dynamics,
                rests=ahead.free,
                most=_HURRIED if hurry else 1,
                pace=attempt.pace,
            ):
                if conflict is None and not worth.sooner(candidate, current):
                    continue
                met = ahead.conflict(candidate)
                if met is None:
                    self._tries = 0
                    return self._taken(candidate, "onward", plan, conflict)
                self._met = {met.number: met.time}
                self._tries = max(self._tries, 1)
        if conflict is None and (effect < current.ends or current.remaining == 0.0):
            return Decision(None, "onward", plan, True, None)
        best, latest = None, -math.inf if conflict is None else conflict.time + _LATER
        for candidate in self._fallbacks(effect, current, goal, swept, slabs, conflict):
            met = ahead.conflict(candidate)
            if met is None:
                return self._taken(candidate, "approach", plan, conflict)
            if conflict is not None and met.time > latest:
                best, latest = candidate, met.time
        self._waited = True
        reason: Reason = "wait" if conflict is None else "threat"
        return Decision(best, reason, plan, conflict is None, conflict)

    def _taken(
        self, commitment: Commitment, reason: Reason, plan: Plan | None, conflict: Conflict | None
    ) -> Decision:
        """A decision for a commitment that is proved."""
        if conflict is not None:
            reason = "threat"
        elif self._waited and reason == "onward":
            reason = "opened"
        self._waited = reason == "approach"
        return Decision(commitment, reason, plan, True, conflict)

    def _fallbacks(
        self,
        effect: float,
        current: Commitment,
        goal: Floats,
        swept: Hulls,
        slabs: Slabs,
        conflict: Conflict | None,
    ) -> Iterator[Commitment]:
        """What is left where no way to the goal is open: stop, come nearer to it, get away."""
        state, dynamics = current.state(effect), self._dynamics
        if conflict is not None:
            yield from stopping(self._space, state, effect, dynamics, current.remaining)
        static = self._router.static(state.position, goal)
        if static is not None and static.found:
            free = crossed(static.plan.waypoints, swept)[1] - _BEFORE
            if free > _NEAR:
                yield from along(static, state, effect, dynamics, free)
        if conflict is None:
            return
        for point in refuges(self._space, slabs, state.position, _REFUGES):
            away = self._router.aside(state.position, point, swept)
            if away is not None and away.found:
                left = float(np.linalg.norm(goal - point))
                for candidate in along(away, state, effect, dynamics):
                    yield replace(candidate, remaining=left)
