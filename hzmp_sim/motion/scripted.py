"""Prediction by script and MuJoCo's own dynamics: the geom is where the tape says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hzmp_planners._arrays import Bools, Floats
from hzmp_sim.motion.sweep import Sweep
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
                found[i] = self._pieces(i, a, z)
            else:
                found[i] = self._sweep.bounds[row, a:z].max(axis=0)
        found += self._growth
        found[self._away(found)] = -np.inf
        return found

    def slabs(self, start: float, step: float, count: int) -> Floats:
        begins: Floats = start + step * np.arange(count, dtype=np.float64)
        first, last = self._sweep.intervals(begins, begins + step)
        low, high = int(first[0]), int(last[-1])
        bounds = self._sweep.bounds[self._index, low:high]
        # Overlapping runs: from each first to its last, what lies between last and next is dropped.
        runs = np.column_stack([first, last]).ravel() - low
        padded = np.concatenate([bounds, bounds[:, -1:]], axis=1)
        found = np.maximum.reduceat(padded, runs, axis=1)[:, ::2].transpose(1, 0, 2)
        found = found + self._growth
        away = self._away(found)
        jumps = self._sweep.jumps[self._index, low:high]
        for i in np.flatnonzero(jumps.any(axis=1)).tolist():
            for k, (a, z) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
                if jumps[i, a - low : z - 1 - low].any():
                    found[k, i] = self._pieces(i, a, z) + self._growth[i]
                    away[k, i] = not np.isfinite(found[k, i]).all()
        found[away] = -np.inf
        return np.asarray(found)

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

    def _away(self, bounds: Floats) -> Bools:
        """Whether geoms with grown bounds (..., i, P) are of no concern, (..., i)."""
        return np.asarray((bounds <= self._least + 1e-9).any(axis=-1))

    def _pieces(self, i: int, first: int, last: int) -> Floats:
        """Bounds of a geom that jumps: of what is before and after, as far as it is of concern."""
        row = self.rows[i]
        bounds = self._sweep.bounds[row, first:last]
        ends = np.flatnonzero(self._sweep.jumps[row, first : last - 1]) + 1
        pieces = [piece.max(axis=0) for piece in np.split(bounds, ends)]
        grown = np.array(pieces) + self._growth[i]
        near = ~(grown <= self._least[i] + 1e-9).any(axis=1)
        return np.asarray(np.max(np.array(pieces)[near], axis=0, initial=-np.inf))
