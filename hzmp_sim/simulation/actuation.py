"""From a body in a compiled model to the controller that can steer it.

Everything the controller needs (mass, inertia, axes, gears, limits, motor lag) is read from the
model, so bundled bodies and a user's own go the same way.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

import mujoco
import numpy as np
from hzmp_planners._arrays import Floats
from hzmp_planners.errors import HzmpError, SceneError
from hzmp_tracking import Limits
from hzmp_tracking.controllers import (
    BodyState,
    Controller,
    PointController,
    QuadrotorController,
    Reference,
)

_VALID = (
    "valid are slide joints along world axes with one motor each, or a free joint with four "
    "site thrusts along the body's z axis"
)
_AXIS_TOL = 1e-6
_POINT_LIMITS = (2.0, 4.0, 30.0)  # [m/s, m/s^2, m/s^3] comfortable for a camera and a report
_QUADROTOR_LIMITS = (1.6, 2.6, 10.0)  # measured: rotors do not saturate, tracking within 3 cm
_FORCE_SHARE = 0.8  # of the actuators, for the reference; the rest is for feedback


class Actuation(ABC):
    """Reads the state of one body from `MjData` and writes its actuator inputs."""

    controller: Controller
    """The feedback law."""
    default_limits: Limits
    """Limits of a reference that this body follows closely."""

    def __init__(self, model: mujoco.MjModel, body: str) -> None:
        self._body = body
        self._id = model.body(body).id

    @abstractmethod
    def state(self, data: mujoco.MjData) -> BodyState:
        """Measured state of the body."""

    @abstractmethod
    def _write(self, data: mujoco.MjData, command: tuple[float, ...]) -> None: ...

    def apply(
        self,
        data: mujoco.MjData,
        position: Sequence[float],
        velocity: Sequence[float],
        acceleration: Sequence[float],
        jerk: Sequence[float],
    ) -> None:
        """Write `data.ctrl` so that the body follows the reference, each (3,) in the world.

        `data` must hold up-to-date kinematics (as after `mj_step` or `mj_forward`). Lists are
        faster than arrays.
        """
        reference = Reference(position, velocity, acceleration, jerk)
        self._write(data, self.controller.command(self.state(data), reference))


def actuation_for(model: mujoco.MjModel, body: str) -> Actuation:
    """The actuation of a body, by its joints.

    Raises:
        SceneError: no such body, or joints and actuators that no controller here can use.
    """
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, body)
    if index < 0:
        raise SceneError(f"the model has no body {body!r}")
    first, count = int(model.body_jntadr[index]), int(model.body_jntnum[index])
    kinds = [int(kind) for kind in model.jnt_type[first : first + count]] if count else []
    inside = [b for b in range(model.nbody) if _is_below(model, b, index)]
    if sum(int(model.body_dofnum[b]) for b in inside) > int(model.body_dofnum[index]):
        raise SceneError(f"body {body!r} carries moving parts: joints below it have no controller")
    if kinds and all(kind == mujoco.mjtJoint.mjJNT_SLIDE for kind in kinds):
        return SlideActuation(model, body)
    if kinds == [int(mujoco.mjtJoint.mjJNT_FREE)]:
        return QuadrotorActuation(model, body)
    names = [mujoco.mjtJoint(kind).name.removeprefix("mjJNT_").lower() for kind in kinds]
    has = f"joints of type {', '.join(names)}" if names else "no joint"
    raise SceneError(f"body {body!r} has {has}: {_VALID}")


class SlideActuation(Actuation):
    """A body on slide joints along world axes, each pushed by one motor."""

    def __init__(self, model: mujoco.MjModel, body: str) -> None:
        super().__init__(model, body)
        data = _at_rest(model)
        inertia = _mass_matrix(model, data)
        masses, limits, loads = [math.inf] * 3, [(0.0, 0.0)] * 3, [0.0] * 3
        self._slides: list[tuple[int, int, float, int, float]] = []
        first = int(model.body_jntadr[self._id])
        for joint in range(first, first + int(model.body_jntnum[self._id])):
            direction = data.xaxis[joint]
            axis = int(np.argmax(np.abs(direction)))
            sign = math.copysign(1.0, float(direction[axis]))
            if abs(direction[axis]) < 1.0 - _AXIS_TOL or masses[axis] != math.inf:
                raise SceneError(
                    f"slide joint {model.joint(joint).name!r} of body {body!r} points along "
                    f"{direction.tolist()}: each must have a world axis of its own"
                )
            dof = int(model.jnt_dofadr[joint])
            actuator, gain, (low, high) = _motor(model, body, joint)
            force = sorted((sign * gain * low, sign * gain * high))
            masses[axis], limits[axis] = float(inertia[dof, dof]), (force[0], force[1])
            # What stands still without moving: weight that nothing compensates, springs.
            loads[axis] = sign * float(data.qfrc_bias[dof] - data.qfrc_passive[dof])
            self._slides.append((axis, dof, sign, actuator, sign / gain))
        self.controller = PointController(masses, limits, loads)
        self.default_limits = _slide_limits(body, masses, limits, loads)

    def state(self, data: mujoco.MjData) -> BodyState:
        velocity = [0.0, 0.0, 0.0]
        for axis, dof, sign, _, _ in self._slides:
            velocity[axis] = sign * float(data.qvel[dof])
        return BodyState(data.xpos[self._id].tolist(), velocity)

    def _write(self, data: mujoco.MjData, command: tuple[float, ...]) -> None:
        for axis, _, _, actuator, per_newton in self._slides:
            data.ctrl[actuator] = command[axis] * per_newton


class QuadrotorActuation(Actuation):
    """A free body with four rotors that push along the body's z axis."""

    def __init__(self, model: mujoco.MjModel, body: str) -> None:
        super().__init__(model, body)
        joint = int(model.body_jntadr[self._id])
        self._qpos = int(model.jnt_qposadr[joint])
        self._dof = int(model.jnt_dofadr[joint])
        self._rotors = rotors = _rotors(model, body)
        data = _at_rest(model)
        mass, com, inertia = _rigid_body(model, data, self._dof)
        rotation = data.xmat[self._id].reshape(3, 3)
        allocation = np.zeros((4, 4))
        for k, rotor in enumerate(rotors):
            site = int(model.actuator_trnid[rotor, 0])
            frame = rotation.T @ data.site_xmat[site].reshape(3, 3)
            arm = rotation.T @ (data.site_xpos[site] - data.xpos[self._id]) - com
            force = frame @ model.actuator_gear[rotor, :3]
            if np.abs(force[:2]).max() > _AXIS_TOL * abs(force[2]) or force[2] == 0.0:
                raise SceneError(
                    f"actuator {model.actuator(rotor).name!r} of body {body!r} pushes along "
                    f"{force.tolist()} of the body: {_VALID}"
                )
            torque = frame @ model.actuator_gear[rotor, 3:] + np.cross(arm, force)
            gain = float(model.actuator_gainprm[rotor, 0])
            allocation[:, k] = gain * np.array([force[2], *torque])
        ranges = np.array([_range(model, rotor) for rotor in rotors])
        if not np.isfinite(ranges).all():
            raise SceneError(f"the rotors of body {body!r} need a ctrlrange: it bounds the thrust")
        lags = [_lag(model, rotor) for rotor in rotors]
        self._states = [int(model.actuator_actadr[rotor]) for rotor in rotors if lags[0] > 0.0]
        if max(lags) - min(lags) > 1e-9:
            raise SceneError(f"the rotors of body {body!r} have different lags {lags} s")
        try:
            self.controller = QuadrotorController(
                mass, inertia, allocation, (ranges[:, 0], ranges[:, 1]),
                motor_lag=lags[0], gravity=model.opt.gravity, centre_of_mass=com,
            )  # fmt: skip
        except HzmpError as error:
            raise SceneError(f"body {body!r} cannot be flown: {error}") from error
        self.default_limits = Limits(*_QUADROTOR_LIMITS)

    def state(self, data: mujoco.MjData) -> BodyState:
        q, v = self._qpos, self._dof
        pose = data.qpos[q : q + 7].tolist()
        twist = data.qvel[v : v + 6].tolist()
        thrusts = [data.act[k] for k in self._states]
        return BodyState(pose[:3], twist[:3], pose[3:], twist[3:], thrusts)

    def _write(self, data: mujoco.MjData, command: tuple[float, ...]) -> None:
        for rotor, value in zip(self._rotors, command, strict=True):
            data.ctrl[rotor] = value


