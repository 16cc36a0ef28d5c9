"""Several ways to go: locally shortest paths that differ by more than a distance.

A path is locally shortest when no path beside it is shorter: a string pulled taut. In the plane
there is one for each way to pass the obstacles on the left or right. Candidates are the sequences
of faces of shortest paths through each sampled point in turn; each is pulled taut, over other
leaves as well, and kept when it is new.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, frozen
from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.attempt import Route
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.planning.follow import faces_between
from hzmp_planners.planning.planner import Planner
from hzmp_planners.planning.refine import refine
from hzmp_planners.planning.result import Plan, PlanStatus, is_closed, path_length
from hzmp_planners.planning.roadmap import (
    FaceSequence,
    Query,
    leaf_route,
    sample_faces,
    search_sequences,
)

_FIRST = 0.5  # share of the time for the shortest path and its bound
_ROUNDS = 6
_MOST = 1000  # strings that are pulled taut in a round
_SAMPLES = 2  # points on each face
_PULLS = 30  # changes of the leaves, until a string is taken as taut
_GAIN = 1e-9  # relative: a string that gets shorter by less is taut
_CUTS = (0.5, 0.05, 0.001)  # of the legs at a bend: where it is cut, if that is free
_STRAIGHT = 1e-10  # relative: legs that are longer than the straight way by less do not bend
_LEAST_TIME = 1e-3  # [s] for what is begun


def plan_corridors(
    space: FreeSpace,
    start: ArrayLike,
    goal: ArrayLike,
    count: int,
    time_limit: float = 1.0,
    gap: float = 1e-3,
    seed: int = 0,
    apart: float | None = None,
) -> list[Plan]:
    """Up to `count` different locally shortest paths, the shortest first.

    The first is that of `plan`. The others are the best that sampling found: there may be others.

    Args:
        space: the free space.
        start: shape (n,) [m].
        goal: shape (n,) [m].
        count: how many at the most.
        time_limit: [s].
        gap: of the first, see `plan`.
        seed: of the random samples.
        apart: two paths are the same corridor when each stays within this distance of the other
            [m]; a thousandth of the space's scale unless given.

    Raises:
        QueryError: start or goal is not in the free space, or a setting is out of range.
    """
    deadline = time.perf_counter() + time_limit
    if not isinstance(count, int | np.integer) or count < 1:
        raise QueryError(f"count must be a whole number of at least 1, got {count!r}")
    width = 1e-3 * space.scale if apart is None else apart
    if not width >= 0.0:
        raise QueryError(f"apart must be a distance of at least 0 [m], got {apart}")
    best = Planner(space, start, goal, gap=gap, seed=seed).solve(_FIRST * time_limit)
    if not len(best.leaves):
        return []
    query = Query(best.start, best.goal, *(space.leaves_at(x) for x in (best.start, best.goal)))
    corridors = _Corridors(space, query, best.waypoints, width)
    corridors.look(count, deadline, np.random.default_rng(seed))
    return [best, *(_as_plan(best, route) for route in corridors.found[: count - 1])]


def _as_plan(best: Plan, route: Route) -> Plan:
    """A plan with the bound of the best one."""
    proved = is_closed(route.cost, best.lower_bound, best.asked_gap)
    return replace(
        best,
        status=PlanStatus.OPTIMAL if proved else PlanStatus.FEASIBLE,
        waypoints=frozen(route.waypoints),
        leaves=frozen(route.leaves),
        cost=route.cost,
    )


class _Corridors:
    """The taut strings found so far."""

    def __init__(self, space: FreeSpace, query: Query, best: Floats, apart: float) -> None:
        self.found: list[Route] = []
        """All but the best, the shortest first."""
        self._space, self._query, self._best, self._apart = space, query, best, apart
        self._tried: set[FaceSequence] = set()

    def look(self, count: int, deadline: float, rng: np.random.Generator) -> None:
        """Pull sampled strings taut until enough are found that no round improves on."""
        graph, query = self._space.graph, self._query
        everything = np.ones(len(graph), dtype=np.bool_)
        _, nearest = least_detour(graph.corners, query.start, query.goal)
        for _ in range(_ROUNDS):
            known = [route.cost for route in self.found[: count - 1]]
            drawn = sample_faces(graph.corners, _SAMPLES, rng)
            samples = np.concatenate([nearest[:, None], drawn], axis=1)
            for faces in search_sequences(graph, query, samples, everything, _MOST, spread=True):
                if time.perf_counter() >= deadline:
                    return
                if faces not in self._tried:
                    self._take(self._refined(faces, deadline), deadline)
            if len(known) == count - 1 and [r.cost for r in self.found[: count - 1]] == known:
                return

    def _refined(self, faces: FaceSequence, deadline: float) -> Route:
        """The shortest path over some faces."""
        graph, query = self._space.graph, self._query
        sequence, leaves = leaf_route(graph, query, list(faces))
        self._tried.add(sequence)
        left = max(_LEAST_TIME, deadline - time.perf_counter())
        path = refine(query.start, query.goal, graph.corners[list(sequence)], left)
        return Route(path, leaves, path_length(path))

    def _take(self, route: Route, deadline: float) -> None:
        """Keep a path, pulled taut, unless it is one of those that are known."""
        if self._is_new(route):
            route = self._pulled_taut(route, deadline)
            if self._is_new(route):
                self.found = sorted([*self.found, route], key=lambda other: other.cost)

    def _is_new(self, route: Route) -> bool:
        others = [self._best, *(other.waypoints for other in self.found)]
        return all(_distance(route.waypoints, other) > self._apart for other in others)

    def _pulled_taut(self, route: Route, deadline: float) -> Route:
        """Cut bends where that is free, and refine over the leaves passed then, until none is."""
        for _ in range(_PULLS):
            cut = shortened(self._space, route.waypoints)
            traced = None if cut is None else self._space.trace(cut)
            faces = None if traced is None else faces_between(self._space.graph, traced[1])
            if faces is None:
                break
            pulled = self._refined(tuple(faces), deadline)
            if pulled.cost >= route.cost * (1.0 - _GAIN):
                break
            route = pulled
        return route


def shortened(space: FreeSpace, path: Floats) -> Floats | None:
    """The polyline (k, n) with its bends cut where the cut is free; None where none is."""
    bends = [path[0]]
    for point, following in pairwise(path[1:]):
        if _turns(bends[-1], point, following):
            bends.append(point)
    bends.append(path[-1])
    points, changed = [path[0]], False
    for a, b, c in zip(bends, bends[1:], bends[2:], strict=False):
        cut = _free_cut(space, a, b, c)
        points += [b] if cut is None else list(cut)
        changed |= cut is not None
    return np.array([*points, path[-1]]) if changed else None


def _free_cut(space: FreeSpace, a: Floats, b: Floats, c: Floats) -> Floats | None:
    """Ends (2, n) of a free segment that cuts the bend at b; None where none of those tried is."""
    for share in _CUTS:
        ends = np.array([b + share * (a - b), b + share * (c - b)])
        if space.trace(ends) is not None:
            return ends
    return None


def _turns(a: Floats, b: Floats, c: Floats) -> bool:
    """Whether the way from a over b to c is longer than the straight one, by what counts."""
    legs = math.dist(a, b), math.dist(b, c)
    return min(legs) > 0.0 and sum(legs) > math.dist(a, c) * (1.0 + _STRAIGHT)


def _distance(one: Floats, two: Floats) -> float:
    """Hausdorff distance of two polylines, up to the spacing of the points compared [m]."""
    return max(_farthest(one, two), _farthest(two, one))


def _farthest(path: Floats, other: Floats) -> float:
    """How far points of a polyline get from another one [m]: at waypoints and in between."""
    shares = np.linspace(0.0, 1.0, 9)[:, None, None]
    points = (path[:-1] + shares * (path[1:] - path[:-1])).reshape(-1, path.shape[1])
    a, along = other[:-1], other[1:] - other[:-1]
    size = np.maximum((along**2).sum(axis=1), 1e-300)
    share = np.clip(((points[:, None] - a) * along).sum(axis=2) / size, 0.0, 1.0)
    apart = np.linalg.norm(points[:, None] - a - share[..., None] * along, axis=2)
    return float(apart.min(axis=1).max())
