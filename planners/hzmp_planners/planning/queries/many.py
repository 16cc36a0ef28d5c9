"""Many queries on one free space."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import as_points
from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.paper.settings import PaperSettings
from hzmp_planners.planning.planner import plan
from hzmp_planners.planning.result import Plan


def plan_many(
    space: FreeSpace,
    starts: ArrayLike,
    goals: ArrayLike,
    time_limit: float = 1.0,
    gap: float = 1e-3,
    seed: int = 0,
    method: Literal["best", "paper"] | PaperSettings = "best",
) -> list[Plan]:
    """One plan for each pair of a start and a goal; what they share is prepared once.

    Args:
        space: the free space.
        starts: shape (m, n) [m]; one point (n,) is the start of all.
        goals: shape (m, n) [m]; one point (n,) is the goal of all.
        time_limit: of each query [s].
        gap: of each query, see `plan`.
        seed: of each query: every plan is the one that `plan` finds alone.
        method: see `plan`.

    Raises:
        QueryError: a start or goal is not in the free space (the message says which), the numbers
            of starts and goals do not fit each other, or a setting is out of range.
        ShapeError: the points are not finite points of dimension n.
    """
    s, g = as_points(starts, "starts", space.n), as_points(goals, "goals", space.n)
    if len(s) != len(g) and 1 not in (len(s), len(g)):
        raise QueryError(f"{len(s)} starts and {len(g)} goals: give as many, or one of a kind")
    s, g = np.broadcast_arrays(s, g)
    plans = []
    for number, (start, goal) in enumerate(zip(s, g, strict=True)):
        try:
            plans.append(plan(space, start, goal, time_limit, gap, seed, method))
        except QueryError as error:
            raise QueryError(f"query {number}: {error}") from error
    return plans
