"""Every path of every planner, checked once more: exactly, and with code that no planner uses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope

FREE_TOL = 1e-8
"""A path of ours this deep in an obstacle, relative to the workspace, touches it: round-off. Its
points are in closed leaves up to a tenth of this."""


@dataclass(frozen=True)
class Recheck:
    """What a path really is; all are lengths [m]."""

    length: float
    depth: float
    """How deep its deepest point is inside an obstacle or outside of the workspace; 0: free."""
    end_error: float
    """How far its ends are from start and goal."""

    def defects(self, claimed: float, size: float) -> list[str]:
        """What is wrong with a path of ours.

        Args:
            claimed: its length as the planner has it [m].
            size: largest side of the workspace [m].
        """
        tol = FREE_TOL * size
        found = []
        if self.depth > tol:
            found.append(f"path {self.depth:.3g} m inside an obstacle")
        if self.end_error > tol:
            found.append(f"path ends {self.end_error:.3g} m from start or goal")
        if abs(self.length - claimed) > tol:
            found.append(f"path is {self.length:.12g} m long, the plan says {claimed:.12g}")
        return found


def recheck(
    points: Sequence[Sequence[float]],
    obstacles: Sequence[Polytope],
    bounds: tuple[Floats, Floats],
    start: Floats,
    goal: Floats,
) -> Recheck:
    """Check a path through the points (K+1, n); touching an obstacle is allowed."""
    path = np.array(points, dtype=np.float64)
    outside = max(float((bounds[0] - path).max()), float((path - bounds[1]).max()))
    return Recheck(
        length=math.fsum(math.dist(a, b) for a, b in pairwise(path.tolist())),
        depth=max(0.0, outside, *(depth_in(path, block) for block in obstacles)),
        end_error=max(math.dist(path[0], start), math.dist(path[-1], goal)),
    )


def depth_in(path: Floats, block: Polytope) -> float:
    """How deep the deepest point of a polyline (K+1, n) is inside a convex polytope [m]; else 0.

    Along a segment p + t d each facet's distance b - A (p + t d) is affine in t, and the depth is
    the least of them: concave, so its maximum lies at an end, or where two of them cross.
    """
    lo, hi = block.interval_hull()
    p, q = path[:-1], path[1:]
    near = ((np.minimum(p, q) < hi) & (np.maximum(p, q) > lo)).all(axis=1)
    if not near.any():
        return 0.0
    at = block.b - p[near] @ block.A.T  # (k, facets)
    slope = (p[near] - q[near]) @ block.A.T
    one, two = np.array(list(combinations(range(len(block.b)), 2))).T
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = (at[:, two] - at[:, one]) / (slope[:, one] - slope[:, two])
    ends = np.tile([0.0, 1.0], (len(at), 1))
    t = np.clip(np.nan_to_num(np.hstack([ends, cross]), posinf=0.0, neginf=0.0), 0.0, 1.0)
    depth = (at[:, None, :] + t[:, :, None] * slope[:, None, :]).min(axis=2)
    return max(0.0, float(depth.max()))
