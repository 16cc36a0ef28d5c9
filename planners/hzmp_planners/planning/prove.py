"""Proving a lower bound: relax, prune what it excludes, divide pieces where it is loose."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Protocol

from hzmp_planners.planning.attempt import Attempt
from hzmp_planners.planning.certificate import Certificate, CrossingGraph, Cuts
from hzmp_planners.planning.follow import follow
from hzmp_planners.planning.refine import refine
from hzmp_planners.planning.relaxation import Relaxation, solve_relaxation
from hzmp_planners.planning.result import path_length
from hzmp_planners.planning.rounding import flow_chains

_ROUNDED = 5  # sequences taken from each flow
_MOST_PAIRS = 12_000  # more take Clarabel longer than any query waits
_PAIR_TIME = 4e-5  # [s] that Clarabel takes for a pair, at the least (measured, in 3-D)
_GROWTH = 1.2  # exponent of its time over the number of pairs (measured)


class Graphs(Protocol):
    """The graphs of one query that are relaxed one after the other."""

    @property
    def first(self) -> CrossingGraph | None:
        """All that a path shorter than the threshold may do; None where that is too much."""
        ...

    def loose_points(self, relaxation: Relaxation) -> Cuts:
        """Where to cut which nodes so that the next relaxation is tighter."""
        ...

    def divide(self, graph: CrossingGraph, cuts: Cuts, threshold: float) -> CrossingGraph:
        """Cut pieces in two, and leave out what the halves exclude."""
        ...


def prove(attempt: Attempt, graphs: Graphs, threshold: float, rounds: float = math.inf) -> None:
    """Raise the bound of an attempt until its gap is closed or the time is up.

    The flow of each relaxation is rounded into paths, which improve the route too.

    Args:
        attempt: has a route.
        graphs: of what is relaxed.
        threshold: the one that `graphs.first` was built with [m].
        rounds: how many relaxations to solve at the most.
    """
    graph = graphs.first
    parent: Certificate | None = None
    cuts: Cuts = {}
    pair_time = _PAIR_TIME
    while graph is not None and rounds > 0 and not attempt.done:
        rounds -= 1
        count = len(graph.pairs)
        if not count:
            attempt.raise_bound(threshold, Certificate.empty(graph, threshold, parent, cuts))
            return
        # A relaxation that is stopped half-way proves next to nothing.
        if count > _MOST_PAIRS or pair_time * count**_GROWTH > attempt.time_left:
            return
        began = time.perf_counter()
        relaxation = solve_relaxation(graph, threshold, attempt.time_left, parent, cuts)
        pair_time = (time.perf_counter() - began) / count**_GROWTH
        if relaxation is None:
            return
        certificate = relaxation.certificate
        attempt.raise_bound(certificate.bound(), certificate)
        _round(attempt, relaxation)
        threshold = min(threshold, attempt.target)
        cuts = graphs.loose_points(relaxation)
        kept = certificate.least_through() < threshold
        if attempt.done or (not cuts and kept.all()):
            return
        graph = graphs.divide(replace(graph, pairs=graph.pairs[kept]), cuts, threshold)
        parent = certificate


def _round(attempt: Attempt, relaxation: Relaxation) -> None:
    """Try the paths that carry most of the flow."""
    query, corners = attempt.query, relaxation.certificate.graph.corners
    for chain in flow_chains(relaxation, _ROUNDED):
        if attempt.done:
            return
        path = refine(query.start, query.goal, corners[chain], attempt.time_left)
        if path_length(path) < attempt.cost * (1.0 - 1e-9):
            follow(attempt, path)
