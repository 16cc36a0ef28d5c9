"""The guide of a flight among moving obstacles: asks the planner, and flies what it has taken."""

from __future__ import annotations

import math
import time as clock
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space import FreeSpace
from hzmp_sim.replanning.flown import FlownReference, rest_at
from hzmp_sim.replanning.goals import Goals, is_at
from hzmp_sim.replanning.pilot import Decision, Pilot
from hzmp_sim.replanning.records import BrokenPrediction, FlightPlan, PlanRecord, worst_broken
from hzmp_sim.replanning.watchdog import StageError, Watchdog
from hzmp_sim.scene import Scene
from hzmp_sim.settings import RunSettings
from hzmp_sim.simulation.guide import AT_REST, ReferenceRow, reference_rows
from hzmp_tracking import Limits, Trajectory

if TYPE_CHECKING:
    from hzmp_sim.motion.forecast import Forecast, Forecaster

_ROWS = 128  # of the reference that are sampled at a time
_GUESSED = 0.03  # [s] that a plan is taken to need before one was made
_AS_LONG = 1.5  # times the longest of the last plans: what the next may take
_REMEMBERED = 20  # plans
_COMPARED = 1.0  # [s] for which a prediction is compared with what comes
_TIME_TOL = 1e-9  # [s]
_AT_GOAL = 1e-6  # [m]
_LANDING = 15.0  # [s] in which a trajectory that is flown at the end of the time comes to rest


class _Pending(NamedTuple):
    """An answer of the planner that has not taken effect yet."""

    decision: Decision
    record: PlanRecord


