"""Kinematic limits of a trajectory."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, as_floats, frozen
from hzmp_planners.errors import QueryError, ShapeError

AXIS_LIMITS = ("velocity", "acceleration", "jerk")
"""Fields of `Limits` that bound each axis."""
NORM_LIMITS = ("speed", "total_acceleration", "total_jerk")
"""Fields of `Limits` that bound the Euclidean norm of the same derivatives."""


@dataclass(frozen=True, eq=False)
class Limits:
    """Symmetric bounds on each axis (a scalar holds for every axis), and on Euclidean norms.

    Raises:
        ShapeError: neither a scalar nor an array (n,) where an axis is bounded, not a scalar where
            a norm is, or not finite.
        QueryError: a bound that is not positive.
    """

    velocity: ArrayLike = 2.0
    """[m/s], scalar or (n,)."""
    acceleration: ArrayLike = 4.0
    """[m/s^2], scalar or (n,)."""
    jerk: ArrayLike = 30.0
    """[m/s^3], scalar or (n,)."""
    speed: float | None = None
    """Largest norm of the velocity [m/s]; None for no bound beside those of the axes."""
    total_acceleration: float | None = None
    """Largest norm of the acceleration [m/s^2], or None."""
    total_jerk: float | None = None
    """Largest norm of the jerk [m/s^3], or None."""

    def __post_init__(self) -> None:
        for name in chain(AXIS_LIMITS, NORM_LIMITS):
            held = getattr(self, name)
            if held is None and name in NORM_LIMITS:
                continue
            value = np.asarray(held)
            checked = as_floats(
                value, f"limit {name}", min(value.ndim, 1) if name in AXIS_LIMITS else 0
            )
            if (checked <= 0.0).any():
                raise QueryError(f"limit {name} must be positive, got {checked.tolist()}")
            object.__setattr__(self, name, float(checked) if checked.ndim == 0 else checked)

    def per_axis(self, n: int) -> tuple[Floats, Floats, Floats]:
        """Velocity, acceleration and jerk bounds of the axes as given, as arrays (n,).

        Raises:
            ShapeError: a limit was given for another number of axes.
        """
        values = []
        for name in AXIS_LIMITS:
            value = np.asarray(getattr(self, name), dtype=np.float64)
            if value.ndim == 1 and value.shape != (n,):
                raise ShapeError(f"limit {name} must be a scalar or have {n} entries, got {value}")
            values.append(frozen(np.broadcast_to(value, (n,)).copy()))
        return values[0], values[1], values[2]

    @property
    def norms(self) -> tuple[float, float, float]:
        """Bounds on the norms of velocity, acceleration and jerk; inf where there is none."""
        values = [getattr(self, name) for name in NORM_LIMITS]
        v, a, j = (math.inf if value is None else value for value in values)
        return v, a, j

    def boxes(self, n: int) -> tuple[Floats, Floats, Floats]:
        """What the axes are bounded by when the norms are counted in, each (n,): necessary only.

        Raises:
            ShapeError: a limit was given for another number of axes.
        """
        v, a, j = (
            np.minimum(axis, norm) for axis, norm in zip(self.per_axis(n), self.norms, strict=True)
        )
        return v, a, j

    def inner(self, n: int) -> Limits:
        """Bounds of the axes alone that keep the norms, too: an even box inside of them."""
        if not np.isfinite(self.norms).any():
            return self
        v, a, j = (
            np.minimum(axis, norm / math.sqrt(n))
            for axis, norm in zip(self.per_axis(n), self.norms, strict=True)
        )
        return Limits(v, a, j)

    def along(self, direction: Floats) -> tuple[float, float, float]:
        """Bounds of a motion on a straight line; `direction` has shape (n,) and unit length."""
        share = np.abs(direction)
        v, a, j = (
            min(norm, 1.0 / float((share / axis).max()))  # the tightest axis counts
            for axis, norm in zip(self.per_axis(direction.size), self.norms, strict=True)
        )
        return v, a, j

    def usage(self, peaks: tuple[Floats, Floats, Floats], norms: Floats) -> Floats:
        """Largest values as shares of the bounds, shape (3, n + 1): axes, then norms.

        Args:
            peaks: of |velocity|, |acceleration| and |jerk| on each axis, each (n,).
            norms: of the norms of the three, shape (3,). Without a bound the share is 0.
        """
        axes = np.array(peaks) / np.array(self.per_axis(peaks[0].size))
        return np.column_stack([axes, norms / np.array(self.norms)])

    def same_as(self, other: Limits, n: int) -> bool:
        """Whether both bound n axes, and norms, alike."""
        mine, others = (np.array(limits.per_axis(n)) for limits in (self, other))
        return np.array_equal(mine, others) and self.norms == other.norms
