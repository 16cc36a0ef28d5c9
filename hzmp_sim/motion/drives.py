"""A motion script moves the bodies of a world."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.motion.script import Motion, MotionScript

_Write = Callable[[mujoco.MjData, float], None]


class Drives:
    """Sets poses of mocap bodies, joints and actuator inputs to what a script says.

    Args:
        model: compiled, with everything that the script names.
        script: of its motions; None: nothing is driven.
        announced: only the motions that are (True) or are not (False) announced; None: all.
    """

    def __init__(
        self, model: mujoco.MjModel, script: MotionScript | None, announced: bool | None = None
    ) -> None:
        motions = script.motions if script is not None else ()
        self.motions = tuple(m for m in motions if announced in (None, m.announced))
        writers = {"body": _body_writer, "joint": _joint_writer, "actuator": _actuator_writer}
        self._writes = [writers[motion.kind](model, motion) for motion in self.motions]

    def apply(self, data: mujoco.MjData, t: float) -> None:
        """Put everything where it is at simulated time t [s].

        To be called when `data` stands at t, before its kinematics are computed: after `mj_step`,
        before `mj_fwdPosition`.
        """
        for write in self._writes:
            write(data, t)


def _body_writer(model: mujoco.MjModel, motion: Motion) -> _Write:
    body = model.body(motion.name).id
    mocap, stands, at = int(model.body_mocapid[body]), np.array(model.body_quat[body]), motion.at

    def write(data: mujoco.MjData, t: float) -> None:
        row = at(t)
        data.mocap_pos[mocap] = row[:3]
        if len(row) == 4:
            data.mocap_quat[mocap] = _yawed(stands, row[3])
        elif len(row) == 7:
            data.mocap_quat[mocap] = row[3:]

    return write


def _joint_writer(model: mujoco.MjModel, motion: Motion) -> _Write:
    joint = model.joint(motion.name).id
    q, v = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    at, rate = motion.at, motion.rate

    def write(data: mujoco.MjData, t: float) -> None:
        data.qpos[q] = at(t)[0]
        data.qvel[v] = rate(t)

    return write


def _actuator_writer(model: mujoco.MjModel, motion: Motion) -> _Write:
    actuator, at = model.actuator(motion.name).id, motion.at

    def write(data: mujoco.MjData, t: float) -> None:
        data.ctrl[actuator] = at(t)[0]

    return write


def _yawed(stands: Floats, yaw: float) -> Floats:
    """A quaternion (4,) turned about the vertical by `yaw` [rad]."""
    c, s = np.cos(0.5 * yaw), np.sin(0.5 * yaw)
    w, x, y, z = stands
    return np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])


def driven_joints(model: mujoco.MjModel, script: MotionScript | None) -> list[int]:
    """Ids of the joints whose positions a script sets."""
    motions = script.motions if script is not None else ()
    return [int(model.joint(m.name).id) for m in motions if m.kind == "joint"]
