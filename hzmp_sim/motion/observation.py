"""What is seen of moving geoms: where they are, and how fast they have been."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.scene.scene import Scene

_JUMP = 10.0  # [m/s] nothing that is slower jumps,
_LEAP = 5.0  # nor what is less than so many times as fast as before


@dataclass(frozen=True, eq=False)
class Observation:
    """The m moving geoms of a scene at one time."""

    time: float
    """[s]"""
    corners: Floats
    """Their points in the world, shape (m, V, 3) [m]."""
    velocity: Floats
    """Of these, the mean over the last `age` seconds, shape (m, V, 3) [m/s]."""
    age: float
    """Time since they were seen before [s]; 0 when they were not: they are taken to rest."""


class Observer:
    """Sees the moving geoms of a scene, again and again.

    Velocities are differences of positions: MuJoCo knows none of mocap bodies.

    Args:
        scene: with the geoms.
        points: of them in their frames, shape (m, V, 3) [m].
    """

    def __init__(self, scene: Scene, points: Floats) -> None:
        self._geoms = np.array([item.geom for item in scene.moving], dtype=np.int64)
        self._points = points
        self._last: Observation | None = None

    def see(self, data: mujoco.MjData, time: float) -> Observation:
        """What there is to see at a time [s]; `data` with up-to-date kinematics.

        The same time again gives the same.
        """
        last = self._last
        if last is not None and time <= last.time:
            return last
        axes = data.geom_xmat[self._geoms].reshape(-1, 3, 3)
        turned = self._points @ axes.transpose(0, 2, 1)
        corners = turned + data.geom_xpos[self._geoms][:, None, :]
        if last is None:
            self._last = Observation(time, corners, np.zeros_like(corners), 0.0)
            return self._last
        age = time - last.time
        velocity = (corners - last.corners) / age
        # What jumps goes on as it did before.
        speed, before = (
            np.linalg.norm(each, axis=2).max(axis=1) for each in (velocity, last.velocity)
        )
        jumps = speed > np.maximum(_JUMP, _LEAP * before)
        velocity = np.where(jumps[:, None, None], last.velocity, velocity)
        self._last = Observation(time, corners, velocity, age)
        return self._last
