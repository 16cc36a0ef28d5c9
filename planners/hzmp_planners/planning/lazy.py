"""Paths under a veto: a roadmap whose edges are asked about only when a path would use them.

The veto is a black box, so nothing can be proved about what it leaves. As in lazy roadmaps (Bohlin
and Kavraki 2000) the shortest sampled path is asked about, segment by segment, and searched again
without the segments that are forbidden; more samples follow while they shorten it.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from scipy.sparse.csgraph import dijkstra

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._links import link_matrix
from hzmp_planners.planning.attempt import Attempt, Route
from hzmp_planners.planning.refine import refine
from hzmp_planners.planning.result import path_length
from hzmp_planners.planning.roadmap import GOAL, START, chain_to, roadmap, sample_faces, search_time

_FIRST, _MOST = 1, 32  # random samples on each face: in the first round, at the most
_IDLE = 3  # rounds without gain before it is given up
_GAIN = 1e-4  # relative, of a round worth another one
_BLENDS = (1.0, 0.75, 0.5, 0.25)  # how far a sampled path is moved to the shortest over its faces


def explore_with_veto(attempt: Attempt, rng: np.random.Generator) -> Iterator[None]:
    """Find short paths all of whose segments are allowed; yields when the time is over."""
    graph, query = attempt.graph, attempt.query
    count, idle = _FIRST, 0
    while idle < _IDLE:
        before = attempt.cost
        active = attempt.detours < before
        yield from attempt.clock.wait_for(search_time(graph, active, count + 1, 1))
        samples = sample_faces(graph.corners, count, rng)
        samples = np.concatenate([attempt.nearest[:, None], samples], axis=1)
        nodes, links, lengths = roadmap(graph, query, samples, active)
        while (path := _shortest(links, lengths, len(nodes))) is not None:
            yield from attempt.clock.wait_for()
            points = nodes[path]
            if path_length(points) >= attempt.cost:
                break
            forbidden = [attempt.forbids(p, q) for p, q in pairwise(points)]
            if not any(forbidden):
                _take(attempt, points, [(node - 2) // samples.shape[1] for node in path[1:-1]])
                break
            for k in np.flatnonzero(forbidden).tolist():
                used = (links == sorted(path[k : k + 2])).all(axis=1)
                links, lengths = links[~used], lengths[~used]
        idle = 0 if attempt.cost < before * (1.0 - _GAIN) else idle + 1
        count = min(2 * count, _MOST)


def _shortest(links: Ints, lengths: Floats, nodes: int) -> list[int] | None:
    """Nodes of the shortest way from start to goal."""
    matrix = link_matrix(links, nodes, lengths)
    cost, before = dijkstra(matrix, directed=False, indices=[START], return_predecessors=True)
    return chain_to(before[0], GOAL)[::-1] if np.isfinite(cost[0, GOAL]) else None


def _take(attempt: Attempt, points: Floats, faces: list[int]) -> None:
    """Offer a path over faces, then what lies between it and the shortest over the same faces."""
    graph, query = attempt.graph, attempt.query
    doors = [query.start_leaves, *graph.ends[faces], query.goal_leaves]
    leaves = [np.intersect1d(a, b)[0] for a, b in pairwise(doors)]
    held = np.array(leaves, dtype=np.int64)
    attempt.offer(Route(points, held, path_length(points)))
    shortest = refine(query.start, query.goal, graph.corners[faces], attempt.clock.time_left)
    for share in _BLENDS:
        blend = points + share * (shortest - points)
        attempt.offer(Route(blend, held, path_length(blend)))
