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

from hzmp_planners.errors import HzmpError, SceneError
from hzmp_sim.scene.bodies import descends
from hzmp_sim.scene.constants import MAX_TILT
from hzmp_sim.simulation.actuators import (
    VALID_BODIES,
    at_rest,
    control_range,
    lag,
    mass_matrix,
    rigid_body,
    site_thrusts,
    slide_motor,
)
from hzmp_tracking import Limits, RotorLimits
from hzmp_tracking.controllers import (
    REFERENCE_SHARE,
    BodyState,
    Controller,
    PointController,
    QuadrotorController,
    Reference,
    rotor_limits,
)

_AXIS_TOL = 1e-6
_POINT_LIMITS = (2.0, 4.0, 30.0)  # [m/s, m/s^2, m/s^3] comfortable for a camera and a report
_QUADROTOR_SPEED = 2.0  # [m/s] on each axis, as comfortable


class Actuation(ABC):
    """Reads the state of one body from `MjData` and writes its actuator inputs."""

    controller: Controller
    """The feedback law."""
    default_limits: Limits
    """Limits of a reference that this body follows closely."""
    actuators: tuple[int, ...]
    """That move the body."""
    rotors: RotorLimits | None = None
    """All that its rotors have, if it has some."""
    smoothing = 0.0
    """Window over which the reference of this body is smoothed [s], see `smooth_sample`."""

    def __init__(self, model: mujoco.MjModel, body: str) -> None:
        self._body = body
        self._id = model.body(body).id

    @abstractmethod
    def state(self, data: mujoco.MjData) -> BodyState:
        """State of the body; `data` must hold up-to-date kinematics (as after `mj_forward`)."""

    @abstractmethod
    def trim(self, data: mujoco.MjData) -> None:
        """Set inputs and actuator states to those of standing still where the body is."""

    @abstractmethod
    def _write(self, data: mujoco.MjData, command: tuple[float, ...]) -> None: ...

    def apply(
        self,
        data: mujoco.MjData,
        state: BodyState,
        position: Sequence[float],
        velocity: Sequence[float],
        acceleration: Sequence[float],
        jerk: Sequence[float],
        snap: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Write `data.ctrl` so that a body follows the reference, each (3,) in the world.

        To be called once a time step, after `trim` at the beginning.

        `state` is what is measured of it. Lists are faster than arrays.
        """
        reference = Reference(position, velocity, acceleration, jerk, snap)
        self._write(data, self.controller.command(state, reference))


def actuation_for(model: mujoco.MjModel, body: str, max_tilt: float | None = None) -> Actuation:
    """The actuation of a body, by its joints.

    Args:
        model: compiled, with the body in it.
        body: its name.
        max_tilt: largest tilt that a free body may take [rad]; `MAX_TILT` when None.

    Raises:
        SceneError: no such body, or joints and actuators that no controller here can use.
    """
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, body)
    if index < 0:
        raise SceneError(f"the model has no body {body!r}")
    first, count = int(model.body_jntadr[index]), int(model.body_jntnum[index])
    kinds = [int(kind) for kind in model.jnt_type[first : first + count]] if count else []
    inside = [b for b in range(model.nbody) if descends(model, b, index)]
    if sum(int(model.body_dofnum[b]) for b in inside) > int(model.body_dofnum[index]):
        raise SceneError(f"body {body!r} carries moving parts: joints below it have no controller")
    if kinds and all(kind == mujoco.mjtJoint.mjJNT_SLIDE for kind in kinds):
        return SlideActuation(model, body)
    if kinds == [int(mujoco.mjtJoint.mjJNT_FREE)]:
        return QuadrotorActuation(model, body, MAX_TILT if max_tilt is None else max_tilt)
    names = [mujoco.mjtJoint(kind).name.removeprefix("mjJNT_").lower() for kind in kinds]
    has = f"joints of type {', '.join(names)}" if names else "no joint"
    raise SceneError(f"body {body!r} has {has}: {VALID_BODIES}")


class SlideActuation(Actuation):
    """A body on slide joints along world axes, each pushed by one motor."""

    def __init__(self, model: mujoco.MjModel, body: str) -> None:
        super().__init__(model, body)
        data = at_rest(model)
        inertia = mass_matrix(model, data)
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
            actuator, gain, (low, high) = slide_motor(model, body, joint)
            force = sorted((sign * gain * low, sign * gain * high))
            masses[axis], limits[axis] = float(inertia[dof, dof]), (force[0], force[1])
            # What stands still without moving: weight that nothing compensates, springs.
            loads[axis] = sign * float(data.qfrc_bias[dof] - data.qfrc_passive[dof])
            self._slides.append((axis, dof, sign, actuator, sign / gain))
        self.actuators = tuple(actuator for *_, actuator, _ in self._slides)
        self._loads = tuple(loads)
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

    def trim(self, data: mujoco.MjData) -> None:
        self._write(data, self._loads)


class QuadrotorActuation(Actuation):
    """A free body with four rotors that push along the body's z axis."""

    def __init__(self, model: mujoco.MjModel, body: str, max_tilt: float) -> None:
        super().__init__(model, body)
        joint = int(model.body_jntadr[self._id])
        self._qpos = int(model.jnt_qposadr[joint])
        self._dof = int(model.jnt_dofadr[joint])
        self._motors = motors = site_thrusts(model, body)
        self.actuators = tuple(motors)
        data = at_rest(model)
        mass, com, inertia = rigid_body(model, data, self._dof)
        if model.dof_armature[self._dof : self._dof + 6].any():
            raise SceneError(
                f"the free joint of body {body!r} has armature, with which no rigid body moves: "
                "set it to 0"
            )
        # What gravity, as the world applies it (flags, gravcomp), asks the rotors to hold up.
        weight = (data.qfrc_bias - data.qfrc_passive)[self._dof : self._dof + 3]
        gravity = -weight / mass
        rotation = data.xmat[self._id].reshape(3, 3)
        allocation = np.zeros((4, 4))
        for k, rotor in enumerate(motors):
            site = int(model.actuator_trnid[rotor, 0])
            frame = rotation.T @ data.site_xmat[site].reshape(3, 3)
            arm = rotation.T @ (data.site_xpos[site] - data.xpos[self._id]) - com
            force = frame @ model.actuator_gear[rotor, :3]
            if np.abs(force[:2]).max() > _AXIS_TOL * abs(force[2]) or force[2] == 0.0:
                raise SceneError(
                    f"actuator {model.actuator(rotor).name!r} of body {body!r} pushes along "
                    f"{force.tolist()} of the body: {VALID_BODIES}"
                )
            torque = frame @ model.actuator_gear[rotor, 3:] + np.cross(arm, force)
            gain = float(model.actuator_gainprm[rotor, 0])
            allocation[:, k] = gain * np.array([force[2], *torque])
        ranges = np.array([control_range(model, rotor) for rotor in motors])
        if not np.isfinite(ranges).all():
            raise SceneError(f"the rotors of body {body!r} need a ctrlrange: it bounds the thrust")
        lags = [lag(model, rotor) for rotor in motors]
        self._states = [int(model.actuator_actadr[rotor]) for rotor in motors if lags[0] > 0.0]
        if max(lags) - min(lags) > 1e-9:
            raise SceneError(f"the rotors of body {body!r} have different lags {lags} s")
        limits = ranges[:, 0], ranges[:, 1]
        try:
            self.controller = QuadrotorController(
                mass, inertia, allocation, limits, motor_lag=lags[0], gravity=gravity,
                centre_of_mass=com, heading=math.atan2(rotation[1, 0], rotation[0, 0]),
                time_step=float(model.opt.timestep),
            )  # fmt: skip
            self.smoothing = self.controller.smoothing
            rotors = rotor_limits(
                mass, inertia, allocation, limits, gravity, max_tilt, self.smoothing
            )
        except HzmpError as error:
            raise SceneError(f"body {body!r} cannot be flown: {error}") from error
        self._hover = self.controller.hover
        self.rotors = rotors
        self.default_limits = rotors.scaled(REFERENCE_SHARE).limits(_QUADROTOR_SPEED)

    def state(self, data: mujoco.MjData) -> BodyState:
        q, v = self._qpos, self._dof
        pose = data.qpos[q : q + 7].tolist()
        twist = data.qvel[v : v + 6].tolist()
        return BodyState(pose[:3], twist[:3], pose[3:], twist[3:])

    def _write(self, data: mujoco.MjData, command: tuple[float, ...]) -> None:
        for rotor, value in zip(self._motors, command, strict=True):
            data.ctrl[rotor] = value

    def trim(self, data: mujoco.MjData) -> None:
        self.controller.reset()
        self._write(data, self._hover)
        if self._states:
            data.act[self._states] = self._hover


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
    share = min(1.0, REFERENCE_SHARE * min(spare) / acceleration)
    return Limits(velocity, share * acceleration, share * jerk)
