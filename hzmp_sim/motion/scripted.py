"""Prediction by script and MuJoCo's own dynamics: the geom is where the tape says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.motion.sweep import Sweep
from hzmp_sim.motion.template import of_no_concern
from hzmp_sim.scene.scene import Scene


class Scripted:
    """A source for geoms that move as the tape of a sweep says.

    Args:
        scene: with the moving geoms.
        sweep: of all of them.
        rows: which of them this is for.
    """

    def __init__(self, scene: Scene, sweep: Sweep, rows: Sequence[int]) -> None:
        self.rows = tuple(rows)
        self._sweep, self._index = sweep, np.array(self.rows, dtype=np.int64)
        self._growth = sweep.template.growth[self._index]
        self._least = sweep.template.least[self._index]
        self._radius = np.array([scene.moving[row].radius for row in self.rows])

    def windows(self, start: Floats, end: Floats) -> Floats:
        first, last = self._sweep.intervals(start, end)
        found = np.empty(self._growth.shape)
        for i, (row, a, z) in enumerate(zip(self.rows, first.tolist(), last.tolist(), strict=True)):
            if self._sweep.jumps[row, a : z - 1].any():
                found[i] = self._sweep.bounds_of_jumper(row, a, z)
            else:
                found[i] = self._sweep.bounds[row, a:z].max(axis=0) + self._growth[i]
        found[of_no_concern(found, self._least)] = -np.inf
        return found

    def slabs(self, step: float, first: int, count: int) -> Floats:
        return self._sweep.slab_grid(step).slabs(first, count)[:, self._index]

    def way(self, start: Floats, end: Floats) -> Floats:
        first, last = self._sweep.intervals(start, end)
        turns, jumps = self._sweep.turns, self._sweep.jumps
        positions, found = self._sweep.tape.positions, np.zeros((len(self.rows), 3))
        for i, (row, a, z) in enumerate(zip(self.rows, first.tolist(), last.tolist(), strict=True)):
            if turns[row, z - 1] == turns[row, a] and not jumps[row, a:z].any():
                found[i] = positions[z, row] - positions[a, row]
        return found

    def across(self, start: Floats, end: Floats, normals: Floats) -> Floats:
        first, last = self._sweep.intervals(start, end)
        tape, points = self._sweep.tape, self._sweep.points
        found = np.empty(normals.shape[:2])
        for i, (row, a, z) in enumerate(zip(self.rows, first.tolist(), last.tolist(), strict=True)):
            centre = (tape.positions[a : z + 1, row] @ normals[i].T).max(axis=0)
            corners = (points[row] @ tape.axes[a, row].T @ normals[i].T).max(axis=0)
            off = float(self._sweep.deviation[row, a:z].max()) + self._radius[i]
            found[i] = centre + corners + off
        return found
