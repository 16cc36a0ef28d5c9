"""The widest body that still gets through: how much a body could grow before its goal is cut off.

For an extra radius r, of a ball that is added to the body's shape, the obstacles are grown by r and
the workspace is shrunk by r, and the free space is decomposed again. Growing is exact where facets
face each other; at edges and corners it is bracketed from both sides:

- moving every facet outwards by r gives at least the obstacle grown by a ball of radius r: when
  start and goal stay connected, a body larger by r is proved to get through;
- the hull of the corners moved by r in many directions gives at most that: when start and goal are
  cut off, a body larger by r is proved not to.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from hzmp_sim.scene.blame import connected
from hzmp_sim.scene.directions import round_normals
from hzmp_sim.scene.scene import Scene

RESOLUTION = 1e-3
"""The two bounds are brought this near to each other as far as growing allows [m]."""

TIME_LIMIT = 10.0
"""No further decomposition is begun after this [s]: the bounds stay where they are."""

_Grow = Callable[[Polytope, float], Polytope]


@dataclass(frozen=True)
class Passage:
    """How much wider the body could be, among the obstacles as they were read."""

    passes: float | None
    """Extra radius with which it is proved to get from start to goal [m]; None: not even with 0."""
    blocked: float
    """Extra radius, and any larger one, with which it is proved not to [m]."""


def widest_body(scene: Scene, space: FreeSpace) -> Passage:
    """Bracket the largest extra radius that leaves start and goal connected, by bisection.

    Args:
        scene: as read, grown by the shape and the clearance that it has.
        space: its free space.
    """
    began = time.perf_counter()
    if not connected(space, scene.start, scene.goal):
        return Passage(None, 0.0)
    most = float(0.5 * (scene.bounds[1] - scene.bounds[0]).min())  # then no room is left at all
    passes, fails = _bisect(scene, _facets_out, 0.0, most, began)
    if _passes(scene, _corners_out, passes + RESOLUTION):
        _, fails = _bisect(scene, _corners_out, passes + RESOLUTION, most, began)
    else:
        fails = passes + RESOLUTION
    return Passage(passes, fails)


def _bisect(
    scene: Scene, grow: _Grow, low: float, high: float, began: float
) -> tuple[float, float]:
    """Largest extra radius found to pass and smallest found not to, for one way of growing."""
    while high - low > RESOLUTION and time.perf_counter() - began < TIME_LIMIT:
        middle = 0.5 * (low + high)
        if _passes(scene, grow, middle):
            low = middle
        else:
            high = middle
    return low, high


def _passes(scene: Scene, grow: _Grow, extra: float) -> bool:
    low_end, high_end = scene.shape.extent
    low = np.maximum(scene.workspace[0] - low_end + extra, scene.bounds[0])
    high = np.minimum(scene.workspace[1] - high_end - extra, scene.bounds[1])
    ends = np.vstack([scene.start, scene.goal])
    if (low >= high).any() or (ends < low).any() or (ends > high).any():
        return False
    grown = [grow(obstacle, extra) for obstacle in scene.obstacles]
    if any(obstacle.violation(ends).min() < 0.0 for obstacle in grown):
        return False
    return connected(FreeSpace.decompose((low, high), grown), scene.start, scene.goal)


def _facets_out(obstacle: Polytope, extra: float) -> Polytope:
    return Polytope.from_halfspaces(obstacle.A, obstacle.b + extra)


def _corners_out(obstacle: Polytope, extra: float) -> Polytope:
    directions = np.vstack([obstacle.A, round_normals(obstacle.n)])
    corners = obstacle.vertices()[:, None, :] + extra * directions
    return Polytope.from_vertices(corners.reshape(-1, directions.shape[1]))
