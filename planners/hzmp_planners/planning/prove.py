"""Proving a lower bound: relax, prune what it excludes, divide pieces where it is loose."""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Iterator
from dataclasses import replace
from typing import Protocol

from hzmp_planners.planning.attempt import Attempt
from hzmp_planners.planning.certificate import Certificate, CrossingGraph, Cuts
from hzmp_planners.planning.follow import follow
from hzmp_planners.planning.refine import FACE_TIME, refine
from hzmp_planners.planning.relaxation import Relaxation, solve_relaxation
from hzmp_planners.planning.result import path_length
from hzmp_planners.planning.rounding import flow_chains

_ROUNDED = 5  # sequences taken from each flow
_MOST_PAIRS = 12_000  # more take Clarabel longer than any query waits
_PAIR_TIME = 4e-5  # [s] that Clarabel takes for a pair, at the least (measured, in 3-D)
_CUT_TIME = 5e-6  # [s] that it takes for a pair to find where to cut (measured)
_GROWTH = 1.2  # exponent of its time over the number of pairs (measured)


class Graphs(Protocol):
    """How the graphs of one query follow each other that are relaxed."""

    def loose_points(self, relaxation: Relaxation) -> Cuts:
        """Where to cut which nodes so that the next relaxation is tighter."""
        ...

    def divide(
        self, graph: CrossingGraph, cuts: Cuts, threshold: float
    ) -> Generator[None, None, CrossingGraph]:
        """Cut pieces in two, and leave out what the halves exclude; yields when time is over."""
        ...


def prove(
    attempt: Attempt,
    graphs: Graphs,
    first: CrossingGraph | None,
    threshold: float,
    rounds: float = math.inf,
) -> Iterator[None]:
    """Raise the bound of an attempt until its gap is closed; yields when the time is over.

    The flow of each relaxation is rounded into paths, which improve the route too.

    Args:
        attempt: has a route, or a cutoff.
        graphs: of what is relaxed.
        first: all that a path shorter than the threshold may do; None where that is too much.
        threshold: [m].
        rounds: how many relaxations to solve at the most.
    """
    graph = first
    parent: Certificate | None = None
    cuts: Cuts = {}
    pair_time = _PAIR_TIME
    while graph is not None and rounds > 0 and not attempt.closed:
        count = len(graph.pairs)
        if not count:
            attempt.raise_bound(threshold, Certificate.empty(graph, threshold, parent, cuts))
            return
        if count > _MOST_PAIRS:
            return
        # A relaxation that is stopped half-way proves next to nothing.
        yield from attempt.clock.wait_for(pair_time * count**_GROWTH)
        began = time.perf_counter()
        rounds -= 1
        relaxation = solve_relaxation(graph, threshold, attempt.clock.time_left, parent, cuts)
        pair_time = (time.perf_counter() - began) / count**_GROWTH
        if relaxation is None:
            return
        certificate = relaxation.certificate
        attempt.raise_bound(certificate.bound(), certificate)
        if not relaxation.solved:
            yield  # with more time it is worth another try
            continue
        yield from _round(attempt, relaxation)
        threshold = min(threshold, attempt.target)
        yield from attempt.clock.wait_for(_CUT_TIME * count)
        cuts = graphs.loose_points(relaxation)
        kept = certificate.least_through() < threshold
        if attempt.closed or (not cuts and kept.all()):
            return
        pruned = replace(graph, pairs=graph.pairs[kept])
        graph = yield from graphs.divide(pruned, cuts, threshold)
        parent = certificate


def _round(attempt: Attempt, relaxation: Relaxation) -> Iterator[None]:
    """Try the paths that carry most of the flow; yields whenever the time is over."""
    query, corners = attempt.query, relaxation.certificate.graph.corners
    for chain in flow_chains(relaxation, _ROUNDED):
        yield from attempt.clock.wait_for(FACE_TIME * len(chain))
        path = refine(query.start, query.goal, corners[chain])
        if path_length(path) < attempt.cost * (1.0 - 1e-9):
            yield from follow(attempt, path)
        if attempt.closed:
            return
