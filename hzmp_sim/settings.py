"""Settings of a run: one dataclass for the Python call and the command line, and its parts."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from hzmp_planners.errors import QueryError

if TYPE_CHECKING:
    from hzmp_tracking import Limits


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """What the controller is not told of; random parts follow the seed of the run.

    Attributes:
        wind: mean velocity of the air [m/s], on top of that of the world's own option; it drags on
            the body by MuJoCo's own fluid model, in air at sea level unless the world has a medium.
        gust: largest size of what comes and goes on top of the wind [m/s].
        thrust_loss: share of its force that every actuator of the body lacks.
        position_noise: standard deviation of the measured position on each axis [m].
        velocity_noise: of the measured velocity [m/s].
        delay: age of what the controller measures [s].
    """

    wind: Annotated[tuple[float, float, float], Parameter(negative=())] = (0.0, 0.0, 0.0)
    gust: float = 0.0
    thrust_loss: float = 0.0
    position_noise: float = 0.0
    velocity_noise: float = 0.0
    delay: float = 0.0

    def __post_init__(self) -> None:
        if len(self.wind) != 3 or not all(math.isfinite(speed) for speed in self.wind):
            raise QueryError(f"wind must be three finite numbers [m/s], got {list(self.wind)}")
        for field in fields(self)[1:]:
            value = getattr(self, field.name)
            if not 0.0 <= value < math.inf:
                raise QueryError(f"{field.name} must be finite and at least 0, got {value}")
        if self.thrust_loss >= 1.0:
            raise QueryError(f"thrust_loss must be less than 1, got {self.thrust_loss}")

    @property
    def blows(self) -> bool:
        """Whether the air moves."""
        return self.gust > 0.0 or any(self.wind)

    def describe(self) -> str:
        """What there is of it, in words; "" if nothing."""
        speeds = " ".join(f"{speed:g}" for speed in self.wind)
        parts = (
            (any(self.wind), f"wind of {speeds} m/s"),
            (self.gust, f"gusts of up to {self.gust:g} m/s"),
            (self.thrust_loss, f"{100.0 * self.thrust_loss:g} % less thrust"),
            (self.position_noise, f"positions measured to {self.position_noise:g} m"),
            (self.velocity_noise, f"velocities measured to {self.velocity_noise:g} m/s"),
            (self.delay, f"measurements {1e3 * self.delay:g} ms old"),
        )
        return ", ".join(words for there, words in parts if there)


_CALM = Disturbance()


@dataclass(frozen=True, kw_only=True)
class Replanning:
    """The planner in the loop: for worlds in which something moves, and for several goals.

    Attributes:
        period: time between two plans [s].
        latency: time until a plan takes effect [s]; "measured": what it takes on this machine, so
            that two runs are no longer the same.
        horizon: how far ahead what moves is looked at to find a way [s].
        guard: how long a body at rest must be safe, as predicted, for a plan to be taken [s].
        duration: the flight ends at rest after this time, wherever it is [s].
        prediction_acceleration: of what moves without being announced, at most [m/s^2]: how fast
            the planner's uncertainty of it begins to grow.
        prediction_speed_change: by which its velocity changes at most, while it is looked ahead
            [m/s]: how fast the uncertainty goes on to grow.
        from_rest: plan only when the body has come to rest: what a planner outside of the loop can
            do, for comparison.
        patience: the planner has failed when it gives no answer for this time [s of the wall
            clock].
    """

    period: float = 0.05
    latency: float | Literal["measured"] = 0.05
    horizon: float = 3.0
    guard: float = 2.0
    duration: float = 120.0
    prediction_acceleration: float = 2.0
    prediction_speed_change: float = 0.3
    from_rest: Annotated[bool, Parameter(negative=())] = False
    patience: float = 20.0

    def __post_init__(self) -> None:
        for name in ("period", "horizon", "duration", "patience"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise QueryError(f"{name} must be positive and finite, got {value}")
        for name in ("guard", "prediction_acceleration", "prediction_speed_change"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise QueryError(f"{name} must be finite and at least 0, got {value}")
        if self.latency != "measured" and not 0.0 <= self.latency < math.inf:
            raise QueryError(
                f'latency must be "measured", or finite and at least 0, got {self.latency}'
            )


_IN_LOOP = Replanning()


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
        speed: limit on the norm of the velocity [m/s]. Of each derivative that is limited here, by
            axes or norm, the usual limits do not hold.
        total_acceleration: limit on the norm of the acceleration [m/s^2].
        total_jerk: limit on the norm of the jerk [m/s^3].
        goal_tolerance: the body has arrived when its centre is this near to the goal [m].
        settle_time: how long to wait for arrival after the trajectory has ended [s].
        video: render run.mp4, the slowest of the artefacts.
        disturbance: what the flight has to put up with, unknown to planner and controller.
        control_rate: how often the controller is asked [Hz]; default: at each physics step.
        real_time: fly no faster than the clock on the wall.
        replanning: the planner in the loop, where something moves or there are several goals.
    """

    seed: int = 0
    time_limit: float = 5.0
    gap: float = 1e-3
    velocity: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    speed: float | None = None
    total_acceleration: float | None = None
    total_jerk: float | None = None
    goal_tolerance: float = 0.05
    settle_time: float = 2.0
    video: bool = True
    disturbance: Disturbance = _CALM
    control_rate: float | None = None
    real_time: Annotated[bool, Parameter(negative=())] = False
    replanning: Replanning = _IN_LOOP

    def __post_init__(self) -> None:
        if not isinstance(self.seed, int) or self.seed < 0:
            raise QueryError(f"seed must be a whole number of at least 0, got {self.seed}")
        positive = (
            *("time_limit", "velocity", "acceleration", "jerk", "speed", "total_acceleration"),
            *("total_jerk", "goal_tolerance", "control_rate"),
        )
        for name in positive:
            value = getattr(self, name)
            if value is not None and not 0.0 < value < math.inf:
                raise QueryError(f"{name} must be positive and finite, got {value}")
        for name in ("gap", "settle_time"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise QueryError(f"{name} must be finite and at least 0, got {value}")

    def steps_between(self, dt: float) -> int:
        """Physics steps of `dt` [s] between two calls of the controller."""
        return 1 if self.control_rate is None else max(1, round(1.0 / (self.control_rate * dt)))

    def limits(self, usual: Limits) -> Limits:
        """Of the reference: those that are set here, else the usual ones of the body."""
        pairs = (("velocity", "speed"), ("acceleration", "total_acceleration"),
                 ("jerk", "total_jerk"))  # fmt: skip
        changed: dict[str, Any] = {}
        for axis, norm in pairs:
            each, total = getattr(self, axis), getattr(self, norm)
            if each is not None or total is not None:
                changed |= {axis: total if each is None else each, norm: total}
        return replace(usual, **changed)
