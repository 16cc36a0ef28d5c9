"""Paths among static and moving obstacles, of which only those that are in the way are cut out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Plan, Planner
from hzmp_planners.sets import Polytope
from hzmp_sim.replanning.crossing import crossed

_ROUNDS = 4  # of cutting out what a path passes through, before all of it is cut out


@dataclass(frozen=True, eq=False)
class Route:
    """A path, and the free space that it is in."""

    plan: Plan
    space: FreeSpace

    @property
    def found(self) -> bool:
        """Whether there is a path."""
        return math.isfinite(self.plan.cost)


def route(
    space: FreeSpace,
    start: Floats,
    goal: Floats,
    moving: Sequence[Polytope | None] = (),
    known: Floats | None = None,
) -> Route | None:
    """A short path in the free space without what moves; None where start or goal is not free.

    Moving obstacles that the path does not meet are not cut out: the lower bound and the path are
    those of the space without all of them.

    Args:
        space: of the static obstacles.
        start: shape (n,) [m].
        goal: shape (n,) [m].
        moving: further obstacles.
        known: a path for similar ends, shape (k, n) [m].
    """
    chosen: set[int] = set()
    whole = space
    for attempt in range(_ROUNDS + 1):
        if chosen:
            cut = [hull for i, hull in enumerate(moving) if i in chosen and hull is not None]
            whole = space.with_obstacles(cut)
        try:
            planner = Planner(whole, start, goal, warm_start=known)
        except QueryError:
            return None
        plan = planner.first_path()
        if not math.isfinite(plan.cost):
            return Route(plan, whole)
        met, _ = crossed(plan.waypoints, moving)
        more = set(met) - chosen
        if not more:
            return Route(plan, whole)
        everything = {i for i, hull in enumerate(moving) if hull is not None}
        chosen = everything if attempt == _ROUNDS - 1 else chosen | more
    return None
