"""HZ-MP: plan a shortest path through the leaves of a hybrid zonotope, with a proof."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, Ints, as_point, frozen
from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.certificate import Certificate, Cuts
from hzmp_planners.planning.crossings import (
    build_crossings,
    prune_pairs,
    split_nodes,
    three_leg_bounds,
)
from hzmp_planners.planning.detour import bottleneck_bound, least_detour
from hzmp_planners.planning.plan import Plan, PlanStatus, path_length
from hzmp_planners.planning.refine import rank_together, refine
from hzmp_planners.planning.relaxation import solve_relaxation
from hzmp_planners.planning.roadmap import (
    FaceSequence,
    Query,
    leaf_route,
    sample_faces,
    search_sequences,
)
from hzmp_planners.planning.rounding import flow_sequences, mixing_points

_ROUNDS = 12
_CANDIDATES = 64
_SWEEPS = 6
_SEQUENCES = 5
_FEW_PAIRS = 500  # up to here a relaxation of everything below the cost is cheap
_MOST_PAIRS = 12_000  # more take Clarabel longer than any query waits


def plan(
    space: FreeSpace,
    start: ArrayLike,
    goal: ArrayLike,
    time_limit: float = 1.0,
    gap: float = 1e-3,
    seed: int = 0,
) -> Plan:
    """Shortest path from start to goal through the leaves of a free space, with a lower bound.

    HZ-MP in five steps: locate start and goal; search over points sampled on shared faces
    (`roadmap`); refine the best face sequences exactly (`refine`); drop the faces outside the
    informed ellipsotope of the best cost (`detour`); prove a lower bound with potentials on the
    remaining faces, and round its flow into better sequences (`relaxation`), cutting faces where
    flows mix until the asked gap is reached.

    Args:
        space: the free space.
        start: shape (n,) [m].
        goal: shape (n,) [m].
        time_limit: [s].
        gap: stop when (cost - lower_bound) / lower_bound is at most this.
        seed: of the random samples.

    Raises:
        QueryError: start or goal is not in the free space, or a setting is out of range.
        ShapeError: start or goal is not a finite point of dimension n.
    """
    began = time.perf_counter()
    if not time_limit > 0.0:
        raise QueryError(f"time_limit must be positive [s], got {time_limit}")
    if not 0.0 <= gap < math.inf:
        raise QueryError(f"gap must be a finite ratio of at least 0, got {gap}")
    s, g = as_point(start, "start", space.n), as_point(goal, "goal", space.n)
    query = Query(s, g, _located(space, s, "start"), _located(space, g, "goal"))
    rng = np.random.default_rng(seed)
    return _Planning(space, query, began, time_limit, gap, rng).run()


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


@dataclass(frozen=True, eq=False)
class _Route:
    waypoints: Floats
    leaves: Ints
    cost: float


class _Planning:
    """State of one call: the best route, the best bound, and the clock."""

    def __init__(
        self,
        space: FreeSpace,
        query: Query,
        began: float,
        time_limit: float,
        gap: float,
        rng: np.random.Generator,
    ) -> None:
        self._space, self._graph, self._query = space, space.graph, query
        self._began, self._deadline, self._gap, self._rng = began, began + time_limit, gap, rng
        self._route: _Route | None = None
        self._bound = float(np.linalg.norm(query.goal - query.start))
        self._certificate: Certificate | None = None
        self._history: list[tuple[float, float, float]] = []
        self._tried: set[FaceSequence] = set()
        self._detours = self._nearest = np.zeros(0)
        self._samples = np.zeros((0, space.n))

    def run(self) -> Plan:
        query, graph = self._query, self._graph
        common = np.intersect1d(query.start_leaves, query.goal_leaves)
        if len(common):
            self._offer(_Route(np.array([query.start, query.goal]), common[:1], self._bound))
            return self._result(PlanStatus.OPTIMAL)
        components = graph.components()
        if not np.isin(components[query.start_leaves], components[query.goal_leaves]).any():
            self._bound = math.inf
            self._record()
            return self._result(PlanStatus.INFEASIBLE)
        self._detours, self._nearest = least_detour(graph.corners, query.start, query.goal)
        self._raise_bound(
            bottleneck_bound(
                self._detours,
                graph.ends,
                graph.leaf_count,
                query.start_leaves,
                query.goal_leaves,
            )
        )
        self._search()
        if self._route is not None and not self._done():
            self._prove()
        if self._route is None:
            return self._result(PlanStatus.TIME_LIMIT)
        return self._result(PlanStatus.OPTIMAL if self._closed() else PlanStatus.FEASIBLE)

    def _search(self) -> None:
        """Sample faces, search, refine; each round samples only what the last cost left active."""
        candidates = self._nearest[:, None]
        for number in range(_ROUNDS):
            active = self._detours < self._cost
            drawn = candidates[active].reshape(-1, self._space.n)
            self._samples = np.concatenate([self._samples, drawn])
            before = self._cost
            most = _CANDIDATES if number else 1
            found = search_sequences(self._graph, self._query, candidates, active, most)
            for faces in self._most_promising(found):
                self._try(faces)
                if self._done():
                    return
            if number > 1 and self._cost > before * (1.0 - 1e-5):
                return
            uniform = sample_faces(self._graph.corners, 2, self._rng)
            known = [self._beside_route()[:, None], self._nearest[:, None]]
            candidates = np.concatenate([*known, uniform], axis=1)

    def _most_promising(self, found: list[FaceSequence]) -> list[FaceSequence]:
        """The sequences worth an exact refinement: those shortest after a few joint sweeps."""
        fresh = [faces for faces in found if faces not in self._tried]
        if len(fresh) <= 1:
            return fresh
        corners = self._graph.corners
        routes = [corners[list(faces)] for faces in fresh]
        lengths = rank_together(self._query.start, self._query.goal, routes, _SWEEPS)
        return [fresh[i] for i in np.argsort(lengths, kind="stable")[:_SEQUENCES].tolist()]

    def _beside_route(self) -> Floats:
        """On each face, the point that a path close to the best route would cross most cheaply.

        Of all windows of two segments of the route, the one whose least detour over the face adds
        least.
        """
        corners = self._graph.corners
        points, added = self._nearest.copy(), np.full(len(corners), math.inf)
        if self._route is None:
            return points
        path = self._route.waypoints
        step = min(2, len(path) - 1)
        for k in range(len(path) - step):
            window = path[k : k + step + 1]
            detour, where = least_detour(corners, window[0], window[-1])
            extra = detour - path_length(window)
            better = extra < added
            added[better], points[better] = extra[better], where[better]
        return points

    def _prove(self) -> None:
        """Raise the bound until the gap is closed or the time is up."""
        threshold = self._cost
        graph = build_crossings(self._graph, self._query, self._detours < threshold, threshold)
        if len(graph.pairs) > _FEW_PAIRS:
            # Paths longer than this need no bound of their own: the gap is closed at it.
            threshold = self._target
            graph = build_crossings(self._graph, self._query, self._detours < threshold, threshold)
        parent: Certificate | None = None
        cuts: Cuts = {}
        while not self._done():
            if not len(graph.pairs):
                self._raise_bound(threshold, Certificate.empty(graph, threshold, parent, cuts))
                return
            left = self._deadline - time.perf_counter()
            if len(graph.pairs) > _MOST_PAIRS:
                return
            relaxation = solve_relaxation(graph, threshold, left, parent, cuts)
            if relaxation is None:
                return
            certificate = relaxation.certificate
            self._raise_bound(certificate.bound(), certificate)
            for faces in flow_sequences(relaxation, _SEQUENCES):
                if self._done():
                    return
                self._try(leaf_route(self._graph, self._query, faces)[0])
            threshold = min(threshold, self._target)
            cuts = mixing_points(relaxation, max(4, len(graph.corners) // 6))
            kept = certificate.least_through() < threshold
            if not cuts and kept.all():
                return
            divided = split_nodes(replace(graph, pairs=graph.pairs[kept]), cuts)
            graph = prune_pairs(divided, three_leg_bounds(divided) < threshold)
            parent = certificate

    def _try(self, faces: FaceSequence) -> None:
        """Refine a face sequence once and take it when it is the best."""
        if faces in self._tried:
            return
        self._tried.add(faces)
        sequence, leaves = leaf_route(self._graph, self._query, list(faces))
        corners = self._graph.corners[list(sequence)]
        left = self._deadline - time.perf_counter()
        waypoints = refine(self._query.start, self._query.goal, corners, left)
        # Round-off must not put a path below a bound that is proved.
        cost = max(path_length(waypoints), self._bound)
        self._offer(_Route(waypoints, leaves, cost))

    @property
    def _cost(self) -> float:
        return self._route.cost if self._route is not None else math.inf

    def _offer(self, route: _Route) -> None:
        if route.cost < self._cost:
            self._route = route
            self._record()

    def _raise_bound(self, bound: float, certificate: Certificate | None = None) -> None:
        # Round-off must not lift the bound above a path that exists.
        bound = min(bound, self._cost)
        if bound > self._bound:
            self._bound, self._certificate = bound, certificate
            self._record()

    def _record(self) -> None:
        self._history.append((time.perf_counter() - self._began, self._cost, self._bound))

    @property
    def _target(self) -> float:
        """Bound that closes the gap [m]; a few ulps more, so that no rounding opens it again."""
        return self._cost / (1.0 + self._gap) * (1.0 + 1e-15)

    def _closed(self) -> bool:
        return self._cost - self._bound <= self._gap * self._bound

    def _done(self) -> bool:
        return self._closed() or time.perf_counter() >= self._deadline

    def _result(self, status: PlanStatus) -> Plan:
        route = self._route
        n = self._space.n
        return Plan(
            status=status,
            start=self._query.start,
            goal=self._query.goal,
            waypoints=frozen(route.waypoints if route else np.zeros((0, n))),
            leaves=frozen(route.leaves if route else np.zeros(0, dtype=np.int64)),
            cost=self._cost,
            lower_bound=self._bound,
            history=tuple(self._history),
            samples=frozen(self._samples),
            space=self._space,
            certificate=self._certificate,
        )
