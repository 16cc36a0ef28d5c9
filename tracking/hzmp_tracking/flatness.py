r"""What a trajectory asks of a rotorcraft, exactly, by differential flatness.

A body whose rotors push along its z axis has to turn this axis along :math:`f = a - g` (Mellinger
and Kumar, ICRA 2011). On a cubic piece f is linear in time, f = f0 + t j, so every extremum is in
closed form:

- thrust m |f| is convex: most at an end, least where f is nearest to zero;
- the tilt, the angle of f with the vertical, has one turning point;
- the body rates about x and y together are |f x j| / |f|^2, and f x j = f0 x j is constant on a
  piece: most where the thrust is least.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, as_point, frozen
from hzmp_planners.errors import QueryError
from hzmp_tracking.limits import Limits
from hzmp_tracking.trajectory import Trajectory

_EARTH = (0.0, 0.0, -9.81)


class RotorDemand(NamedTuple):
    """Extrema over all instants of what a trajectory asks."""

    least_thrust: float
    """Thrust over mass [m/s^2]."""
    most_thrust: float
    """Thrust over mass [m/s^2]."""
    tilt: float
    """Largest angle between thrust and vertical [rad]."""
    body_rate: float
    """Largest turn rate of the thrust direction [rad/s]; inf if the body falls freely."""


def rotor_demand(trajectory: Trajectory, gravity: ArrayLike = _EARTH) -> RotorDemand:
    """Exact extrema of thrust, tilt and body rate along a trajectory.

    Args:
        trajectory: of the centre of mass, in 3-D, or in 2-D at constant height.
        gravity: acceleration of free fall, shape (3,) [m/s^2].

    Raises:
        ShapeError: gravity is no finite array (3,).
        QueryError: no gravity: nothing is vertical.
    """
    fall = as_point(gravity, "gravity", 3)
    size = float(np.linalg.norm(fall))
    if size == 0.0:
        raise QueryError("without gravity nothing is vertical, so that no tilt is defined")
    up, h = -fall / size, trajectory.durations
    start = np.tile(-fall, (h.size, 1))
    jerk = np.zeros_like(start)
    start[:, : trajectory.n] += 2.0 * trajectory.coefficients[:, 2]
    jerk[:, : trajectory.n] = 6.0 * trajectory.coefficients[:, 3]
    end = start + h[:, None] * jerk

    nearest = _clipped(-_dot(start, jerk), _dot(jerk, jerk), h)
    least = np.linalg.norm(start + nearest[:, None] * jerk, axis=1)
    lift, climb = start @ up, jerk @ up
    turn = _clipped(
        lift * _dot(start, jerk) - climb * _dot(start, start),
        climb * _dot(start, jerk) - lift * _dot(jerk, jerk), h,
    )  # fmt: skip
    forces = np.stack([start, end, start + turn[:, None] * jerk])
    across = np.linalg.norm(np.cross(forces, up), axis=-1)
    spin = np.linalg.norm(np.cross(start, jerk), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.where(least > 0.0, spin / least**2, np.where(jerk.any(axis=1), np.inf, 0.0))
    return RotorDemand(
        float(least.min()),
        float(np.linalg.norm(forces[:2], axis=-1).max()),
        float(np.arctan2(across, forces @ up).max()),
        float(rate.max()),
    )


@dataclass(frozen=True, eq=False)
class RotorLimits:
    """What the rotors of a body can give, or the share of it that a reference may use.

    Raises:
        ShapeError: gravity is no finite array (3,).
        QueryError: the body cannot hover, or a bound that is not positive.
    """

    least_thrust: float
    """Of all rotors together, over the mass, at least 0 [m/s^2]."""
    most_thrust: float
    """The same at most [m/s^2]."""
    tilt: float
    """Between 0 and a right angle [rad]."""
    body_rate: float
    """About the body's x and y axes [rad/s]."""
    gravity: ArrayLike = _EARTH
    """Acceleration of free fall, shape (3,) [m/s^2]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "gravity", frozen(as_point(self.gravity, "gravity", 3).copy()))
        if not 0.0 <= self.least_thrust < self.fall < self.most_thrust < math.inf:
            raise QueryError(
                f"thrust over mass from {self.least_thrust:g} to {self.most_thrust:g} m/s^2 leaves "
                f"nothing on one side of hovering at {self.fall:g} m/s^2"
            )
        if not (0.0 < self.tilt < 0.5 * math.pi and 0.0 < self.body_rate < math.inf):
            raise QueryError(
                "tilt must lie between 0 and pi / 2 and body_rate be positive, got "
                f"{self.tilt} and {self.body_rate}"
            )

    @property
    def fall(self) -> float:
        """Size of the acceleration of free fall [m/s^2]."""
        return float(np.linalg.norm(np.asarray(self.gravity)))

    @property
    def acceleration(self) -> float:
        """Largest A such that an acceleration of norm A in any direction is within them [m/s^2].

        It tilts the thrust by at most asin(A / g) and keeps it within g - A and g + A.
        """
        g = self.fall
        return min(g * math.sin(self.tilt), g - self.least_thrust, self.most_thrust - g)

    def scaled(self, share: float) -> RotorLimits:
        """A share, above 0 and at most 1, of tilt, of thrust beyond hovering, and of body rate."""
        g = self.fall
        return RotorLimits(
            g - share * (g - self.least_thrust), g + share * (self.most_thrust - g),
            share * self.tilt, share * self.body_rate, self.gravity,
        )  # fmt: skip

    def limits(self, velocity: ArrayLike) -> Limits:
        """Kinematic limits within which no trajectory asks for more than this.

        A jerk of norm J turns the thrust by at most J / (g - A).

        Args:
            velocity: on each axis [m/s], a scalar or (n,); thrust does not depend on it.
        """
        a = self.acceleration
        j = self.body_rate * (self.fall - a)
        return Limits(velocity, a, j, total_acceleration=a, total_jerk=j)

    def usage(self, trajectory: Trajectory) -> RotorUsage:
        """What a trajectory of the centre of mass asks for, exactly, as shares of these limits."""
        demand, g = rotor_demand(trajectory, self.gravity), self.fall
        above = (demand.most_thrust - g) / (self.most_thrust - g)
        below = (g - demand.least_thrust) / (g - self.least_thrust)
        return RotorUsage(
            max(above, below, 0.0),
            demand.tilt / self.tilt,
            demand.body_rate / self.body_rate,
            demand,
        )


class RotorUsage(NamedTuple):
    """Shares of `RotorLimits` that are asked for: at most 1 where the rotors can give it."""

    thrust: float
    """Counted from hovering, up or down, whichever is more."""
    tilt: float
    body_rate: float
    demand: RotorDemand
    """What is asked for."""


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray((a * b).sum(axis=1))


def _clipped(numerator: Floats, denominator: Floats, h: Floats) -> Floats:
    """The quotient within [0, h]; 0 where it is not defined."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.asarray(np.clip(np.nan_to_num(numerator / denominator, nan=0.0), 0.0, h))
