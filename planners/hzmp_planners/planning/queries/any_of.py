"""The shortest path from any of several starts to any of several goals, which may be regions.

Branch and bound over pairs of a start and a target, the most promising one first. Where the free
space is convex, lengths of shortest paths differ by no more than the distance of their ends; so a
bound B for the way to one point x of a leaf proves B - |x - z| for any other point z of that leaf,
and for a target in it B less its farthest point from x. A target of some extent is cut in two until
that closes the gap.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from heapq import heappop, heappush
from itertools import count
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, as_point, as_points
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.planner import Planner
from hzmp_planners.planning.queries.targets import Target, entrances
from hzmp_planners.planning.result import Plan, PlanStatus, is_closed, relative_gap
from hzmp_planners.sets import Polytope

_SHARE = 0.3  # of the asked gap that is left to the plan for a target's centre
_SLICE = 0.05  # [s] for one target before others have their turn; twice as long each time
_ENDS = 4  # improvements of the end on its target
_STILL = 1e-7  # relative, of a path's length: moves of the end that do not matter


@dataclass(frozen=True, eq=False)
class Case:
    """What is known of the ways from one start to one target."""

    start: Floats
    """Shape (n,) [m]."""
    target: Target
    plan: Plan | None
    """To a point of the leaf that holds the target; None when the straight line says enough."""

    @cached_property
    def lower_bound(self) -> float:
        """No path from the start to the target is shorter [m]."""
        straight = float(np.linalg.norm(self.target.nearest(self.start) - self.start))
        if self.plan is None:
            return straight
        return max(straight, self.plan.lower_bound - self.target.farthest(self.plan.goal))


@dataclass(frozen=True, eq=False)
class Choice:
    """The best path of several queries, with a bound for all of them."""

    status: PlanStatus
    plan: Plan | None
    """The best path; its own lower bound is that of its own ends."""
    lower_bound: float
    """No path from any start to any goal is shorter [m]."""
    cases: tuple[Case, ...]
    """The ways from each start to each (part of a) goal: all of them together."""
    starts: Floats
    """Shape (k, n) [m]."""
    goals: tuple[Polytope | Floats, ...]
    """Regions, and points of shape (n,) [m]."""
    asked_gap: float
    """Gap at which planning was to stop; OPTIMAL means that it is reached."""
    space: FreeSpace = field(repr=False)
    """The free space that was planned in."""

    @property
    def gap(self) -> float:
        """(cost - lower_bound) / lower_bound; inf without a path or bound."""
        return relative_gap(math.inf if self.plan is None else self.plan.cost, self.lower_bound)


def plan_any(
    space: FreeSpace,
    starts: ArrayLike,
    goals: Polytope | ArrayLike | Sequence[Any],
    time_limit: float = 1.0,
    gap: float = 1e-3,
    seed: int = 0,
) -> Choice:
    """Shortest path from any of some starts to any of some goals, with one bound for all of them.

    Args:
        space: the free space.
        starts: one point (n,) or several (k, n) [m].
        goals: a point (n,), points (k, n), a polytope (it counts as reached where the path enters
            it; it may be flat, and may overlap obstacles), or a list of points and polytopes.
        time_limit: [s].
        gap: stop when (cost - lower_bound) / lower_bound is at most this.
        seed: of the random samples.

    Raises:
        QueryError: a start or goal point is not in the free space, a goal region has no free part,
            or a setting is out of range.
        ShapeError: a point has another dimension, or a region is empty or unbounded.
    """
    began = time.perf_counter()
    if not time_limit > 0.0:
        raise QueryError(f"time_limit must be positive [s], got {time_limit}")
    points = as_points(starts, "starts", space.n)
    if not len(points):
        raise QueryError("there must be at least one start")
    return _Search(space, points, _as_goals(goals, space.n), gap, seed).run(began, time_limit)


@dataclass(eq=False)
class _Open:
    """A case that is worked on."""

    case: Case
    planner: Planner | None = None
    slice: float = _SLICE
    """Time for its next turn [s]."""


class _Search:
    """Branch and bound over cases."""

    def __init__(
        self,
        space: FreeSpace,
        starts: Floats,
        goals: tuple[Polytope | Floats, ...],
        gap: float,
        seed: int,
    ) -> None:
        self._space, self._gap, self._seed = space, gap, seed
        self._best: Plan | None = None
        self._settled: list[Case] = []
        """Nothing is left to do about them."""
        self._numbers = count()
        self._queue: list[tuple[float, int, _Open]] = []
        self._starts, self._goals = starts, goals
        regions = [goal for goal in goals if isinstance(goal, Polytope)]
        targets: list[Target] = []
        for number, goal in enumerate(goals):
            entered = entrances(space, goal) if isinstance(goal, Polytope) else [Target(goal[None])]
            if not entered:
                raise QueryError(f"goal {number} is a region without a part in the free space")
            targets += entered
        for start in starts:
            arrived = any(region.contains(start)[0] for region in regions)
            for target in [Target(start[None])] if arrived else targets:
                self._push(_Open(Case(start, target, None)))

    def run(self, began: float, time_limit: float) -> Choice:
        """Work on the most promising case until none can matter, or the time is over."""
        left = began + time_limit - time.perf_counter()
        while self._queue and not self._closed and left > 0.0:
            self._advance(heappop(self._queue)[-1], left)
            left = began + time_limit - time.perf_counter()
        cases = (*self._settled, *(work.case for _, _, work in self._queue))
        best = self._best
        if best is None:
            open_ = math.isfinite(self._bound)
            status = PlanStatus.TIME_LIMIT if open_ else PlanStatus.INFEASIBLE
        else:
            status = PlanStatus.OPTIMAL if self._closed else PlanStatus.FEASIBLE
        bound = min(self._bound, self._cost)
        return Choice(status, best, bound, cases, self._starts, self._goals, self._gap, self._space)

    @property
    def _bound(self) -> float:
        """No path of any case is shorter [m]."""
        open_ = [self._queue[0][0]] if self._queue else []
        return min([*open_, *(case.lower_bound for case in self._settled)], default=math.inf)

    @property
    def _closed(self) -> bool:
        bound = self._bound
        return math.isinf(bound) or is_closed(self._cost, bound, self._gap)

    @property
    def _cost(self) -> float:
        return math.inf if self._best is None else self._best.cost

    def _push(self, work: _Open) -> None:
        heappush(self._queue, (work.case.lower_bound, next(self._numbers), work))

    def _advance(self, work: _Open, time_left: float) -> None:
        """Give the plan to the centre of a target its turn; divide the target when that is done."""
        case, target = work.case, work.case.target
        extent = target.farthest(target.centre)
        gap = self._gap * (_SHARE if extent > 0.0 else 1.0)
        if work.planner is None:
            work.planner = Planner(self._space, case.start, target.centre, gap=gap, seed=self._seed)
        cutoff = self._cost + extent
        plan = work.planner.solve(min(work.slice, time_left), cutoff)
        self._take(plan, target, time_left)
        known = Case(case.start, target, plan)
        if known.lower_bound > case.lower_bound:
            case = known
        if not work.planner.exhausted:
            self._push(_Open(case, work.planner, 2.0 * work.slice))
        elif extent > 0.0:
            for half in target.halves():
                self._push(_Open(Case(case.start, half, plan)))
        else:
            self._settled.append(case)

    def _take(self, plan: Plan, target: Target, time_left: float) -> None:
        """Take a path when it is the best; then move its end to where the target is nearer."""
        deadline = time.perf_counter() + time_left
        for _ in range(_ENDS):
            if plan.cost >= self._cost:
                return
            self._best = plan
            end = target.nearest(plan.waypoints[-2])
            time_left = min(_SLICE, deadline - time.perf_counter())
            if time_left <= 0.0 or math.dist(end, plan.goal) <= _STILL * plan.cost:
                return
            planner = Planner(self._space, plan.start, end, gap=self._gap, seed=self._seed)
            plan = planner.solve(time_left, self._cost)


def _as_goals(goals: Polytope | ArrayLike | Sequence[Any], n: int) -> tuple[Polytope | Floats, ...]:
    """Regions and points, checked.

    Raises:
        ShapeError: something is neither a point nor a bounded region of dimension n.
    """
    if isinstance(goals, Polytope):
        goals = [goals]
    if not isinstance(goals, Sequence) or not any(isinstance(goal, Polytope) for goal in goals):
        return tuple(as_points(cast(ArrayLike, goals), "goals", n))
    found: list[Polytope | Floats] = []
    for number, goal in enumerate(goals):
        if isinstance(goal, Polytope):
            if goal.n != n or goal.is_empty():
                state = "is empty" if goal.n == n else f"has dimension {goal.n}, the space {n}"
                raise ShapeError(f"goal {number} {state}")
            found.append(goal)
        else:
            found.append(as_point(goal, f"goal {number}", n))
    return tuple(found)
