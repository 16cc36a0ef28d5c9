"""Where moving geoms will be: poses on a grid of times, recorded as far ahead as asked."""

from __future__ import annotations

import math

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.motion.shadow import Shadow
from hzmp_sim.scene.scene import Scene

GRID = 0.004
"""Time between two poses [s], to whole physics steps: a point at 4 m/s^2 is then never farther than
8 um from the chord between two of them."""


class Tape:
    """Poses of the moving geoms of a scene, as the script and MuJoCo's dynamics will have them.

    Unannounced motions are not on it.

    Args:
        scene: with `moving` geoms, m of them.

    Attributes:
        step: time between two poses [s].
    """

    def __init__(self, scene: Scene) -> None:
        self._shadow = Shadow(scene)
        self._geoms = np.array([item.geom for item in scene.moving], dtype=np.int64)
        timestep = float(scene.model.opt.timestep)
        self._stride = max(1, math.floor(GRID / timestep + 1e-9))
        self.step = self._stride * timestep
        self._positions = np.empty((64, len(self._geoms), 3))
        self._axes = np.empty((64, len(self._geoms), 3, 3))
        self._count = 0
        self._record()

    def __len__(self) -> int:
        """Poses that are recorded."""
        return self._count

    @property
    def positions(self) -> Floats:
        """Of the geoms, shape (K, m, 3) [m]."""
        return self._positions[: self._count]

    @property
    def axes(self) -> Floats:
        """Their axes as columns, shape (K, m, 3, 3)."""
        return self._axes[: self._count]

    def until(self, t: float) -> None:
        """Record as far as time t [s], at the least."""
        if t <= (self._count - 1) * self.step:
            return
        wanted = math.ceil(t / self.step) + 1
        while self._count < wanted:
            self._shadow.advance(self._stride)
            self._record()

    def at(self, t: float) -> tuple[Floats, Floats]:
        """Positions (m, 3) [m] and axes (m, 3, 3) at the recorded time nearest to t [s]."""
        self.until(t)
        k = max(0, round(t / self.step))
        return self._positions[k], self._axes[k]

    def _record(self) -> None:
        k = self._count
        if k == len(self._positions):
            self._positions = np.concatenate([self._positions, np.empty_like(self._positions)])
            self._axes = np.concatenate([self._axes, np.empty_like(self._axes)])
        data = self._shadow.data
        self._positions[k] = data.geom_xpos[self._geoms]
        self._axes[k] = data.geom_xmat[self._geoms].reshape(-1, 3, 3)
        self._count = k + 1
