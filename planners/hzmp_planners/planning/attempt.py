"""One attempt at a query: the best route, the best bound, and the clock."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.free_space import LeafGraph
from hzmp_planners.planning.certificate import Certificate
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.planning.planar.certificate import CornerCertificate
from hzmp_planners.planning.refine import refine
from hzmp_planners.planning.result import path_length
from hzmp_planners.planning.roadmap import FaceSequence, Query, leaf_route

_ROUNDED_DOWN = 1.0 - 1e-14


@dataclass(frozen=True, eq=False)
class Route:
    """A path through leaves."""

    waypoints: Floats
    """Shape (K+1, n) [m]."""
    leaves: Ints
    """Leaf of each segment, shape (K,)."""
    cost: float
    """Length [m]."""


class Attempt:
    """What is known so far of a query, and how much time is left to know more.

    Exploration (`explore`) and proof (`prove`) both work on one attempt.
    """

    def __init__(
        self, graph: LeafGraph, query: Query, *, began: float, time_limit: float, gap: float
    ) -> None:
        self.graph, self.query = graph, query
        self.route: Route | None = None
        self.bound = float(np.linalg.norm(query.goal - query.start))
        self.certificate: Certificate | CornerCertificate | None = None
        self.history: list[tuple[float, float, float]] = []
        self._began, self._deadline, self._gap = began, began + time_limit, gap
        self._tried: set[FaceSequence] = set()

    @cached_property
    def _over_faces(self) -> tuple[Floats, Floats]:
        return least_detour(self.graph.corners, self.query.start, self.query.goal)

    @property
    def detours(self) -> Floats:
        """f* of each face, shape (F,) [m]: see `detour`."""
        return self._over_faces[0]

    @property
    def nearest(self) -> Floats:
        """The point of each face where f* is attained, shape (F, n) [m]."""
        return self._over_faces[1]

    @property
    def cost(self) -> float:
        """Length of the best route; inf without one [m]."""
        return self.route.cost if self.route is not None else math.inf

    @property
    def target(self) -> float:
        """Bound that closes the gap [m]; a few ulps more, so that no rounding opens it again."""
        return self.cost / (1.0 + self._gap) / _ROUNDED_DOWN * (1.0 + 1e-15)

    @property
    def time_left(self) -> float:
        """Time until the deadline [s]; negative when it is over."""
        return self._deadline - time.perf_counter()

    @property
    def closed(self) -> bool:
        """Whether the asked gap is reached."""
        return self.cost - self.bound <= self._gap * self.bound

    @property
    def done(self) -> bool:
        """Whether there is nothing left to do, or no time left to do it."""
        return self.closed or self.time_left <= 0.0

    def untried(self, sequences: list[FaceSequence]) -> list[FaceSequence]:
        """Those that have not been refined yet."""
        return [faces for faces in sequences if faces not in self._tried]

    def try_sequence(self, faces: Sequence[int]) -> None:
        """Refine the route along some faces, once, and take it when it is the best."""
        query = self.query
        sequence, leaves = leaf_route(self.graph, query, list(faces))
        if sequence in self._tried:
            return
        self._tried.add(sequence)
        corners = self.graph.corners[list(sequence)]
        waypoints = refine(query.start, query.goal, corners, self.time_left)
        self.offer(Route(waypoints, leaves, path_length(waypoints)))

    def offer(self, route: Route) -> None:
        """Take a route when it is the best."""
        if route.cost < self.cost:
            self.route = route
            self.bound = min(self.bound, route.cost)  # round-off must not leave it above
            self.record()

    def raise_bound(
        self, bound: float, certificate: Certificate | CornerCertificate | None = None
    ) -> None:
        """Take a proved lower bound [m] when it is better."""
        # The last digits of a bound are round-off: a path that attains it must not be below.
        bound = min(bound * _ROUNDED_DOWN, self.cost)
        if bound > self.bound:
            self.bound, self.certificate = bound, certificate
            self.record()

    def record(self) -> None:
        """Add the present state to the history."""
        self.history.append((time.perf_counter() - self._began, self.cost, self.bound))
