"""HZ-MP: plan a shortest path through the leaves of a hybrid zonotope, with a proof."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, Ints, as_point, as_points, frozen
from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.attempt import Attempt, Improvement, Veto
from hzmp_planners.planning.clock import no_collection
from hzmp_planners.planning.paper.settings import PaperSettings
from hzmp_planners.planning.result import Plan
from hzmp_planners.planning.roadmap import Query
from hzmp_planners.planning.strategy import offer_at_once, steps

_END = object()


class Planner:
    """Finds the shortest path of one query, and can go on where it stopped.

    In the plane the path is found exactly (`planar`). In 3-D, HZ-MP: search over points sampled on
    shared faces and refine the best face sequences exactly (`explore`); then, on what lies inside
    the informed ellipsotope of the best cost, prove a lower bound (`prove`).

    Args:
        space: the free space. What a query prepares in it serves the next ones, too.
        start: shape (n,) [m].
        goal: shape (n,) [m].
        gap: there is nothing left to do when (cost - lower_bound) / lower_bound is at most this.
        seed: of the random samples.
        method: "paper", or its settings, runs the HZ-MP paper's own algorithm instead
            (`planning.paper`).
        warm_start: an earlier plan, of this or another free space, or a polyline (k, n) [m]. With
            its ends replaced by start and goal it is the first path, where that is free.
        veto: is asked about each segment, from p (n,) to q (n,), of every path before the path is
            taken; True forbids it. The lower bound does not know of it.
        on_improvement: is called with every shorter path and every higher bound.

    Raises:
        QueryError: start or goal is not in the free space, or a setting is out of range.
        ShapeError: start or goal is not a finite point of dimension n.
    """

    def __init__(
        self,
        space: FreeSpace,
        start: ArrayLike,
        goal: ArrayLike,
        *,
        gap: float = 1e-3,
        seed: int = 0,
        method: Literal["best", "paper"] | PaperSettings = "best",
        warm_start: Plan | ArrayLike | None = None,
        veto: Veto | None = None,
        on_improvement: Callable[[Improvement], None] | None = None,
    ) -> None:
        self._began: float | None = time.perf_counter()
        if not 0.0 <= gap < math.inf:
            raise QueryError(f"gap must be a finite ratio of at least 0, got {gap}")
        if not isinstance(seed, (int, np.integer)) or seed < 0:
            raise QueryError(f"seed must be a whole number of at least 0, got {seed!r}")
        if not isinstance(method, PaperSettings) and method not in ("best", "paper"):
            raise QueryError(f'method must be "best", "paper" or PaperSettings, got {method!r}')
        if veto is not None and method != "best":
            raise QueryError('a veto needs method="best": the paper\'s own knows none')
        s, g = as_point(start, "start", space.n), as_point(goal, "goal", space.n)
        query = Query(s, g, _located(space, s, "start"), _located(space, g, "goal"))
        self._space, self._gap = space, gap
        self._attempt = Attempt(space.graph, query, gap=gap, veto=veto, report=on_improvement)
        old = warm_start.waypoints if isinstance(warm_start, Plan) else warm_start
        self._known = None if old is None else as_points(old, "warm_start", space.n)
        paper = PaperSettings() if method == "paper" else method
        self._paper = isinstance(paper, PaperSettings)
        self._steps = steps(self._attempt, space, self._known, paper, int(seed))
        self._exhausted = False

    @property
    def exhausted(self) -> bool:
        """Whether nothing is left to do: `solve` would return the same again."""
        return self._exhausted or self._attempt.closed

    def solve(self, time_limit: float = 1.0, cutoff: float = math.inf) -> Plan:
        """The best path and bound after some more time, or when nothing is left to do.

        Args:
            time_limit: of this call [s]. The first one includes setting up. It is kept within 5 ms
                or 5 %, whichever is more, once the space has its leaf graph. Up to 5 s Python's
                garbage collection is paused meanwhile.
            cutoff: paths as long as this or longer are of no interest [m]: a bound that excludes
                shorter ones is enough. Later calls may lower it.

        Raises:
            QueryError: the time limit is not positive.
        """
        if not time_limit > 0.0:
            raise QueryError(f"time_limit must be positive [s], got {time_limit}")
        attempt = self._attempt
        attempt.clock.resume(
            time.perf_counter() if self._began is None else self._began, time_limit
        )
        self._began = None
        attempt.cutoff = min(attempt.cutoff, cutoff)
        with no_collection(time_limit):
            if not attempt.closed:
                self._exhausted = next(self._steps, _END) is _END
            attempt.clock.pause()
            return self._plan()

    def first_path(self) -> Plan:
        """The first path, soon and without a look at the clock: for a loop that replans.

        A search over leaves, tightened; `warm_start`, tightened likewise, when that is shorter; in
        the plane the shortest path, unless that takes long. The same input gives the same path,
        however fast the machine is. Its `lower_bound` is proved: in 3-D the straight distance.
        `solve` goes on from there; after a `solve` it is the best path so far.

        The plan has no path where none exists, or where a veto forbids the one found.

        Raises:
            QueryError: the method is the paper's, which has no first path.
        """
        if self._paper:
            raise QueryError('a first path needs method="best": the paper\'s own has none')
        attempt = self._attempt
        began = time.perf_counter() if self._began is None else self._began
        attempt.clock.resume(began, math.inf)
        self._began = None
        with no_collection(0.0):
            if attempt.route is None and not attempt.closed:
                offer_at_once(attempt, self._space, self._known)
            attempt.clock.pause()
            return self._plan()

    def _plan(self) -> Plan:
        """What is known, as a plan."""
        attempt = self._attempt
        query, route, n = attempt.query, attempt.route, self._space.n
        return Plan(
            status=attempt.status,
            start=query.start,
            goal=query.goal,
            waypoints=frozen(route.waypoints if route else np.zeros((0, n))),
            leaves=frozen(route.leaves if route else np.zeros(0, dtype=np.int64)),
            cost=attempt.cost,
            lower_bound=attempt.bound,
            asked_gap=self._gap,
            history=tuple(attempt.history),
            samples=frozen(np.concatenate(attempt.samples)),
            space=self._space,
            certificate=attempt.certificate,
        )


def plan(
    space: FreeSpace,
    start: ArrayLike,
    goal: ArrayLike,
    time_limit: float = 1.0,
    gap: float = 1e-3,
    seed: int = 0,
    method: Literal["best", "paper"] | PaperSettings = "best",
    *,
    warm_start: Plan | ArrayLike | None = None,
    veto: Veto | None = None,
    on_improvement: Callable[[Improvement], None] | None = None,
) -> Plan:
    """Shortest path from start to goal through the leaves of a free space, with a lower bound.

    Works until the asked gap is reached or the time is up. `Planner` has the same settings, and
    can go on with a query.

    Args:
        space: the free space.
        start: shape (n,) [m].
        goal: shape (n,) [m].
        time_limit: [s].
        gap: stop when (cost - lower_bound) / lower_bound is at most this.
        seed: of the random samples.
        method: see `Planner`; so for what follows.
        warm_start: an earlier plan or a polyline.
        veto: says which segments must not be used.
        on_improvement: is called with every improvement.

    Raises:
        QueryError: start or goal is not in the free space, or a setting is out of range.
        ShapeError: start or goal is not a finite point of dimension n.
    """
    planner = Planner(
        space,
        start,
        goal,
        gap=gap,
        seed=seed,
        method=method,
        warm_start=warm_start,
        veto=veto,
        on_improvement=on_improvement,
    )
    return planner.solve(time_limit)


def _located(space: FreeSpace, point: Floats, name: str) -> Ints:
    leaves = space.leaves_at(point)
    if len(leaves):
        return leaves
    where = ", ".join(f"{x:g}" for x in point)
    lo, hi = space.bounds
    if (point < lo).any() or (point > hi).any():
        valid = " x ".join(f"[{a:g}, {b:g}]" for a, b in zip(lo, hi, strict=True))
        raise QueryError(f"{name} ({where}) is outside the workspace {valid}")
    for number, block in enumerate(space.obstacles):
        depth = -float(block.violation(point)[0])
        if depth > 0.0:
            raise QueryError(f"{name} ({where}) is {depth:.3g} m inside obstacle {number}")
    raise QueryError(f"{name} ({where}) is in a crack between obstacles, not in the free space")
