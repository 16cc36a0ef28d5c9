"""Finding short paths: sample faces, search, refine, and again where it could still pay."""

from __future__ import annotations

from collections.abc import Generator, Iterator

import numpy as np

from hzmp_planners.planning.attempt import Attempt
from hzmp_planners.planning.follow import beside
from hzmp_planners.planning.refine import SWEEP_TIME, rank_together
from hzmp_planners.planning.roadmap import FaceSequence, sample_faces, search_sequences, search_time

_ROUNDS = 12
_CANDIDATES = 64  # distinct sequences that are ranked in each round
_SWEEPS = 6  # of the joint ranking
_REFINED = 5  # sequences that are refined exactly in each round
_UNIFORM = 2  # random samples on each face

FINE, COARSE = 1e-5, 1e-3
"""Relative gain of a round that is worth another one; where better ways to improve follow."""


def explore(attempt: Attempt, rng: np.random.Generator, gain: float = FINE) -> Iterator[None]:
    """Improve the route of an attempt until rounds gain nothing; yields when the time is over.

    Each round samples the faces that the best cost leaves active: near the best route, where the
    straight line is left least, and uniformly at random.

    Args:
        attempt: what is improved.
        rng: source of randomness.
        gain: relative, of a round that is worth another one.
    """
    graph, query = attempt.graph, attempt.query
    n = query.start.size
    candidates = attempt.nearest[:, None]
    for number in range(_ROUNDS):
        before = attempt.cost
        active = attempt.detours < attempt.limit
        attempt.samples.append(candidates[active].reshape(-1, n))
        most = _CANDIDATES if number else 1
        needed = search_time(graph, active, candidates.shape[1], most)
        yield from attempt.clock.wait_for(needed)
        found = search_sequences(graph, query, candidates, active, most)
        for faces in (yield from _most_promising(attempt, found)):
            yield from attempt.try_sequence(faces)
            if attempt.closed:
                return
        idle = number > 1 and attempt.cost > before * (1.0 - gain)
        if idle:
            return
        yield from attempt.clock.wait_for()
        uniform = sample_faces(graph.corners, _UNIFORM, rng)
        route, nearest = attempt.route, attempt.nearest
        by_route = nearest if route is None else (yield from beside(attempt, route.waypoints))
        known = [by_route[:, None], nearest[:, None]]
        candidates = np.concatenate([*known, uniform], axis=1)


def _most_promising(
    attempt: Attempt, found: list[FaceSequence]
) -> Generator[None, None, list[FaceSequence]]:
    """The sequences worth an exact refinement: those shortest after a few joint sweeps."""
    fresh = attempt.untried(found)
    if len(fresh) <= 1:
        return fresh
    query = attempt.query
    routes = [attempt.graph.corners[list(faces)] for faces in fresh]
    faces = sum(len(route) for route in routes)
    yield from attempt.clock.wait_for(SWEEP_TIME * _SWEEPS * faces)
    lengths = rank_together(query.start, query.goal, routes, _SWEEPS)
    return [fresh[i] for i in np.argsort(lengths, kind="stable")[:_REFINED].tolist()]
