"""The state of a world as a flight log, or its start, has it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco

from hzmp_sim.motion.drives import Drives

if TYPE_CHECKING:
    from hzmp_sim.run import FlightLog
    from hzmp_sim.scene import Scene


def pose_at_start(scene: Scene, data: mujoco.MjData) -> None:
    """Put everything where it is before the flight; kinematics are left to the caller."""
    data.qpos[:] = scene.initial_qpos
    Drives(scene.model, scene.motion).apply(data, 0.0)


def pose_at(log: FlightLog, row: int, data: mujoco.MjData) -> None:
    """Put everything where it was at a row of the log; kinematics are left to the caller."""
    data.qpos[:] = log.qpos[row]
    data.mocap_pos[:], data.mocap_quat[:] = log.mocap[row, :, :3], log.mocap[row, :, 3:]
