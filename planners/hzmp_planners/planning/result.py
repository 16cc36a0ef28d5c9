"""The result of planning: a path with its proof."""

from __future__ import annotations

import enum
import json
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hzmp_planners._arrays import Floats, Ints, finite
from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.certificate import Certificate
from hzmp_planners.planning.planar.certificate import CornerCertificate
from hzmp_planners.planning.prepared import prepared
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
        return relative_gap(self.cost, self.lower_bound)

    @property
    def informed(self) -> tuple[Ellipsotope, ...]:
        """The informed set at each improvement of the cost, in the order of `history`."""
        costs = dict.fromkeys(cost for _, cost, _ in self.history if math.isfinite(cost))
        return tuple(Ellipsotope.informed(self.start, self.goal, cost) for cost in costs)

    def cells(self, space: FreeSpace, count: int | None = None) -> list[Polytope]:
        """Convex free cells that hold the K segments: each leaf, grown across its shared faces.

        A grown cell contains its leaf and no obstacle's interior; consecutive cells overlap where
        there is room, which lets a trajectory cut its corners.

        Args:
            space: the free space that the plan was made in.
            count: of the first segments only, as many as there are; all when not given.

        Raises:
            QueryError: the count is negative.
        """
        path = self.leaves.tolist()
        if count is not None and count < 0:
            raise QueryError(f"count must not be negative, got {count}")
        first = path[:count]
        toward = [
            tuple(path[j] for j in (k - 1, k + 1) if 0 <= j < len(path)) for k in range(len(first))
        ]
        return prepared(space).grown(first, toward)

    def interpolated(self, spacing: float) -> tuple[Floats, Ints]:
        """The same path with more waypoints: neighbours are at most `spacing` [m] apart.

        Returns:
            Waypoints (M+1, n) [m], those of the plan among them, and the leaf of each segment (M,).

        Raises:
            QueryError: the spacing is not positive.
        """
        if not spacing > 0.0:
            raise QueryError(f"spacing must be positive [m], got {spacing}")
        lengths = np.linalg.norm(np.diff(self.waypoints, axis=0), axis=1)
        # A length of 1.2 at a spacing of 0.4 is three parts, whatever the round-off.
        parts = np.maximum(np.ceil(lengths / spacing * (1.0 - 1e-12)), 1.0).astype(np.int64)
        first = np.repeat(np.arange(len(parts)), parts)
        share = (np.arange(len(first)) - (np.cumsum(parts) - parts)[first]) / parts[first]
        legs = np.diff(self.waypoints, axis=0)
        points = self.waypoints[first] + share[:, None] * legs[first]
        return np.concatenate([points, self.waypoints[-1:]]), self.leaves[first]

    def as_dict(self) -> dict[str, Any]:
        """What `to_json` writes."""
        return {
            "status": self.status.name.lower(),
            "reason": self.status.value,
            "start": self.start.tolist(),
            "goal": self.goal.tolist(),
            "waypoints": self.waypoints.tolist(),
            "leaves": self.leaves.tolist(),
            "cost_m": finite(self.cost),
            "lower_bound_m": finite(self.lower_bound),
            "gap": finite(self.gap),
            "asked_gap": self.asked_gap,
            "history": [[finite(value) for value in row] for row in self.history],
        }

    def to_json(self, indent: int | None = None) -> str:
        """Path, bound and history as one JSON object; null for what is not a finite number.

        History rows are time since the call [s], cost [m], lower bound [m].
        """
        return json.dumps(self.as_dict(), indent=indent, allow_nan=False)


def is_closed(cost: float, bound: float, gap: float) -> bool:
    """Whether a cost is within the asked gap of a bound; False where neither is known."""
    return cost - bound <= gap * bound


def relative_gap(cost: float, bound: float) -> float:
    """(cost - bound) / bound; 0 where they are equal, inf without path or bound."""
    if cost == bound:
        return 0.0
    return math.inf if math.isinf(cost) or bound == 0.0 else (cost - bound) / bound


def path_length(waypoints: Floats) -> float:
    """Length of a polyline (k, n) [m]."""
    return float(np.linalg.norm(np.diff(waypoints, axis=0), axis=1).sum())
