"""How one thing moves: positions, or the value of a joint or actuator, as functions of time.

A path gives a row of numbers for a time [s]: x, y, z of a body, then its yaw [rad] if it turns; or
one number, of a joint [m or rad] or an actuator.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from hzmp_planners.errors import QueryError
from hzmp_sim.motion.checks import boolean, number, position

Row = Sequence[float]

_STEP = 1e-5
"""Of the difference quotient of a callback [s]: wrong by this times half of its acceleration."""


class Path(Protocol):
    """A row of numbers for each time."""

    @property
    def width(self) -> int:
        """Numbers in a row: 1 (a value), 3 (a position) or 4 (a position and a yaw)."""
        ...

    @property
    def cycle(self) -> float | None:
        """Time after which it repeats itself [s]; None: never."""
        ...

    def at(self, t: float) -> Row:
        """The row at time t [s]."""
        ...

    def rate(self, t: float) -> float:
        """Derivative of the first number [1/s], from the right; 0 where it jumps."""
        ...


@dataclass(frozen=True, kw_only=True)
class Circle:
    """A body goes round a circle.

    Attributes:
        centre: of the circle [m].
        radius: [m], positive.
        period: time of one round [s]; negative: the other way round.
        phase: angle at time 0 [rad], from the x axis if the circle is level.
        axis: about which it turns.
        facing: the body turns about the vertical with its direction of travel, as if it pointed
            along x in the MJCF; only for a level circle.
    """

    centre: Row
    radius: float
    period: float
    phase: float = 0.0
    axis: Row = (0.0, 0.0, 1.0)
    facing: bool = False
    _frame: tuple[tuple[float, ...], ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        centre, axis = position("centre", self.centre), position("axis", self.axis)
        if number("radius", self.radius) <= 0.0:
            raise QueryError(f"radius must be positive, got {self.radius}")
        if number("period", self.period) == 0.0:
            raise QueryError("period must not be 0")
        number("phase", self.phase)
        boolean("facing", self.facing)
        length = math.sqrt(sum(x * x for x in axis))
        if length == 0.0:
            raise QueryError("axis must not be zero")
        unit = np.array(axis) / length
        level = abs(unit[2]) > 1.0 - 1e-9
        if self.facing and not level:
            raise QueryError(f"facing is for level circles, with axis 0 0 1, not {list(axis)}")
        # A level circle begins at the x axis; any other at the level direction that it contains.
        first = np.array([1.0, 0.0, 0.0]) if level else np.cross([0.0, 0.0, 1.0], unit)
        first = first / np.linalg.norm(first)
        second = np.cross(unit, first)
        frame = (centre, *(tuple((self.radius * v).tolist()) for v in (first, second)))
        object.__setattr__(self, "_frame", frame)

    @property
    def width(self) -> int:
        return 4 if self.facing else 3

    @property
    def cycle(self) -> float | None:
        return abs(self.period)

    def at(self, t: float) -> Row:
        angle = self.phase + 2.0 * math.pi * t / self.period
        c, s = math.cos(angle), math.sin(angle)
        row = [o + c * a + s * b for o, a, b in zip(*self._frame, strict=True)]
        if self.facing:
            way = (1.0 if self.period > 0.0 else -1.0) * (1.0 if self.axis[2] > 0.0 else -1.0)
            turned = angle if self.axis[2] > 0.0 else -angle
            row.append(turned + way * 0.5 * math.pi)
        return row

    def rate(self, t: float) -> float:
        angle = self.phase + 2.0 * math.pi * t / self.period
        _, a, b = self._frame
        speed = 2.0 * math.pi / self.period
        return speed * (b[0] * math.cos(angle) - a[0] * math.sin(angle))


@dataclass(frozen=True, kw_only=True)
class Swing:
    """A joint or actuator goes to and fro: middle + amplitude sin(2 pi t / period + phase).

    Attributes:
        amplitude: [rad] or [m], or of the actuator.
        period: [s], positive.
        phase: [rad].
        middle: value that it swings about.
    """

    amplitude: float
    period: float
    phase: float = 0.0
    middle: float = 0.0

    def __post_init__(self) -> None:
        for name in ("amplitude", "period", "phase", "middle"):
            number(name, getattr(self, name))
        if self.period <= 0.0:
            raise QueryError(f"period must be positive, got {self.period}")

    @property
    def width(self) -> int:
        return 1

    @property
    def cycle(self) -> float | None:
        return self.period

    def at(self, t: float) -> Row:
        angle = self.phase + 2.0 * math.pi * t / self.period
        return (self.middle + self.amplitude * math.sin(angle),)

    def rate(self, t: float) -> float:
        speed = 2.0 * math.pi / self.period
        return self.amplitude * speed * math.cos(self.phase + speed * t)


@dataclass(frozen=True)
class Callback:
    """A Python function of time; only in Python.

    Attributes:
        function: of the time [s]: position (3,) [m] of a body, or (position, quaternion wxyz), or
            the value of a joint or actuator. Called at any time, more than once: it must give the
            same for the same time.
    """

    function: Callable[[float], Any]

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise QueryError(f"a callback must be a function, got {self.function!r}")

    @property
    def width(self) -> int:
        return len(self.at(0.0))

    @property
    def cycle(self) -> float | None:
        return None

    def at(self, t: float) -> Row:
        """Value (1), position (3), or position and quaternion (7)."""
        found = self.function(t)
        if isinstance(found, tuple) and len(found) == 2 and np.size(found[0]) == 3:
            found = np.concatenate([np.ravel(part) for part in found])
        row: list[float] = np.atleast_1d(np.asarray(found, dtype=np.float64)).ravel().tolist()
        if len(row) not in (1, 3, 7) or not all(map(math.isfinite, row)):
            raise QueryError(
                f"the callback gave {found!r} at {t:g} s: it must give a finite value, a position "
                "of 3 coordinates, or a pair of position and quaternion"
            )
        return row

    def rate(self, t: float) -> float:
        return (self.at(t + _STEP)[0] - self.at(t)[0]) / _STEP
