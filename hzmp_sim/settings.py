"""Settings of a run: one dataclass for the Python call and the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hzmp_planners.errors import QueryError


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """How to plan, fly and record.

    Attributes:
        seed: seed of the planner's samples; the same seed gives the same run.
        time_limit: time the planner may take [s]; it stops earlier when the gap is reached.
        gap: optimality gap at which the planner stops: (cost - lower bound) / lower bound.
        velocity: limit on each axis [m/s]; default: what the body can follow.
        acceleration: limit on each axis [m/s^2]; default: what the body can follow.
        jerk: limit on each axis [m/s^3]; default: what the body can follow.
        goal_tolerance: the body has arrived when its centre is this near to the goal [m].
        settle_time: how long to wait for arrival after the trajectory has ended [s].
        video: render run.mp4, the slowest of the artefacts.
    """

    seed: int = 0
    time_limit: float = 5.0
    gap: float = 1e-3
    velocity: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    goal_tolerance: float = 0.05
    settle_time: float = 2.0
    video: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.seed, int) or self.seed < 0:
            raise QueryError(f"seed must be a whole number of at least 0, got {self.seed}")
        positive = ("time_limit", "velocity", "acceleration", "jerk", "goal_tolerance")
        for name in positive:
            value = getattr(self, name)
            if value is not None and not 0.0 < value < math.inf:
                raise QueryError(f"{name} must be positive and finite, got {value}")
        for name in ("gap", "settle_time"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise QueryError(f"{name} must be finite and at least 0, got {value}")
