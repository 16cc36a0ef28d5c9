"""From a polyline to a route: the faces that the best path beside it crosses."""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.free_space import FreeSpace, LeafGraph
from hzmp_planners.planning.attempt import Attempt, Route
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.planning.refine import sweep
from hzmp_planners.planning.result import path_length
from hzmp_planners.planning.roadmap import leaf_route, search_sequences

_SWEEPS = 2  # that tighten an old path at once


def follow(attempt: Attempt, path: Floats) -> Generator[None, None, None]:
    """Try the shortest route over the points on faces that a polyline (k, n) passes by.

    Yields whenever the time is over; so do the others.
    """
    active = attempt.detours < attempt.cost
    candidates = (yield from beside(attempt, path))[:, None]
    for faces in search_sequences(attempt.graph, attempt.query, candidates, active, 1):
        yield from attempt.try_sequence(faces)


def offer_known(attempt: Attempt, space: FreeSpace, path: Floats) -> Generator[None, None, bool]:
    """Offer a polyline (k, n), its ends replaced by start and goal, and what it tightens to.

    Yields whenever the time is over.

    Returns:
        Whether it is free.
    """
    query = attempt.query
    traced = space.trace(np.vstack([query.start, path[1:-1], query.goal]))
    if traced is None:
        return False
    points, leaves = traced
    attempt.offer(Route(points, leaves, path_length(points)))
    faces = faces_between(attempt.graph, leaves)
    if faces is not None:
        yield from attempt.try_sequence(faces)
    return True


def offer_swept(attempt: Attempt, space: FreeSpace, path: Floats) -> None:
    """Offer a polyline like `offer_known`, tightened by a few sweeps only: a tenth of the time."""
    query = attempt.query
    traced = space.trace(np.vstack([query.start, path[1:-1], query.goal]))
    if traced is None:
        return
    points, leaves = traced
    attempt.offer(Route(points, leaves, path_length(points)))
    faces = faces_between(attempt.graph, leaves)
    if faces:
        crossings = points[1:-1][leaves[1:] != leaves[:-1]]
        sequence, route = leaf_route(attempt.graph, query, faces)
        crossed = dict(zip(faces, crossings, strict=True))
        rough = np.array([query.start, *(crossed[face] for face in sequence), query.goal])
        swept = sweep(rough[None], attempt.graph.corners[None, list(sequence)], _SWEEPS)[0]
        attempt.offer(Route(swept, route, path_length(swept)))


def faces_between(graph: LeafGraph, leaves: Ints) -> list[int] | None:
    """The faces that lead from leaf to leaf; None where two that follow each other share none."""
    changes = np.flatnonzero(leaves[1:] != leaves[:-1])
    faces, joined = graph.joining(leaves[changes], leaves[changes + 1])
    return faces.tolist() if len(np.unique(joined)) == len(changes) else None


def beside(attempt: Attempt, path: Floats) -> Generator[None, None, Floats]:
    """On each face, the point that a path close to a polyline would cross most cheaply, (F, n).

    Of all windows of two segments of the polyline, the one whose least detour over the face adds
    least; faces outside the informed set keep their nearest point.
    """
    points = attempt.nearest.copy()
    near = np.flatnonzero(attempt.detours < attempt.cost)
    corners, added = attempt.graph.corners[near], np.full(len(near), math.inf)
    step = min(2, len(path) - 1)
    for k in range(len(path) - step):
        yield from attempt.clock.wait_for()
        window = path[k : k + step + 1]
        detour, where = least_detour(corners, window[0], window[-1])
        extra = detour - path_length(window)
        better = extra < added
        added[better] = extra[better]
        points[near[better]] = where[better]
    return points