class Replanner:
    """Plans on a period while it flies; see `Guide`.

    Args:
        scene: the world.
        space: free space of what does not move.
        pilot: decides what to fly.
        predictor: makes predictions of what moves.
        goals: where to go.
        limits: of the reference.
        settings: of the run.
        smoothing: window over which the reference is smoothed [s], see `smooth_sample`.
    """

    def __init__(
        self,
        scene: Scene,
        space: FreeSpace,
        pilot: Pilot,
        predictor: Forecaster,
        goals: Goals,
        limits: Limits,
        settings: RunSettings,
        smoothing: float = 0.0,
    ) -> None:
        self._scene, self._pilot, self._predictor, self._goals = scene, pilot, predictor, goals
        self._tolerance, self._loop = settings.goal_tolerance, settings.replanning
        self._smoothing, self._settle = smoothing, settings.settle_time
        self._dt = float(scene.model.opt.timestep)
        script = scene.motion
        asked = math.inf if script is None or script.duration is None else script.duration
        self._until = min(self._loop.duration, asked)
        self.longest = self._until + _LANDING + self._settle
        """See `Guide` [s]."""
        self._every = max(1, round(self._loop.period / self._dt))
        self._flown = FlownReference(rest_at(space, scene.start, limits, self._dt))
        self._pending: _Pending | None = None
        self._rows: list[ReferenceRow] = []
        self._first_row = 0
        self._watchdog = Watchdog(self._loop.patience)
        self._records: list[PlanRecord] = []
        self._broken: list[BrokenPrediction] = []
        self._predictions: deque[Forecast] = deque(
            maxlen=max(2, round(_COMPARED / self._loop.period))
        )
        self._compared = 0.0
        self._failure = ""
        self._arrived = False
        self._time = 0.0

    def reference(self, step: int, time: float, data: mujoco.MjData) -> ReferenceRow:
        """See `Guide`."""
        self._time = time
        self._adopt(time)
        if step % self._every == 0 and self._asks(time) and self._predictor.ready(data, time):
            self._ask(step, time, data)
            self._adopt(time)
        row = step - self._first_row
        if not 0 <= row < len(self._rows):
            around, begins = self._flown.around(self._smoothing)
            times = time - begins + self._dt * np.arange(_ROWS, dtype=np.float64)
            self._rows = reference_rows(self._scene, around, times, self._smoothing)
            self._first_row, row = step, 0
        return self._rows[row]

    def over(self, time: float, position: Floats, speed: float) -> bool:
        """See `Guide`."""
        current, goal = self._flown.current, self._goals.now(time)
        if time < current.ends or speed > AT_REST:
            return False
        near = is_at(position[: goal.size], goal, self._tolerance)
        if near and is_at(current.end, goal, _AT_GOAL):
            self._pending = None  # made for the goal that is reached
            self._arrived = self._goals.arrive(time)
            if self._arrived:
                return True
        stopped = bool(self._failure) or time >= self._until
        return stopped and time >= current.ends + self._settle

    def flown(self) -> Trajectory:
        """The reference until the end, each piece proved in its cell."""
        return self._flown.whole(self._time)

    def result(self) -> FlightPlan:
        """What was planned."""
        return FlightPlan(
            records=tuple(self._records),
            broken=worst_broken(self._broken),
            failure=self._failure,
            goals_reached=self._goals.reached,
            arrived=self._arrived,
            guard=self._loop.guard,
        )

    def _asks(self, time: float) -> bool:
        """Whether the planner is to be asked now."""
        if self._pending is not None or self._failure or time >= self._until:
            return False
        return not self._loop.from_rest or time >= self._flown.current.ends

    def _ask(self, step: int, time: float, data: mujoco.MjData) -> None:
        """Let the planner decide what to fly from some time on."""
        began = clock.perf_counter()
        self._compare(time, data)
        effect = self._dt * (step + max(1, math.ceil(self._allowed() / self._dt - _TIME_TOL)))
        goal, current = self._goals.now(time), self._flown.current

        def decide() -> Decision:
            self._predictions.append(self._predictor.predict(data, time))
            return self._pilot.decide(effect, current, goal, self._predictions[-1])

        try:
            decision = self._watchdog.call(decide)
        except StageError as failure:
            self._failure = f"at {time:.3f} s: {failure}"
            return
        latency = clock.perf_counter() - began
        record = self._record(time, effect, decision, latency, goal)
        if self._loop.latency == "measured" and latency > effect - time:
            self._records.append(replace(record, reason="late", taken=False))
            return
        self._pending = _Pending(decision, record)

    def _compare(self, time: float, data: mujoco.MjData) -> None:
        """Compare what is seen with the last prediction, and with the oldest that is kept."""
        made = self._predictions
        for prediction in [made[0], made[-1]] if len(made) > 1 else made:
            self._broken += [
                BrokenPrediction(one.name, one.time, one.distance, self._compared)
                for one in prediction.broken(data, time)
            ]
        self._compared = time

    def _allowed(self) -> float:
        """How long the planner may take [s]."""
        if self._loop.latency != "measured":
            return self._loop.latency
        last = [record.latency for record in self._records[-_REMEMBERED:]]
        return _AS_LONG * max(last, default=_GUESSED)

    def _adopt(self, time: float) -> None:
        """Let an answer take effect when its time has come."""
        if self._pending is None or time < self._pending.record.effect - _TIME_TOL:
            return
        decision, record = self._pending
        self._pending = None
        self._records.append(record)
        if decision.commitment is not None:
            self._flown.switch(decision.commitment)
            self._rows = []

    def _record(
        self, time: float, effect: float, decision: Decision, latency: float, goal: Floats
    ) -> PlanRecord:
        plan, conflict = decision.plan, decision.conflict
        commitment = decision.commitment or self._flown.current
        return PlanRecord(
            time=time,
            effect=effect,
            reason=decision.reason,
            taken=decision.commitment is not None,
            proved=decision.proved,
            latency=latency,
            goal=goal,
            cost=math.inf if plan is None else plan.cost,
            lower_bound=0.0 if plan is None else plan.lower_bound,
            ends=commitment.ends,
            conflict="" if conflict is None else self._name(conflict.number),
            conflict_time=math.nan if conflict is None else conflict.time,
            waypoints=np.zeros((0, goal.size)) if plan is None else plan.waypoints,
        )

    def _name(self, number: int) -> str:
        return self._scene.geom_name(self._predictions[-1].geoms[number])
