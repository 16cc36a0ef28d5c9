"""What a planner in the loop asks of whoever knows where things will be."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.motion.hulls import Hulls
from hzmp_sim.motion.source import Slabs

if TYPE_CHECKING:
    from hzmp_sim.motion.prediction import Broken


class Forecast(Protocol):
    """What is known at one time of g moving geoms; see `Prediction`."""

    @property
    def geoms(self) -> tuple[int, ...]:
        """Their ids."""
        ...

    def hulls(self, start: Floats, end: Floats) -> Hulls:
        """Where the centre could touch each geom at any time in a window of its own, (g,) [s]."""
        ...

    def boxes(self, start: Floats, end: Floats) -> Hulls:
        """The same, larger but of fewer facets."""
        ...

    def slabs(self, start: float, step: float, count: int) -> Slabs:
        """The same for slabs of time on a grid, from one that holds `start` or begins there."""
        ...

    def broken(self, data: mujoco.MjData, time: float) -> list[Broken]:
        """What is not where it was expected at a time [s]."""
        ...


class Forecaster(Protocol):
    """Makes forecasts, again and again."""

    def ready(self, data: mujoco.MjData, time: float) -> bool:
        """Whether enough was seen for a forecast; it looks at `data` at a time [s]."""
        ...

    def predict(self, data: mujoco.MjData, time: float) -> Forecast:
        """The forecast at a time [s], from what is seen in `data`."""
        ...


class NothingMoves:
    """The forecast, and its maker, of a world in which nothing moves; n is its dimension."""

    geoms: tuple[int, ...] = ()

    def __init__(self, n: int) -> None:
        self._n = n

    def ready(self, data: mujoco.MjData, time: float) -> bool:
        """See `Forecaster`."""
        del data, time
        return True

    def predict(self, data: mujoco.MjData, time: float) -> NothingMoves:
        """See `Forecaster`."""
        del data, time
        return self

    def hulls(self, start: Floats, end: Floats) -> Hulls:
        """See `Forecast`."""
        del start, end
        return Hulls.none(self._n)

    boxes = hulls

    def slabs(self, start: float, step: float, count: int) -> Slabs:
        """See `Forecast`."""
        return Slabs(np.zeros((0, 1, self._n)), np.zeros((count, 0, 1)), start, step)

    def broken(self, data: mujoco.MjData, time: float) -> list[Broken]:
        """See `Forecast`."""
        del data, time
        return []
