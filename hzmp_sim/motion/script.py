"""A motion script: what drives the bodies of a world, and where the flown body is to go when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from hzmp_planners.errors import QueryError
from hzmp_sim.motion.checks import boolean, number, numbers
from hzmp_sim.motion.paths import Callback, Circle, Path, Row, Swing
from hzmp_sim.motion.waypoints import Keyframes, Waypoints

TargetKind = Literal["body", "joint", "actuator"]

TARGETS: tuple[TargetKind, ...] = ("body", "joint", "actuator")


@dataclass(frozen=True, kw_only=True)
class Motion:
    """One thing of the world moves along a path; exactly one of body, joint and actuator says what.

    Attributes:
        body: name of a mocap body.
        joint: name of a hinge or slide joint; its position and velocity are set.
        actuator: name of an actuator; its input is set, MuJoCo does the rest.
        path: how it moves.
        announced: the planner's predictions know the path; else they only see where the body is.
        speed: how many times as fast as the path says, positive.
        offset: how far along its path it is at time 0 [s] (of the path's own time).
    """

    path: Path | Keyframes
    body: str | None = None
    joint: str | None = None
    actuator: str | None = None
    announced: bool = True
    speed: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        named = [kind for kind in TARGETS if getattr(self, kind) is not None]
        if len(named) != 1:
            raise QueryError(
                f"a motion needs exactly one of {', '.join(TARGETS)}, got {', '.join(named) or '-'}"
            )
        if not isinstance(self.name, str):
            raise QueryError(f"{self.kind} must be a name, got {self.name!r}")
        boolean("announced", self.announced)
        number("offset", self.offset)
        if number("speed", self.speed) <= 0.0:
            raise QueryError(f"speed must be positive, got {self.speed}")
        if not isinstance(self.path, Waypoints | Circle | Swing | Keyframes | Callback):
            raise QueryError(
                f"path must be Waypoints, Circle, Swing, Keyframes or Callback, got {self.path!r}"
            )
        if isinstance(self.path, Keyframes):
            return
        width = self.path.width
        if (width == 1) == (self.kind == "body"):
            has = "values" if width == 1 else "positions"
            raise QueryError(f"{self.describe()}: a path of {has} does not suit a {self.kind}")

    @property
    def kind(self) -> TargetKind:
        """What it moves."""
        return next(kind for kind in TARGETS if getattr(self, kind) is not None)

    @property
    def name(self) -> str:
        """Of what it moves."""
        name: str = getattr(self, self.kind)
        return name

    def describe(self) -> str:
        """What it moves, in words."""
        return f"{self.kind} {self.name!r}"

    def at(self, t: float) -> Row:
        """The row of its path at simulated time t [s]."""
        return self._known.at(self.speed * t + self.offset)

    def rate(self, t: float) -> float:
        """Derivative of the first number at simulated time t [1/s]."""
        return self.speed * self._known.rate(self.speed * t + self.offset)

    @property
    def _known(self) -> Path:
        if isinstance(self.path, Keyframes):
            raise QueryError(f"{self.describe()}: its keyframes are not looked up yet")
        return self.path


@dataclass(frozen=True, kw_only=True)
class Goal:
    """Where the flown body is to go next.

    Attributes:
        position: of its centre, 2 or 3 coordinates [m].
        time: when it is told so [s]; None: on arrival at the goal before, and after its dwell.
        dwell: how long it stays there before it goes on [s].
    """

    position: Row
    time: float | None = None
    dwell: float = 0.0

    def __post_init__(self) -> None:
        if len(numbers("position", self.position)) not in (2, 3):
            raise QueryError(f"position must have 2 or 3 coordinates, got {list(self.position)}")
        if self.time is not None and number("time", self.time) < 0.0:
            raise QueryError(f"time must be at least 0, got {self.time}")
        if number("dwell", self.dwell) < 0.0:
            raise QueryError(f"dwell must be at least 0, got {self.dwell}")


@dataclass(frozen=True, kw_only=True)
class MotionScript:
    """What moves in a world, and the goals of the body that flies there.

    Attributes:
        motions: what moves, each thing once.
        goals: one after the other, after the goal of the scene.
        patrol: go round the goals for ever, until `duration`.
        duration: how long the run takes at most [s]; None: until the last goal.
    """

    motions: Sequence[Motion] = ()
    goals: Sequence[Goal] = ()
    patrol: bool = False
    duration: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "motions", tuple(self.motions))
        object.__setattr__(self, "goals", tuple(self.goals))
        seen: set[tuple[str, str]] = set()
        for motion in self.motions:
            if (motion.kind, motion.name) in seen:
                raise QueryError(f"{motion.describe()} has two motions: give it one")
            seen.add((motion.kind, motion.name))
        times = [goal.time for goal in self.goals if goal.time is not None]
        if times != sorted(times):
            raise QueryError(f"times of goals must ascend, got {times}")
        boolean("patrol", self.patrol)
        if self.duration is not None and number("duration", self.duration) <= 0.0:
            raise QueryError(f"duration must be positive, got {self.duration}")
        if self.patrol and (self.duration is None or not self.goals):
            raise QueryError("patrol needs goals to go round and a duration after which it ends")
        if self.patrol and times:
            raise QueryError("patrol goes on at each arrival: its goals have no time")

    def with_phases(self, seed: int, speeds: tuple[float, float] = (0.85, 1.15)) -> MotionScript:
        """The same script at other moments: a world for each seed.

        Args:
            seed: of the random numbers.
            speeds: each motion is as many times as fast, drawn between these two.

        Returns:
            A script in which each motion that repeats itself begins anywhere in its cycle. Those
            along one path keep their distances; what moves only once keeps its times.
        """
        rng = np.random.default_rng(seed)
        low, high = speeds
        if not 0.0 < low <= high:
            raise QueryError(f"speeds must be positive and ascend, got {list(speeds)}")
        drawn: list[tuple[Path | Keyframes, float, float]] = []
        moved = []
        for motion in self.motions:
            path = motion.path
            found = next((draw for draw in drawn if draw[0] == path), None)
            if found is None:
                found = (path, rng.uniform(0.0, 1.0), rng.uniform(low, high))
                drawn.append(found)
            _, begin, speed = found
            cycle = None if isinstance(path, Keyframes) else path.cycle
            if cycle is not None:
                offset = motion.offset + begin * cycle
                motion = replace(motion, offset=offset, speed=speed * motion.speed)
            moved.append(motion)
        return replace(self, motions=moved)
