"""From one place to the next at given times; places that a world names are keyframes."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

from hzmp_planners.errors import QueryError
from hzmp_sim.motion.checks import boolean, items, numbers, position
from hzmp_sim.motion.paths import Row

Repeat = Literal["once", "loop", "bounce"]

_REPEATS = ("once", "loop", "bounce")


@dataclass(frozen=True, kw_only=True)
class Waypoints:
    """From one place to the next, straight; two equal times are a jump.

    Attributes:
        times: at which it is there [s], ascending, at least one.
        positions: of a body, (k, 3) [m].
        values: of a joint or an actuator, (k,); in place of positions.
        yaws: turns of a body about the vertical [rad], (k,), on top of how it stands in the MJCF.
        repeat: once: it stays where it ends; loop: it begins again; bounce: it goes back and forth.
        smooth: it comes to rest at each waypoint, without a jump of its acceleration (quintic
            blend); else its velocity jumps there.
    """

    times: Row
    positions: Sequence[Row] | None = None
    values: Row | None = None
    yaws: Row | None = None
    repeat: Repeat = "once"
    smooth: bool = False
    _times: tuple[float, ...] = field(init=False, repr=False, compare=False)
    _rows: tuple[tuple[float, ...], ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        times = numbers("times", self.times)
        if (self.positions is None) == (self.values is None):
            raise QueryError("waypoints need either positions (of a body) or values (else)")
        if self.positions is not None:
            rows = [position("positions", row) for row in items("positions", self.positions)]
        else:
            rows = [(value,) for value in numbers("values", self.values)]
        if self.yaws is not None:
            if self.positions is None:
                raise QueryError("yaws are for positions of a body, not for values")
            yaws = numbers("yaws", self.yaws)
            if len(yaws) != len(rows):
                raise QueryError(f"{len(rows)} positions have {len(yaws)} yaws: give one for each")
            rows = [(*row, yaw) for row, yaw in zip(rows, yaws, strict=True)]
        if not times or len(times) != len(rows):
            raise QueryError(
                f"{len(times)} times for {len(rows)} waypoints: give one for each, at least one"
            )
        for before, after in pairwise(times):
            if after < before:
                raise QueryError(f"times must ascend, but {after:g} comes after {before:g}")
        if self.repeat not in _REPEATS:
            raise QueryError(f"repeat must be one of {', '.join(_REPEATS)}, got {self.repeat!r}")
        if self.repeat != "once" and times[-1] <= times[0]:
            raise QueryError(f"repeat = {self.repeat!r} needs times that differ")
        boolean("smooth", self.smooth)
        object.__setattr__(self, "_times", times)
        object.__setattr__(self, "_rows", tuple(rows))

    @property
    def width(self) -> int:
        return len(self._rows[0])

    @property
    def cycle(self) -> float | None:
        span = self._times[-1] - self._times[0]
        return {"once": None, "loop": span, "bounce": 2.0 * span}[self.repeat]

    def at(self, t: float) -> Row:
        t, _ = self._folded(t)
        k = bisect_right(self._times, t)
        if k == 0 or k == len(self._times):
            return self._rows[min(k, len(self._rows) - 1)]
        begin, end = self._times[k - 1], self._times[k]
        s = (t - begin) / (end - begin)
        if self.smooth:
            s = s * s * s * (10.0 + s * (6.0 * s - 15.0))
        one, two = self._rows[k - 1], self._rows[k]
        return [a + s * (b - a) for a, b in zip(one, two, strict=True)]

    def rate(self, t: float) -> float:
        t, sign = self._folded(t)
        k = bisect_right(self._times, t)
        if k == 0 or k == len(self._times):
            return 0.0
        begin, end = self._times[k - 1], self._times[k]
        slope = (self._rows[k][0] - self._rows[k - 1][0]) / (end - begin)
        if self.smooth:
            s = (t - begin) / (end - begin)
            slope *= 30.0 * (s * (1.0 - s)) ** 2
        return sign * slope

    def _folded(self, t: float) -> tuple[float, float]:
        """The time between the first and the last one that t stands for; -1.0 on the way back."""
        first, last = self._times[0], self._times[-1]
        if self.repeat == "once":
            return t, 1.0
        span = last - first
        if self.repeat == "loop":
            return first + (t - first) % span, 1.0
        t = (t - first) % (2.0 * span)
        return (first + t, 1.0) if t <= span else (first + 2.0 * span - t, -1.0)


@dataclass(frozen=True, kw_only=True)
class Keyframes:
    """From one keyframe of the MJCF to the next: waypoints that the world names.

    Attributes:
        names: of keyframes.
        times: at which it is there [s]; default: those of the keyframes.
        repeat: as of waypoints.
        smooth: as of waypoints.
    """

    names: Sequence[str]
    times: Row | None = None
    repeat: Repeat = "once"
    smooth: bool = False

    def __post_init__(self) -> None:
        names = items("names", self.names)
        if not names or not all(isinstance(name, str) for name in names):
            raise QueryError("names must be names of keyframes of the MJCF, at least one")
        if self.repeat not in _REPEATS:
            raise QueryError(f"repeat must be one of {', '.join(_REPEATS)}, got {self.repeat!r}")
        boolean("smooth", self.smooth)
        if self.times is not None and len(numbers("times", self.times)) != len(names):
            raise QueryError(f"{len(names)} keyframes have {len(self.times)} times")
