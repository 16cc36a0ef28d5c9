"""Bounds of moving geoms over slabs of time that follow each other, each computed once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.motion.template import of_no_concern

if TYPE_CHECKING:
    from hzmp_sim.motion.sweep import Sweep


class SlabGrid:
    """Grown bounds in slabs of one length; the slab with number k begins at k steps.

    Args:
        sweep: of the geoms, m of them with P planes each.
        step: length of a slab [s].
    """

    def __init__(self, sweep: Sweep, step: float) -> None:
        self._sweep, self._step = sweep, step
        self._bounds = np.empty((64, *sweep.template.growth.shape))
        self._count = 0

    def slabs(self, first: int, count: int) -> Floats:
        """Bounds [m] in `count` slabs from `first` on, shape (count, m, P).

        -inf for a geom that is of no concern.
        """
        last = first + count
        if last > self._count:
            if last > len(self._bounds):
                more = np.empty((max(last, 2 * len(self._bounds)), *self._bounds.shape[1:]))
                more[: self._count] = self._bounds[: self._count]
                self._bounds = more
            self._bounds[self._count : last] = self._computed(self._count, last)
            self._count = last
        return self._bounds[first:last]

    def _computed(self, first: int, last: int) -> Floats:
        """The slabs from one number up to another."""
        sweep, growth = self._sweep, self._sweep.template.growth
        begins: Floats = self._step * np.arange(first, last, dtype=np.float64)
        begin, end = sweep.intervals(begins, begins + self._step)
        low, high = int(begin[0]), int(end[-1])
        bounds = sweep.bounds[:, low:high]
        # Overlapping runs: from each first to its last, what lies between last and next is dropped.
        runs = np.column_stack([begin, end]).ravel() - low
        padded = np.concatenate([bounds, bounds[:, -1:]], axis=1)
        found = np.maximum.reduceat(padded, runs, axis=1)[:, ::2].transpose(1, 0, 2)
        found = found + growth
        away = of_no_concern(found, sweep.template.least)
        jumps = sweep.jumps[:, low:high]
        for i in np.flatnonzero(jumps.any(axis=1)).tolist():
            for k, (a, z) in enumerate(zip(begin.tolist(), end.tolist(), strict=True)):
                if jumps[i, a - low : z - 1 - low].any():
                    found[k, i] = sweep.bounds_of_jumper(i, a, z)
                    away[k, i] = not np.isfinite(found[k, i]).all()
        found[away] = -np.inf
        return np.asarray(found)
