"""What moves, slab by slab of time, from the time on at which a decision takes effect."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.replanning.commitment import Commitment
from hzmp_sim.replanning.proof import Conflict, first_conflict

if TYPE_CHECKING:
    from hzmp_sim.motion.forecast import Forecast
    from hzmp_sim.motion.source import Slabs

_SLAB = 0.05  # [s]
_BLOCK = 40  # slabs that are predicted at a time


class Ahead:
    """Slabs of a prediction, made as far as they are asked for.

    Args:
        prediction: of what moves.
        start: from when on it matters [s].
        guard: how long a body at rest must be safe [s].
    """

    def __init__(self, prediction: Forecast, start: float, guard: float) -> None:
        self._start, self._guard, self._prediction = start, guard, prediction
        self._slabs = prediction.slabs(start, _SLAB, _BLOCK)

    def until(self, end: float) -> Slabs:
        """The slabs up to a time [s]."""
        count = max(1, math.ceil((end - self._slabs.start) / _SLAB - 1e-9))
        while len(self._slabs.b) < count:
            begin = self._slabs.start + _SLAB * len(self._slabs.b)
            more = self._prediction.slabs(begin, _SLAB, _BLOCK)
            self._slabs = replace(self._slabs, b=np.concatenate([self._slabs.b, more.b]))
        return replace(self._slabs, b=self._slabs.b[:count])

    def conflict(self, commitment: Commitment) -> Conflict | None:
        """Where a commitment is first not clear, until the guard after it has come to rest."""
        last = max(commitment.ends, self._start) + self._guard
        return first_conflict(commitment, self.until(last), self._start)

    def free(self, point: Floats, time: float) -> bool:
        """Whether the body could rest at a point (n,) for the guard from about a time on [s]."""
        slabs = self.until(time + self._guard)
        late = slabs.b[max(0, math.floor((time - slabs.start) / _SLAB)) :]
        return not bool((slabs.A @ point < late).all(axis=2).any())
