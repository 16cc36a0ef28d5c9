"""Over which time each moving obstacle is swept, when a path is planned among them.

A path knows no time. An obstacle is in the way of one where it will be when the body can first
come near it, and for a while from then on: `Sweeps` finds these times for a state of the body.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats

if TYPE_CHECKING:
    from hzmp_sim.motion.forecast import Forecast
    from hzmp_sim.motion.hulls import Hulls
    from hzmp_sim.motion.source import Slabs

_SWEPT = 0.8  # [s] for which an obstacle stays in the way of a path
_GRID = 0.2  # [s] of the times at which that begins and ends
_GRID_TOL = 1e-9
_LEAD = 0.3  # [s] of that, before an obstacle was met
_HALVINGS = 3  # of that time, where the body itself would be in what is swept


class Sweeps:
    """What the moving obstacles sweep while the body could meet them.

    Args:
        prediction: of the moving obstacles.
        slabs: of the same, from the time on at which the body is at `position`.
        position: of the centre, shape (n,) [m].
        speed: largest of the body [m/s].
        met: when the last trajectories would have met obstacles, by number [s].
    """

    def __init__(
        self,
        prediction: Forecast,
        slabs: Slabs,
        position: Floats,
        speed: float,
        met: Mapping[int, float],
    ) -> None:
        self._prediction, self._position = prediction, position
        if not slabs.b.size:
            self._begin, self._span = np.zeros(0), np.zeros(0)
            return
        # A facet's distance is at most that of the polytope.
        apart = (np.einsum("gfn,n->gf", slabs.A, position) - slabs.b).max(axis=2)
        reach = speed * slabs.step * np.arange(1, len(slabs.b) + 1)
        meets = apart <= reach[:, None]
        self._begin = slabs.start + slabs.step * meets.argmax(axis=0)
        latest = slabs.start + slabs.step * len(slabs.b)
        for number, time in met.items():
            if time < latest:
                self._begin[number] = max(self._begin[number], time - _LEAD)
        end = np.minimum(self._begin + _SWEPT, latest)
        # On a grid: what is swept is often the same as in the last decision.
        self._begin = _GRID * np.floor(self._begin / _GRID + _GRID_TOL)
        end = _GRID * np.ceil(end / _GRID - _GRID_TOL)
        self._span = np.where(meets.any(axis=0), np.maximum(end - self._begin, 0.0), 0.0)

    def around(self, goal: Floats, *, closely: bool) -> Hulls:
        """Convex sets for obstacles that could be met; they hold neither position nor goal (n,).

        An obstacle that does is looked at for a shorter time; if that does not help, it is left out
        as far as a path is concerned.

        Args:
            goal: shape (n,) [m].
            closely: hulls of more facets, not boxes.
        """
        shapes = self._prediction.hulls if closely else self._prediction.boxes
        swept, span = shapes(self._begin, self._begin + self._span), self._span
        swept = swept.without(span <= 0.0)
        for halving in range(_HALVINGS + 1):
            bad = swept.contain(self._position) | swept.contain(goal)
            if not bad.any():
                break
            if halving == _HALVINGS:
                return swept.without(bad)
            span = np.where(bad, 0.5 * span, span)
            swept = swept.replaced(bad, shapes(self._begin, self._begin + span))
        return swept
