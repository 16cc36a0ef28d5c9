"""What the planner did in flight: a row for each time it was asked."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hzmp_planners._arrays import Floats


@dataclass(frozen=True, eq=False)
class PlanRecord:
    """One decision of the planner."""

    time: float
    """Simulated time at which it was asked [s]."""
    effect: float
    """From when the answer holds [s]."""
    reason: str
    """See `replanning.pilot.Reason`; "late": it came after it should have taken effect."""
    taken: bool
    """Whether there is a new trajectory to fly."""
    proved: bool
    """Whether what is flown from then on is proved clear of everything, as predicted."""
    latency: float
    """Time of computing [s]."""
    goal: Floats
    """Shape (n,) [m]."""
    cost: float
    """Length of the path to the goal [m]; inf if there was none."""
    lower_bound: float
    """No path is shorter, among the obstacles as they were predicted [m]."""
    ends: float
    """When the trajectory flown from then on has come to rest [s]."""
    conflict: str
    """Geom that the trajectory flown before was in conflict with, as predicted; "" if none."""
    conflict_time: float
    """When that would have been [s]; nan if never."""
    waypoints: Floats
    """Of the path to the goal, shape (k, n) [m]."""


@dataclass(frozen=True)
class BrokenPrediction:
    """A moving obstacle that was not where it was predicted to be."""

    geom: str
    time: float
    """When first [s]."""
    error: float
    """By how much at most [m]."""
    held: float
    """When it was last seen where it had been predicted to be [s]; 0 if never."""


@dataclass(frozen=True, eq=False)
class FlightPlan:
    """What was planned in a flight, and why it ended."""

    records: tuple[PlanRecord, ...] = ()
    broken: tuple[BrokenPrediction, ...] = ()
    failure: str = ""
    """What became of the planner; "" as long as it answered."""
    goals_reached: int = 0
    arrived: bool = False
    """Whether all goals were reached."""
    guard: float = math.inf
    """How long what is proved of a trajectory goes on holding after it has come to rest [s]."""

    def in_effect(self, time: float) -> PlanRecord | None:
        """The decision that holds at a simulated time [s]; None before the first one."""
        return next((one for one in reversed(self._answers) if one.effect <= time), None)

    def proved_until(self, record: PlanRecord) -> float:
        """Until when what is flown from a decision on is proved clear [s]; its begin if it is not.

        A planner that takes longer than the guard lets a body at rest outlast its proof.
        """
        return max(record.ends, record.effect) + self.guard if record.proved else record.effect

    def metrics(self, end: float) -> dict[str, Any]:
        """What metrics.json says of it, of a flight that ended at a simulated time [s]."""
        latency = 1e3 * np.array([record.latency for record in self.records])
        spread: dict[str, float | None] = {"median": None, "p99": None, "max": None}
        if latency.size:
            spread = {
                "median": float(np.median(latency)),
                "p99": float(np.quantile(latency, 0.99)),
                "max": float(latency.max()),
            }
        return {
            "replans": sum(record.taken for record in self.records),
            "replan_latency_ms": spread,
            "plans_asked": len(self.records),
            "plans_for": dict(Counter(record.reason for record in self.records)),
            "waited_s": self._waited(),
            "unproved_s": self._unproved(end),
            "planner_failure": self.failure,
            "goals_reached": self.goals_reached,
        }

    def warnings(self) -> list[str]:
        """What the user should know of it."""
        found = [
            f"{broken.geom} was up to {broken.error:.3g} m away from where it was predicted, first "
            f"at {broken.time:.3g} s: what was proved of it does not hold"
            for broken in self.broken
        ]
        if self.failure:
            found.append(f"the planner failed {self.failure}; the body came to rest as planned")
        late = [record for record in self.records if record.latency > record.effect - record.time]
        if late:
            longest = max(record.latency for record in late)
            found.append(
                f"{len(late)} of {len(self.records)} plans took longer to compute on this machine "
                f"than they were given (up to {1e3 * longest:.0f} ms)"
            )
        return found

    @property
    def _answers(self) -> list[PlanRecord]:
        """The decisions that came in time."""
        return [record for record in self.records if record.reason != "late"]

    def _unproved(self, end: float) -> float:
        """Simulated time in which what was flown was not proved [s]."""
        answers = self._answers
        ends = [*(record.effect for record in answers[1:]), end]
        spans = zip(answers, ends, strict=False)
        return float(sum(max(0.0, until - self.proved_until(record)) for record, until in spans))

    def _waited(self) -> float:
        """Simulated time in which the last decision was to wait [s]."""
        times = [record.effect for record in self.records]
        spans = zip(self.records, np.diff(times).tolist(), strict=False)
        return float(sum(span for record, span in spans if record.reason == "wait"))


def worst_broken(found: Sequence[BrokenPrediction]) -> tuple[BrokenPrediction, ...]:
    """One for each geom: since when, and by how much at most."""
    worst: dict[str, BrokenPrediction] = {}
    for one in found:
        old = worst.get(one.geom, one)
        worst[one.geom] = BrokenPrediction(one.geom, old.time, max(old.error, one.error), old.held)
    return tuple(worst.values())
