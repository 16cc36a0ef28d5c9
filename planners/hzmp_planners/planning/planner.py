"""HZ-MP: plan a shortest path through the leaves of a hybrid zonotope, with a proof."""

from __future__ import annotations

import math
import time
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, Ints, as_point, frozen
from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.attempt import Attempt, Route
from hzmp_planners.planning.bends.bend_graph import BendGraphs
from hzmp_planners.planning.crossings import CrossingGraphs
from hzmp_planners.planning.detour import bottleneck_bound
from hzmp_planners.planning.explore import explore
from hzmp_planners.planning.first_path import offer_first
from hzmp_planners.planning.paper.algorithm import solve_paper
from hzmp_planners.planning.paper.settings import PaperSettings
from hzmp_planners.planning.planar.certificate import certify
from hzmp_planners.planning.planar.taut_search import TautSearch
from hzmp_planners.planning.prepared import prepared
from hzmp_planners.planning.prove import prove
from hzmp_planners.planning.result import Plan, PlanStatus, path_length
from hzmp_planners.planning.roadmap import Query

_SEARCHED = 0.6  # share of the time after which a search of the plane leaves the rest to samples
_FEW_PAIRS = 500  # up to here a relaxation of everything below the cost is cheap
_TRIED = 2  # relaxations over few faces before bends are tried


def plan(
    space: FreeSpace,
    start: ArrayLike,
    goal: ArrayLike,
    time_limit: float = 1.0,
    gap: float = 1e-3,
    seed: int = 0,
    method: Literal["best", "paper"] | PaperSettings = "best",
) -> Plan:
    """Shortest path from start to goal through the leaves of a free space, with a lower bound.

    In the plane the path is found exactly (`planar`). In 3-D, HZ-MP: search over points sampled on
    shared faces and refine the best face sequences exactly (`explore`); then, on what lies inside
    the informed ellipsotope of the best cost, prove a lower bound (`prove`), until the asked gap is
    reached or the time is up.

    Args:
        space: the free space.
        start: shape (n,) [m].
        goal: shape (n,) [m].
        time_limit: [s].
        gap: stop when (cost - lower_bound) / lower_bound is at most this.
        seed: of the random samples.
        method: "paper", or its settings, runs the HZ-MP paper's own algorithm instead
            (`planning.paper`).

    Raises:
        QueryError: start or goal is not in the free space, or a setting is out of range.
        ShapeError: start or goal is not a finite point of dimension n.
    """
    began = time.perf_counter()
    if not time_limit > 0.0:
        raise QueryError(f"time_limit must be positive [s], got {time_limit}")
    if not 0.0 <= gap < math.inf:
        raise QueryError(f"gap must be a finite ratio of at least 0, got {gap}")
    if not isinstance(seed, (int, np.integer)) or seed < 0:
        raise QueryError(f"seed must be a whole number of at least 0, got {seed!r}")
    if not isinstance(method, PaperSettings) and method not in ("best", "paper"):
        raise QueryError(f'method must be "best", "paper" or PaperSettings, got {method!r}')
    paper = PaperSettings() if method == "paper" else method
    s, g = as_point(start, "start", space.n), as_point(goal, "goal", space.n)
    query = Query(s, g, _located(space, s, "start"), _located(space, g, "goal"))
    attempt = Attempt(space.graph, query, began=began, time_limit=time_limit, gap=gap)
    status, samples = _solve(attempt, space, paper, int(seed))
    route = attempt.route
    return Plan(
        status=status,
        start=s,
        goal=g,
        waypoints=frozen(route.waypoints if route else np.zeros((0, space.n))),
        leaves=frozen(route.leaves if route else np.zeros(0, dtype=np.int64)),
        cost=attempt.cost,
        lower_bound=attempt.bound,
        asked_gap=gap,
        history=tuple(attempt.history),
        samples=frozen(samples),
        space=space,
        certificate=attempt.certificate,
    )


