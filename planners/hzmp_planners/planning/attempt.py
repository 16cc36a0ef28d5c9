"""One attempt at a query: the best route, the best bound, and the clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.free_space import LeafGraph
from hzmp_planners.planning.certificate import Certificate
from hzmp_planners.planning.clock import Clock
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.planning.planar.certificate import CornerCertificate
from hzmp_planners.planning.refine import FACE_TIME, refine
from hzmp_planners.planning.result import PlanStatus, is_closed, path_length
from hzmp_planners.planning.roadmap import FaceSequence, Query, leaf_route

_ROUNDED_DOWN = 1.0 - 1e-14
_MEASURED = 1500  # faces whose detours are found at a time

Veto = Callable[[Floats, Floats], bool]
"""Says whether the segment between two points (n,) [m] must not be used."""


@dataclass(frozen=True, eq=False)
class Route:
    """A path through leaves."""

    waypoints: Floats
    """Shape (K+1, n) [m]."""
    leaves: Ints
    """Leaf of each segment, shape (K,)."""
    cost: float
    """Length [m]."""


@dataclass(frozen=True)
class Improvement:
    """A shorter path or a higher bound, as it was found."""

    time_s: float
    """Time spent on the query until then [s]."""
    cost: float
    """Length of the best path [m]; inf without one."""
    lower_bound: float
    """No path is shorter [m]."""
    waypoints: Floats
    """Best path, shape (K+1, n) [m]; (0, n) without one."""


class Attempt:
    """What is known so far of a query, and how much time is left to know more.

    Exploration (`explore`) and proof (`prove`) both work on one attempt.

    Args:
        graph: leaves and shared faces.
        query: start and goal.
        gap: asked ratio (cost - bound) / bound.
        cutoff: paths as long as this or longer are of no interest [m].
        veto: routes that have a segment it objects to are not taken.
        report: is called with every improvement.
    """

    def __init__(
        self,
        graph: LeafGraph,
        query: Query,
        *,
        gap: float,
        cutoff: float = math.inf,
        veto: Veto | None = None,
        report: Callable[[Improvement], None] | None = None,
    ) -> None:
        self.graph, self.query = graph, query
        self.cutoff = cutoff
        self.route: Route | None = None
        self.bound = float(np.linalg.norm(query.goal - query.start))
        self.certificate: Certificate | CornerCertificate | None = None
        self.history: list[tuple[float, float, float]] = []
        self.samples: list[Floats] = [np.zeros((0, query.start.size))]
        self._gap, self._veto, self._report = gap, veto, report
        self.clock = Clock()
        self.detours: Floats = np.zeros(0)
        """f* of each face (F,) [m]: see `detour`. It is there after `measure_faces`."""
        self.nearest: Floats = np.zeros((0, query.start.size))
        """Where that is attained (F, n) [m]."""
        self._tried: set[FaceSequence] = set()

    def measure_faces(self) -> Generator[None, None, None]:
        """Find `detours` and `nearest`, once; yields whenever the time is over."""
        corners, start, goal = self.graph.corners, self.query.start, self.query.goal
        if len(self.detours) == len(corners):
            return

        def work(rows: slice) -> Floats:
            return np.column_stack(least_detour(corners[rows], start, goal))

        measured = yield from self.clock.in_pieces(work, len(corners), _MEASURED)
        self.detours, self.nearest = measured[:, 0], measured[:, 1:]

    @property
    def cost(self) -> float:
        """Length of the best route; inf without one [m]."""
        return self.route.cost if self.route is not None else math.inf

    @property
    def limit(self) -> float:
        """Only shorter paths are of interest [m]."""
        return min(self.cost, self.cutoff)

    @property
    def target(self) -> float:
        """Bound that closes the gap [m]; a few ulps more, so that no rounding opens it again."""
        return self.limit / (1.0 + self._gap) / _ROUNDED_DOWN * (1.0 + 1e-15)

    @property
    def closed(self) -> bool:
        """Whether the asked gap is reached."""
        return is_closed(self.limit, self.bound, self._gap)

    @property
    def status(self) -> PlanStatus:
        """How the attempt stands."""
        if self.route is None:
            infeasible = math.isinf(self.bound)
            return PlanStatus.INFEASIBLE if infeasible else PlanStatus.TIME_LIMIT
        proved = is_closed(self.cost, self.bound, self._gap)
        return PlanStatus.OPTIMAL if proved else PlanStatus.FEASIBLE

    def untried(self, sequences: list[FaceSequence]) -> list[FaceSequence]:
        """Those that have not been refined yet."""
        return [faces for faces in sequences if faces not in self._tried]

    def try_sequence(self, faces: Sequence[int]) -> Generator[None, None, None]:
        """Refine the route along some faces, once, and take it when it is the best.

        Yields whenever the time is over.
        """
        query = self.query
        sequence, leaves = leaf_route(self.graph, query, list(faces))
        if sequence in self._tried:
            return
        yield from self.clock.wait_for(FACE_TIME * len(sequence))
        self._tried.add(sequence)
        corners = self.graph.corners[list(sequence)]
        waypoints = refine(query.start, query.goal, corners)
        self.offer(Route(waypoints, leaves, path_length(waypoints)))

    def offer(self, route: Route) -> None:
        """Take a route when it is the best, and no veto is put in."""
        if route.cost >= self.cost:
            return
        # Every route that is ever taken is taken here.
        if not any(self.forbids(p, q) for p, q in pairwise(route.waypoints)):
            self.route = route
            self.bound = min(self.bound, route.cost)  # round-off must not leave it above
            self.record()

    @property
    def has_veto(self) -> bool:
        """Whether segments may be forbidden."""
        return self._veto is not None

    def forbids(self, p: Floats, q: Floats) -> bool:
        """Whether the segment from p to q may not be used."""
        return self._veto is not None and bool(self._veto(p, q))

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
        """Add the present state to the history, and report it."""
        spent = self.clock.spent
        self.history.append((spent, self.cost, self.bound))
        if self._report is not None:
            none = np.zeros((0, self.query.start.size))
            waypoints = self.route.waypoints if self.route is not None else none
            self._report(Improvement(spent, self.cost, self.bound, waypoints))
