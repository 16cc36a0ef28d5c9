"""Geometric tracking control of a quadrotor on SE(3)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import as_floats
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_tracking.controllers.base import BodyState, Reference
from hzmp_tracking.controllers.mixer import Mixer, Wrench
from hzmp_tracking.controllers.observer import DisturbanceObserver

Vector = tuple[float, float, float]

_MIN_THRUST_TO_WEIGHT = 1.2
_MAX_TILT = 1.0  # [rad] of the commanded thrust direction
_MOST_DISTURBANCE = 0.5  # of gravity: more is not held against
_MIN_LIFT = 0.3  # of the weight: the commanded thrust always points up


class QuadrotorController:
    r"""Lee, Leok, McClamroch, "Geometric tracking control of a quadrotor UAV on SE(3)", CDC 2010.

    Force :math:`F = m (a_r + 2 w (v_r - v) + w^2 (p_r - p) - g)` gives the wanted body z axis, the
    heading the rest; the attitude loop is :math:`\tau = J (-k_R e_R - k_\Omega e_\Omega) +
    \Omega \times J \Omega + J \dot\Omega_d` with wanted body rates from the reference's jerk, and
    their change from its snap (differential flatness, Mellinger and Kumar, ICRA 2011). Motor lag is
    compensated by lead: the command is the input that brings the first-order motor from its present
    thrust to the wanted one in `lead_time`; what cannot be reached by then is given up in the order
    of `Mixer`. The present thrust is that of a model of the motors, which needs no sensor and does
    not lag.

    What pushes besides the rotors (wind, or thrust that they lack) is estimated by a
    `DisturbanceObserver` from the measured velocity and the modelled thrust, and held against:
    no error stays. Saturated rotors do not mislead it, for it counts the thrust that they have.

    Args:
        mass: [kg].
        inertia: about the centre of mass, body axes, shape (3, 3) [kg m^2].
        allocation: shape (4, 4), see `Mixer`.
        thrust_limits: (low, high) of the rotors [N], each (4,).
        motor_lag: time constant of the rotor thrusts [s]; 0 for none.
        gravity: acceleration of free fall in the world, shape (3,) [m/s^2].
        centre_of_mass: in the body frame, shape (3,) [m]; what is steered along the reference is
            the origin of the body frame.
        heading: yaw angle to hold [rad].
        natural_frequency: w of the position loop [rad/s]; the attitude loop is four times as fast
            and the yaw loop as fast as the position loop.
        lead_time: [s].
        time_step: between two commands [s].
        observer_frequency: of the disturbance observer [rad/s]; 0 for none.

    Raises:
        ShapeError: a shape or an entry that is not finite.
        QueryError: thrust to weight below 1.2, rank of the allocation below 4, no gravity.
    """

    def __init__(
        self,
        mass: float,
        inertia: ArrayLike,
        allocation: ArrayLike,
        thrust_limits: tuple[ArrayLike, ArrayLike],
        motor_lag: float = 0.0,
        gravity: ArrayLike = (0.0, 0.0, -9.81),
        centre_of_mass: ArrayLike = (0.0, 0.0, 0.0),
        heading: float = 0.0,
        natural_frequency: float = 5.0,
        lead_time: float = 0.01,
        time_step: float = 0.002,
        observer_frequency: float = 15.0,
    ) -> None:
        J, com = as_floats(inertia, "inertia", 2), as_floats(centre_of_mass, "centre_of_mass", 1)
        low, high = (as_floats(limit, "thrust_limits", 1) for limit in thrust_limits)
        g = as_floats(gravity, "gravity", 1)
        for name, array, shape in (
            ("inertia", J, (3, 3)), ("centre_of_mass", com, (3,)), ("gravity", g, (3,)),
            ("thrust_limits", low, (4,)), ("thrust_limits", high, (4,)),
        ):  # fmt: skip
            if array.shape != shape:
                raise ShapeError(f"{name} must have shape {shape}, got {array.shape}")
        if not (mass > 0.0 and motor_lag >= 0.0 and natural_frequency > 0.0 and lead_time > 0.0):
            raise QueryError(
                "mass, natural_frequency and lead_time must be positive and motor_lag at least 0, "
                f"got {mass}, {natural_frequency}, {lead_time}, {motor_lag}"
            )
        weight = mass * float(np.linalg.norm(g))
        if weight == 0.0:
            raise QueryError("a quadrotor needs gravity to know which way is up, got zero")
        lift = float((np.asarray(allocation, dtype=np.float64)[0] * high).sum())
        if lift < _MIN_THRUST_TO_WEIGHT * weight:
            raise QueryError(
                f"thrust to weight is {lift / weight:.3g} ({lift:.3g} N for {weight:.3g} N); "
                f"at least {_MIN_THRUST_TO_WEIGHT} is needed to manoeuvre"
            )
        self._mixer = Mixer(allocation)
        self._mass, self._J = mass, J.tolist()
        self._g, self._com, self._g_norm = g.tolist(), com.tolist(), float(np.linalg.norm(g))
        self._low, self._high = low.tolist(), high.tolist()
        self._reach, self._follow = (
            1.0 - math.exp(-time / motor_lag) if motor_lag > 0.0 else 1.0
            for time in (lead_time, time_step)
        )
        self._lift = as_floats(allocation, "allocation", 2)[0].tolist()
        self._observer = DisturbanceObserver(
            observer_frequency, time_step, _MOST_DISTURBANCE * float(np.linalg.norm(g))
        )
        self._push = [0.0, 0.0, 0.0]
        self._heading = (math.cos(heading), math.sin(heading), 0.0)
        self._kp, self._kv = natural_frequency**2, 2.0 * natural_frequency
        fast, slow = 4.0 * natural_frequency, natural_frequency
        self._kR, self._kW = (fast**2, fast**2, slow**2), (2.0 * fast, 2.0 * fast, 2.0 * slow)
        self.smoothing = 1.0 / fast + motor_lag
        self.reset()

    def reset(self) -> None:
        """Rotors that carry the weight, and no disturbance known."""
        self._thrusts = list(self.hover)
        self._observer.reset()

    @property
    def hover(self) -> tuple[float, ...]:
        """Rotor thrusts that carry the weight [N]."""
        weight = self._mass * self._g_norm
        return self._mixer.allocate((weight, 0.0, 0.0, 0.0), self._low, self._high)

    def command(self, state: BodyState, reference: Reference) -> tuple[float, ...]:
        """Input of each of the four rotors [N]."""
        x_b, y_b, z_b = _axes(state.quaternion)
        rates = state.angular_velocity
        velocity = self._velocity(state, (x_b, y_b, z_b))
        lift = sum(c * t for c, t in zip(self._lift, self._thrusts, strict=True)) / self._mass
        pushed = [lift * z + g for z, g in zip(z_b, self._g, strict=True)]
        velocity, self._push = self._observer.update(velocity, pushed)
        force, x_d, y_d, z_d = self._attitude(velocity, state, reference)
        wanted, change = self._rates(velocity, reference, force, x_d, y_d, z_d)
        # e_R = vee(R_d' R - R' R_d) / 2; wanted rates seen from the body's own axes.
        errors = (
            0.5 * (_dot(z_d, y_b) - _dot(y_d, z_b)),
            0.5 * (_dot(x_d, z_b) - _dot(z_d, x_b)),
            0.5 * (_dot(y_d, x_b) - _dot(x_d, y_b)),
        )
        turn, faster = (
            [v[0] * x_d[i] + v[1] * y_d[i] + v[2] * z_d[i] for i in range(3)]
            for v in (wanted, change)
        )
        wanted = (_dot(x_b, turn), _dot(y_b, turn), _dot(z_b, turn))
        change = (_dot(x_b, faster), _dot(y_b, faster), _dot(z_b, faster))
        angular = [
            more - kR * e - kW * (rate - want)
            for kR, kW, e, rate, want, more in zip(
                self._kR, self._kW, errors, rates, wanted, change, strict=True
            )
        ]
        spin = _cross(rates, [_dot(row, rates) for row in self._J])
        torques = [_dot(row, angular) + s for row, s in zip(self._J, spin, strict=True)]
        wrench = (_dot(force, z_b), torques[0], torques[1], torques[2])
        return self._inputs(wrench)

    def _velocity(self, state: BodyState, axes: tuple[Vector, Vector, Vector]) -> list[float]:
        """Velocity of the centre of mass in the world [m/s]."""
        swing = _cross(state.angular_velocity, self._com)
        return [
            v + swing[0] * x + swing[1] * y + swing[2] * z
            for v, x, y, z in zip(state.velocity, *axes, strict=True)
        ]

    def _attitude(
        self, velocity: Sequence[float], state: BodyState, reference: Reference
    ) -> tuple[Vector, Vector, Vector, Vector]:
        """Wanted force [N] and body axes, in the world."""
        m, kp, kv = self._mass, self._kp, self._kv
        force = [
            m * (a + kv * (v_r - v) + kp * (p_r - p) - g - push)
            for a, v_r, v, p_r, p, g, push in zip(
                reference.acceleration, reference.velocity, velocity,
                reference.position, state.position, self._g, self._push, strict=True,
            )
        ]  # fmt: skip
        up = [-g / self._g_norm for g in self._g]
        lift = _dot(force, up)
        side = [f - lift * u for f, u in zip(force, up, strict=True)]
        lift = max(lift, _MIN_LIFT * m * self._g_norm)
        lateral = math.sqrt(_dot(side, side))
        shrink = min(1.0, lift * math.tan(_MAX_TILT) / lateral) if lateral > 0.0 else 1.0
        force = [lift * u + shrink * s for u, s in zip(up, side, strict=True)]
        z_d = _unit(force)
        y_d = _unit(_cross(z_d, self._heading))
        return (force[0], force[1], force[2]), _cross(y_d, z_d), y_d, z_d

    def _rates(
        self, velocity: Sequence[float], reference: Reference,
        force: Vector, x_d: Vector, y_d: Vector, z_d: Vector,
    ) -> tuple[Vector, Vector]:  # fmt: skip
        """Body rates of the wanted attitude [rad/s] and their change [rad/s^2], in its own axes.

        The force changes with m (j_r + w^2 (v_r - v)); its direction turns by the part across it.
        The rate about z keeps the y axis square to the heading. The change is that of the reference
        (its thrust grows by m j.z), without what feedback adds.
        """
        m = self._mass
        change = [
            m * (j + self._kp * (v_r - v))
            for j, v_r, v in zip(reference.jerk, reference.velocity, velocity, strict=True)
        ]
        size = math.sqrt(_dot(force, force))
        p, q = -_dot(change, y_d) / size, _dot(change, x_d) / size
        growth = 2.0 * m * _dot(reference.jerk, z_d)
        faster = (
            (-m * _dot(reference.snap, y_d) - growth * p) / size,
            (m * _dot(reference.snap, x_d) - growth * q) / size,
            0.0,
        )
        return (p, q, p * _dot(z_d, self._heading) / _dot(x_d, self._heading)), faster

    def _inputs(self, wrench: Wrench) -> tuple[float, ...]:
        """Motor inputs [N] that give the wrench after the lead time, as far as it is in reach."""
        reach, now = self._reach, self._thrusts
        low = [t + reach * (limit - t) for t, limit in zip(now, self._low, strict=True)]
        high = [t + reach * (limit - t) for t, limit in zip(now, self._high, strict=True)]
        wanted = self._mixer.allocate(wrench, low, high)
        inputs = tuple(t + (want - t) / reach for t, want in zip(now, wanted, strict=True))
        self._thrusts = [t + self._follow * (u - t) for t, u in zip(now, inputs, strict=True)]
        return inputs


def _axes(quaternion: Sequence[float]) -> tuple[Vector, Vector, Vector]:
    """Body axes in the world: the columns of the rotation matrix of a unit quaternion wxyz."""
    w, x, y, z = quaternion
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        (2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _unit(a: Sequence[float]) -> Vector:
    size = math.sqrt(_dot(a, a))
    return (a[0] / size, a[1] / size, a[2] / size)
