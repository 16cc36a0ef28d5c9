"""From a body in a compiled model to the controller that can steer it.

Everything the controller needs (mass, inertia, axes, gears, limits, motor lag) is read from the
model, so bundled bodies and a user's own go the same way.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from hzmp_planners.errors import HzmpError, SceneError
from hzmp_sim.scene.bodies import descends
from hzmp_sim.scene.constants import MAX_TILT
from hzmp_sim.simulation.actuation_base import Actuation
from hzmp_sim.simulation.actuators import (
    VALID_BODIES,
    at_rest,
    control_range,
    lag,
    rigid_body,
    site_thrusts,
)
from hzmp_sim.simulation.slide_actuation import SlideActuation
from hzmp_tracking.controllers import (
    REFERENCE_SHARE,
    BodyState,
    QuadrotorController,
    rotor_limits,
)

_AXIS_TOL = 1e-6
_QUADROTOR_SPEED = 2.0  # [m/s] on each axis, as comfortable


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
            law = QuadrotorController(
                mass, inertia, allocation, limits, motor_lag=lags[0], gravity=gravity,
                centre_of_mass=com, heading=math.atan2(rotation[1, 0], rotation[0, 0]),
                time_step=float(model.opt.timestep),
            )  # fmt: skip
            self.smoothing = law.smoothing
            rotors = rotor_limits(
                mass, inertia, allocation, limits, gravity, max_tilt, self.smoothing
            )
        except HzmpError as error:
            raise SceneError(f"body {body!r} cannot be flown: {error}") from error
        self.controller = self._law = law
        self._hover = law.hover
        self.rotors = rotors
        self.default_limits = rotors.scaled(REFERENCE_SHARE).limits(_QUADROTOR_SPEED)

    def state(self, data: mujoco.MjData) -> BodyState:
        q, v = self._qpos, self._dof
        pose = data.qpos[q : q + 7].tolist()
        twist = data.qvel[v : v + 6].tolist()
        return BodyState(pose[:3], twist[:3], pose[3:], twist[3:])

    def _write(self, data: mujoco.MjData, command: tuple[float, ...], state: BodyState) -> None:
        for rotor, value in zip(self._motors, command, strict=True):
            data.ctrl[rotor] = value

    def trim(self, data: mujoco.MjData) -> None:
        self._law.reset()
        self._write(data, self._hover, self.state(data))
        if self._states:
            data.act[self._states] = self._hover
