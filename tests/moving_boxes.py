"""Boxes that move with constant velocity or to and fro, and their exact prediction."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.motion.hulls import Hulls
from hzmp_sim.motion.prediction import Broken
from hzmp_sim.motion.source import Slabs


@dataclass(frozen=True)
class MovingBoxes:
    """Boxes about centre + swing sin(2 pi t / period), or centre + velocity t.

    Arrays have a row for each box. It is a `Prediction` of itself.
    """

    centres: Floats
    halves: Floats
    velocities: Floats
    periods: Floats | None = None

    @property
    def geoms(self) -> tuple[int, ...]:
        return tuple(range(len(self.centres)))

    def places(self, times: Floats) -> Floats:
        """Centres at times (k,), shape (k, boxes, n)."""
        t = np.asarray(times)[:, None, None]
        if self.periods is None:
            return self.centres + t * self.velocities
        rate = 2.0 * np.pi / self.periods[:, None]
        return self.centres + self.velocities / rate * np.sin(rate * t)

    def hulls(self, start: Floats, end: Floats) -> Hulls:
        b = []
        for i, (begin, last) in enumerate(zip(start, end, strict=True)):
            low, high = self._bounds(np.linspace(begin, last, 12))
            b.append(np.concatenate([high[i], -low[i]]))
        return Hulls(self._normals, np.array(b))

    boxes = hulls

    def slabs(self, start: float, step: float, count: int) -> Slabs:
        rows = []
        for k in range(count):
            low, high = self._bounds(np.linspace(start + k * step, start + (k + 1) * step, 5))
            rows.append(np.concatenate([high, -low], axis=1))
        return Slabs(self._normals, np.array(rows), start, step)

    def broken(self, data: mujoco.MjData, time: float) -> list[Broken]:
        del data, time
        return []

    @property
    def _normals(self) -> Floats:
        """Of the boxes, (boxes, 2 n, n)."""
        n = self.centres.shape[1]
        return np.broadcast_to(np.vstack([np.eye(n), -np.eye(n)]), (len(self.centres), 2 * n, n))

    def _bounds(self, times: Floats) -> tuple[Floats, Floats]:
        places = self.places(times)
        # Half a step at the largest speed on each axis covers what lies between the times.
        gap = 0.5 * np.abs(self.velocities) * (times[-1] - times[0]) / (len(times) - 1)
        margin = self.halves + gap
        return places.min(axis=0) - margin, places.max(axis=0) + margin
