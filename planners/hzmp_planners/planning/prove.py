"""Proving a lower bound: relax, prune what it excludes, divide faces where it is loose."""

from __future__ import annotations

import time
from dataclasses import replace

from hzmp_planners.planning.attempt import Attempt
from hzmp_planners.planning.certificate import Certificate, Cuts
from hzmp_planners.planning.crossings import (
    build_crossings,
    prune_pairs,
    split_nodes,
    three_leg_bounds,
)
from hzmp_planners.planning.relaxation import solve_relaxation
from hzmp_planners.planning.rounding import flow_sequences, mixing_points

_ROUNDED = 5  # sequences taken from each flow
_DIVIDED = 6  # every so many'th face is divided in each round
_FEW_PAIRS = 500  # up to here a relaxation of everything below the cost is cheap
_MOST_PAIRS = 12_000  # more take Clarabel longer than any query waits
_PAIR_TIME = 4e-5  # [s] that Clarabel takes for a pair, at the least (measured, in 3-D)
_GROWTH = 1.2  # exponent of its time over the number of pairs (measured)


def prove(attempt: Attempt) -> None:
    """Raise the bound of an attempt until its gap is closed or the time is up.

    The flow of each relaxation is rounded into sequences, which improve the route too.
    """
    query, leaf_graph = attempt.query, attempt.graph
    threshold = attempt.cost
    graph = build_crossings(leaf_graph, query, attempt.detours < threshold, threshold)
    if len(graph.pairs) > _FEW_PAIRS:
        # Paths longer than this need no bound of their own: the gap is closed at it.
        threshold = attempt.target
        graph = build_crossings(leaf_graph, query, attempt.detours < threshold, threshold)
    parent: Certificate | None = None
    cuts: Cuts = {}
    pair_time = _PAIR_TIME
    while not attempt.done:
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
        for faces in flow_sequences(relaxation, _ROUNDED):
            if attempt.done:
                return
            attempt.try_sequence(faces)
        threshold = min(threshold, attempt.target)
        cuts = mixing_points(relaxation, max(4, len(graph.corners) // _DIVIDED))
        kept = certificate.least_through() < threshold
        if not cuts and kept.all():
            return
        divided = split_nodes(replace(graph, pairs=graph.pairs[kept]), cuts)
        graph = prune_pairs(divided, three_leg_bounds(divided) < threshold)
        parent = certificate