def _is_below(model: mujoco.MjModel, body: int, ancestor: int) -> bool:
    while body > ancestor:
        body = int(model.body_parentid[body])
    return body == ancestor


def _at_rest(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def _mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> Floats:
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return matrix


def _rigid_body(
    model: mujoco.MjModel, data: mujoco.MjData, dof: int
) -> tuple[float, Floats, Floats]:
    """Mass, centre of mass (3,) and inertia about it (3, 3), in the body frame, with all parts.

    From the mass matrix of the free joint: [[m 1, -m R [c]], [.., I]] with I about the origin.
    """
    block = _mass_matrix(model, data)[dof : dof + 6, dof : dof + 6]
    mass = float(block[0, 0])
    rotation = data.xmat[int(model.dof_bodyid[dof])].reshape(3, 3)
    skew = -(rotation.T @ block[:3, 3:]) / mass
    com = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    shift = mass * (com @ com * np.eye(3) - np.outer(com, com))
    return mass, com, block[3:, 3:] - shift


def _motor(
    model: mujoco.MjModel, body: str, joint: int
) -> tuple[int, float, tuple[float, float]]:
    """The one motor of a slide joint: actuator id, newtons per unit of ctrl, range of ctrl."""
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    found = [
        k
        for k in range(model.nu)
        if int(model.actuator_trntype[k]) in kinds and int(model.actuator_trnid[k, 0]) == joint
    ]
    name = model.joint(joint).name
    if len(found) != 1 or not _is_direct(model, found[0]) or _lag(model, found[0]) != 0.0:
        what = [model.actuator(k).name for k in found] or "none"
        raise SceneError(
            f"slide joint {name!r} of body {body!r} has the actuators {what}: it needs one motor "
            "(fixed gain, no bias, no dynamics)"
        )
    actuator = found[0]
    gain = float(model.actuator_gear[actuator, 0] * model.actuator_gainprm[actuator, 0])
    if gain == 0.0:
        raise SceneError(f"the motor of slide joint {name!r} of body {body!r} has gear or gain 0")
    return actuator, gain, _range(model, actuator)


def _rotors(model: mujoco.MjModel, body: str) -> list[int]:
    """Actuator ids of the four site thrusts of a body (their sites may sit on welded parts)."""
    index = int(model.body(body).id)
    site_kind = int(mujoco.mjtTrn.mjTRN_SITE)
    rotors = [
        k
        for k in range(model.nu)
        if int(model.actuator_trntype[k]) == site_kind
        and _is_below(model, int(model.site_bodyid[model.actuator_trnid[k, 0]]), index)
    ]
    usable = [k for k in rotors if _is_direct(model, k) and int(model.actuator_trnid[k, 1]) < 0]
    if len(rotors) != 4 or len(usable) != 4:
        raise SceneError(
            f"body {body!r} has a free joint and {len(usable)} site thrusts with fixed gain and no "
            f"bias (of {len(rotors)} site actuators): {_VALID}"
        )
    return rotors


def _is_direct(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether force = gain * (ctrl or its first-order lag)."""
    return (
        int(model.actuator_gaintype[actuator]) == mujoco.mjtGain.mjGAIN_FIXED
        and int(model.actuator_biastype[actuator]) == mujoco.mjtBias.mjBIAS_NONE
        and int(model.actuator_dyntype[actuator])
        in (mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT)
    )


def _lag(model: mujoco.MjModel, actuator: int) -> float:
    """Time constant of the actuator [s]; 0 without dynamics."""
    if int(model.actuator_dyntype[actuator]) == mujoco.mjtDyn.mjDYN_NONE:
        return 0.0
    return float(model.actuator_dynprm[actuator, 0])


def _range(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    """Range of ctrl that acts: ctrlrange, and forcerange seen through the gain."""
    low, high = -math.inf, math.inf
    if model.actuator_ctrllimited[actuator]:
        low, high = (float(v) for v in model.actuator_ctrlrange[actuator])
    if model.actuator_forcelimited[actuator]:
        gain = float(model.actuator_gainprm[actuator, 0])
        ends = sorted(float(v) / gain for v in model.actuator_forcerange[actuator])
        low, high = max(low, ends[0]), min(high, ends[1])
    return low, high


def _slide_limits(
    body: str,
    masses: Sequence[float],
    limits: Sequence[tuple[float, float]],
    loads: Sequence[float],
) -> Limits:
    """Limits that leave a share of the motors' force to the feedback."""
    spare = [
        min(high - load, load - low) / mass
        for mass, (low, high), load in zip(masses, limits, loads, strict=True)
        if mass != math.inf
    ]
    if min(spare) <= 0.0:
        raise SceneError(
            f"the motors of body {body!r} are too weak: beyond the load {list(loads)} N on each "
            f"axis nothing of {list(limits)} N is left to accelerate"
        )
    velocity, acceleration, jerk = _POINT_LIMITS
    share = min(1.0, _FORCE_SHARE * min(spare) / acceleration)
    return Limits(velocity, share * acceleration, share * jerk)