def _solve(
    attempt: Attempt,
    space: FreeSpace,
    paper: PaperSettings | Literal["best"],
    seed: int,
) -> tuple[PlanStatus, Floats]:
    """Run an attempt to its end; its status, and the points that were sampled."""
    query, graph = attempt.query, attempt.graph
    none = np.zeros((0, query.start.size))
    starts, goals = query.start_leaves, query.goal_leaves
    if common := _shared(starts, goals):
        leaf = np.array([min(common)])
        attempt.offer(Route(np.array([query.start, query.goal]), leaf, attempt.bound))
        return PlanStatus.OPTIMAL, none
    if not _shared(graph.components[starts], graph.components[goals]):
        attempt.raise_bound(math.inf)
        return PlanStatus.INFEASIBLE, none
    if isinstance(paper, PaperSettings):
        return solve_paper(attempt, space, paper, np.random.default_rng(seed))
    offer_first(attempt, space)
    if space.n == 2 and space.disjoint:
        _search_plane(attempt, space)
    if attempt.done and attempt.route is not None:
        return PlanStatus.OPTIMAL if attempt.closed else PlanStatus.FEASIBLE, none
    attempt.raise_bound(
        bottleneck_bound(attempt.detours, graph.ends, graph.leaf_count, starts, goals)
    )
    samples = explore(attempt, np.random.default_rng(seed))
    if attempt.route is None:
        return PlanStatus.TIME_LIMIT, samples
    if not attempt.done:
        _prove(attempt, space)
    return PlanStatus.OPTIMAL if attempt.closed else PlanStatus.FEASIBLE, samples


def _shared(one: Ints, two: Ints) -> set[int]:
    """Numbers that are in both of two short lists."""
    return set(one.tolist()) & set(two.tolist())


def _search_plane(attempt: Attempt, space: FreeSpace) -> None:
    """Find a shorter path in the plane or prove that there is none.

    If that takes most of the time, what was searched proves a bound at least.
    """
    query, mesh = attempt.query, prepared(space).mesh
    search = TautSearch(mesh, query.start, query.goal, query.start_leaves, query.goal_leaves)
    search.run(attempt.cost, time.perf_counter() + _SEARCHED * attempt.time_left)
    if search.path is not None:
        points, leaves = search.path.waypoints, search.path.leaves
        attempt.offer(Route(points, leaves, path_length(points)))
    attempt.raise_bound(search.bound, certify(mesh, search, query.start, query.goal))


def _prove(attempt: Attempt, space: FreeSpace) -> None:
    """Bound over crossed faces or, in 3-D, over the bends of taut strings, as it is best."""
    if space.n == 2:
        _prove_over_faces(attempt)
        return
    graph, world = attempt.graph, prepared(space).bends
    near = attempt.detours < attempt.cost
    pairs = 2 * int(near[graph.pairs[:, :2]].all(axis=1).sum())
    # A few faces are quickly tried. Cracks that no path passes make the bends' bound lower.
    if world.cracked or pairs <= _FEW_PAIRS:
        _prove_over_faces(attempt, math.inf if world.cracked else _TRIED)
    if not attempt.done:
        target = attempt.target
        prove(attempt, BendGraphs(world, attempt.query.start, attempt.query.goal, target), target)
    if not attempt.done and not world.cracked:  # else that was all that faces can prove
        _prove_over_faces(attempt)


def _prove_over_faces(attempt: Attempt, rounds: float = math.inf) -> None:
    threshold = attempt.cost
    graphs = CrossingGraphs(attempt.graph, attempt.query, attempt.detours, threshold)
    if len(graphs.first.pairs) > _FEW_PAIRS:
        # Paths longer than this need no bound of their own: the gap is closed at it.
        threshold = attempt.target
        graphs = CrossingGraphs(attempt.graph, attempt.query, attempt.detours, threshold)
    prove(attempt, graphs, threshold, rounds)


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
