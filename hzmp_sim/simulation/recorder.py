"""The rows of a flight log, as they come in."""

from __future__ import annotations

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.run import FlightLog

_FIRST = 4096  # rows that there is room for at first


class Recorder:
    """Collects one row a physics step; room is doubled when it is used up."""

    def __init__(self, model: mujoco.MjModel, body: int) -> None:
        self._body, self._dt = body, float(model.opt.timestep)
        self._splits = np.cumsum([model.nq, 7 * model.nmocap, 3, 4, model.nu, 3])
        self._states = np.empty((_FIRST, int(self._splits[-1]) + 1))
        self._geoms = np.empty((_FIRST, 2), dtype=np.int64)
        self._mocaps, self._count = model.nmocap, 0

    def add(
        self,
        data: mujoco.MjData,
        reference: list[float],
        clearance: float,
        nearest: int,
        contact: int,
    ) -> None:
        """A row: the state that `data` holds, and what was found in it."""
        row = self._count
        if row == len(self._states):
            self._states = np.concatenate([self._states, np.empty_like(self._states)])
            self._geoms = np.concatenate([self._geoms, np.empty_like(self._geoms)])
        body = self._body
        self._states[row] = np.concatenate(
            [
                *(data.qpos, data.mocap_pos.ravel(), data.mocap_quat.ravel()),
                *(data.xpos[body], data.xquat[body], data.ctrl, reference, (clearance,)),
            ]
        )
        self._geoms[row] = nearest, contact
        self._count += 1

    def log(self) -> FlightLog:
        """All rows."""
        states, geoms = self._states[: self._count], self._geoms[: self._count]
        parts = np.split(states, self._splits, axis=1)
        qpos, mocap, position, quaternion, control, reference, clearance = parts
        places, turns = np.split(mocap, [3 * self._mocaps], axis=1)
        shape = self._count, self._mocaps
        return FlightLog(
            time=self._dt * np.arange(self._count, dtype=np.float64),
            qpos=qpos,
            mocap=np.concatenate([places.reshape(*shape, 3), turns.reshape(*shape, 4)], axis=2),
            position=position,
            quaternion=quaternion,
            velocity=_rate(position, self._dt),
            reference=reference,
            control=control,
            clearance=clearance[:, 0],
            nearest=geoms[:, 0],
            contact=geoms[:, 1],
        )


def _rate(position: Floats, dt: float) -> Floats:
    """Velocity from positions by central differences, shape (T, 3)."""
    if len(position) < 2:
        return np.zeros_like(position)
    return np.asarray(np.gradient(position, dt, axis=0))
