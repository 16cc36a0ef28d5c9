"""The result of planning: a path with its proof."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.free_space.grow import grow_leaves
from hzmp_planners.planning.certificate import Certificate
from hzmp_planners.planning.planar.certificate import CornerCertificate
from hzmp_planners.sets import Ellipsotope, Polytope


class PlanStatus(enum.Enum):
    """How planning ended; the value says what to do about it."""

    OPTIMAL = "the path is within the asked gap of the proved lower bound"
    FEASIBLE = "the asked gap was not proved: allow more time, or a larger gap"
    INFEASIBLE = "proved: start and goal lie in parts of the free space that nothing connects"
    TIME_LIMIT = "no path was found in time and none was excluded: allow more time"


@dataclass(frozen=True, eq=False)
class Plan:
    """A path through leaves, its length, and a proved lower bound of every path's length."""

    status: PlanStatus
    start: Floats
    """Shape (n,) [m]."""
    goal: Floats
    """Shape (n,) [m]."""
    waypoints: Floats
    """Shape (K+1, n) [m], start first and goal last; (0, n) without a path."""
    leaves: Ints
    """Leaf that holds each segment, shape (K,)."""
    cost: float
    """Length of the path [m]; inf without a path."""
    lower_bound: float
    """No path is shorter [m]; inf when infeasibility is proved."""
    asked_gap: float
    """Gap at which planning was to stop; OPTIMAL means that it is reached."""
    history: tuple[tuple[float, float, float], ...]
    """(time since the call [s], cost, lower bound) each time one of them improved."""
    samples: Floats
    """Points sampled on shared faces, shape (S, n) [m]."""
    space: FreeSpace = field(repr=False)
    """The free space that was planned in."""
    certificate: Certificate | CornerCertificate | None = field(repr=False)
    """What proves the lower bound; None when the straight line or the verdict does."""

    @property
    def gap(self) -> float:
        """(cost - lower_bound) / lower_bound; 0 for a proved verdict, inf without path or bound."""
        if self.status is PlanStatus.INFEASIBLE or self.cost == self.lower_bound:
            return 0.0
        if math.isinf(self.cost) or self.lower_bound == 0.0:
            return math.inf
        return (self.cost - self.lower_bound) / self.lower_bound

    @property
    def informed(self) -> tuple[Ellipsotope, ...]:
        """The informed set at each improvement of the cost, in the order of `history`."""
        costs = dict.fromkeys(cost for _, cost, _ in self.history if math.isfinite(cost))
        return tuple(Ellipsotope.informed(self.start, self.goal, cost) for cost in costs)

    def cells(self, space: FreeSpace) -> list[Polytope]:
        """Convex free cells that hold the K segments: each leaf, grown across its shared faces.

        A grown cell contains its leaf and no obstacle's interior; consecutive cells overlap where
        there is room, which lets a trajectory cut its corners.

        Args:
            space: the free space that the plan was made in.
        """
        path = self.leaves.tolist()
        toward = [[path[j] for j in (k - 1, k + 1) if 0 <= j < len(path)] for k in range(len(path))]
        return grow_leaves(space, path, toward)


def path_length(waypoints: Floats) -> float:
    """Length of a polyline (k, n) [m]."""
    return float(np.linalg.norm(np.diff(waypoints, axis=0), axis=1).sum())
