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
from hzmp_sim.replanning.candidates import Dynamics, Rests, along, stopping
from hzmp_sim.replanning.commitment import Commitment, State
from hzmp_sim.replanning.crossing import crossed
from hzmp_sim.replanning.proof import Conflict, first_conflict
from hzmp_sim.replanning.refuges import refuges
from hzmp_sim.replanning.routes import Router
from hzmp_sim.replanning.sweeps import Sweeps
from hzmp_sim.settings import Replanning

if TYPE_CHECKING:
    from hzmp_sim.motion.forecast import Forecast
    from hzmp_sim.motion.hulls import Hulls
    from hzmp_sim.motion.source import Slabs

Reason = Literal["onward", "opened", "approach", "threat", "wait"]
"""Why a plan was taken: to go on; because a way has opened; to come nearer to where it is blocked;
since the old plan is not safe any more. "wait": the way is blocked, and none was taken."""

_WORTH = 0.05  # [s] of time to the goal that matters
_GUESS = 0.4  # [s] by which a guess of it may be wrong, where a trajectory reaches further
_FURTHER = 0.3  # [s] and [m] that count as further
_LATER = 0.1  # [s] by which the conflict of an unproved plan must be later
_AT_GOAL = 1e-6  # [m]
_NEAR = 0.05  # [m] from where the way is blocked that is not worth a move
_BEFORE = 0.05  # [m] that a way ends before what blocks it
_REFUGES = 8
_SLAB = 0.05  # [s]
_BLOCK = 40  # slabs that are predicted at a time


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
        self._failed = 0

    def rehearse(self, start: Floats, goal: Floats, prediction: Forecast) -> None:
        """Plan once in vain: what is made once, is made before the flight."""
        still = State(start, np.zeros_like(start), np.zeros_like(start))
        ahead, router = Ahead(prediction, 0.0), Router(self._space)
        slabs = ahead.until(self._settings.horizon)
        swept = Sweeps(prediction, slabs, start, self._dynamics.speed, {}).around(
            goal, closely=False
        )
        found = router.route(start, goal, swept)
        if found is not None and found.found:
            for candidate in along(found, still, 0.0, self._dynamics, most=1):
                self._conflict(candidate, ahead)

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
        ahead = Ahead(prediction, effect)
        state = current.state(effect)
        conflict = self._conflict(current, ahead)
        slabs = ahead.until(effect + self._settings.horizon)
        variant = self._failed % 3
        met_at = {number: time for number, time in self._met.items() if time > effect}
        sweeps = Sweeps(
            prediction, slabs, state.position, self._dynamics.speed, met_at if variant == 1 else {}
        )
        pace = 0.55 if variant == 2 else 1.0
        swept = sweeps.around(goal, closely=False)
        found = self._router.route(state.position, goal, swept)
        if found is None or not found.found:
            swept = sweeps.around(goal, closely=True)
            found = self._router.route(state.position, goal, swept)
        plan = found.plan if found else None
        if found and found.found:
            # With time left on a way that is proved, a second try can wait for the next plan.
            known = _Known(effect, state.position, found.plan.cost)
            hurry = conflict is not None or current.ends - effect < self._dynamics.braking
            most, rests = 3 if hurry else 1, self._rests(ahead)
            for candidate in along(
                found, state, effect, self._dynamics, rests=rests, most=most, pace=pace
            ):
                if conflict is None and not self._sooner(candidate, current, goal, known):
                    continue
                met = self._conflict(candidate, ahead)
                if met is None:
                    self._failed = 0
                    return self._taken(candidate, "onward", plan, conflict)
                self._met = {met.number: met.time}
            self._failed += 1
        if conflict is None and (effect < current.ends or current.remaining == 0.0):
            return Decision(None, "onward", plan, True, None)
        best, latest = None, -math.inf if conflict is None else conflict.time + _LATER
        for candidate in self._fallbacks(effect, current, goal, swept, slabs, conflict):
            met = self._conflict(candidate, ahead)
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

    def _conflict(self, commitment: Commitment, ahead: Ahead) -> Conflict | None:
        """Where a commitment is first not clear, until the guard after it has come to rest."""
        last = max(commitment.ends, ahead.start) + self._settings.guard
        return first_conflict(commitment, ahead.until(last), ahead.start)

    def _rests(self, ahead: Ahead) -> Rests:
        """Whether the body could rest somewhere for the guard time from about some time on."""

        def free(point: Floats, time: float) -> bool:
            slabs = ahead.until(time + self._settings.guard)
            late = slabs.b[max(0, math.floor((time - slabs.start) / _SLAB)) :]
            return not bool((slabs.A @ point < late).all(axis=2).any())

        return free

    def _sooner(
        self, candidate: Commitment, current: Commitment, goal: Floats, known: _Known
    ) -> bool:
        """Whether a commitment brings the body to the goal sooner than the one it flies."""
        end = current.end
        if np.abs(end - goal).max() <= _AT_GOAL:
            return self._arrival(candidate, known.effect) < current.ends - _WORTH
        if known.effect >= current.ends:
            return True  # it does not move
        # By the triangle inequality no way from its end is shorter than this.
        left = max(current.remaining, known.cost - float(np.linalg.norm(end - known.position)))
        old = self._arrival(replace(current, remaining=left), known.effect)
        further = candidate.ends > current.ends + _FURTHER and candidate.remaining < left - _FURTHER
        return self._arrival(candidate, known.effect) < old + (_GUESS if further else _WORTH)

    def _arrival(self, commitment: Commitment, time: float) -> float:
        """When the body is at the goal [s], about, if it goes on without a stop from a time [s] on.

        That costs the more, the more of its speed it has lost by then.
        """
        if not commitment.remaining:
            return commitment.ends
        lost = max(0.0, self._dynamics.braking - (commitment.ends - time))
        return commitment.ends + commitment.remaining / self._dynamics.axis_speed + lost

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


class _Known(NamedTuple):
    """Where the body is when a decision takes effect, and how far it has to go."""

    effect: float
    """[s]"""
    position: Floats
    """Shape (n,) [m]."""
    cost: float
    """Length of the path to the goal [m]."""


class Ahead:
    """Slabs of a prediction from a time on, made as far as they are asked for."""

    def __init__(self, prediction: Forecast, start: float) -> None:
        self.start = start
        """[s]"""
        self._prediction = prediction
        self._slabs = prediction.slabs(start, _SLAB, _BLOCK)

    def until(self, end: float) -> Slabs:
        """The slabs up to a time [s]."""
        count = max(1, math.ceil((end - self._slabs.start) / _SLAB - 1e-9))
        while len(self._slabs.b) < count:
            begin = self._slabs.start + _SLAB * len(self._slabs.b)
            more = self._prediction.slabs(begin, _SLAB, _BLOCK)
            self._slabs = replace(self._slabs, b=np.concatenate([self._slabs.b, more.b]))
        return replace(self._slabs, b=self._slabs.b[:count])
