"""The first iteration of algorithm 1 in the world of figures 1 and 4, step by step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.planning.paper.breadth_first import Candidate, find_all_connected_paths
from hzmp_planners.planning.paper.informed_faces import compute_shared_faces, generate_samples
from hzmp_planners.planning.paper.optimize import PathTable, optimize_paths
from hzmp_planners.planning.paper.reachable import (
    Detours,
    remaining_faces,
    update_reachable_set,
)
from hzmp_planners.planning.roadmap import Query
from hzmp_planners.sets import Activity, Ellipsotope
from hzmp_sim.bench.paper.worlds import PaperWorld, overview

ROUTES = 3
"""Paths that are shown, as in the paper."""
_SAMPLES = 6  # on each face
_UNFINISHED = 10_000  # breadth-first search may hold so many: far more than this world has


@dataclass(frozen=True, eq=False)
class FirstIteration:
    """What algorithm 1 holds after its first iteration."""

    world: PaperWorld
    space: FreeSpace
    samples: Floats
    """Shape (F, S, 2) [m]."""
    routes: list[tuple[float, Floats]]
    """Length and waypoints (K+1, 2) of the shortest paths, the shortest first [m]."""
    informed: Ellipsotope
    """Of the shortest path's length."""
    kept: Ints
    """Leaves that it leaves."""
    parts: Floats
    """What it leaves of the shared faces, shape (m, 2, 2) [m]."""

    @classmethod
    def run(cls) -> Self:
        """Its lines 1 to 18."""
        world = overview()
        space = world.free_space()
        graph, (s, g) = space.graph, (world.start, world.goal)
        query = Query(s, g, space.leaves_at(s), space.leaves_at(g))
        paths = find_all_connected_paths(graph, query, None, _UNFINISHED)
        assert paths is not None
        samples = generate_samples(graph.corners, _SAMPLES, np.random.default_rng(0))
        routes = _distinct(query, samples, paths)
        least, nearest = least_detour(graph.corners, s, g)
        reachable = update_reachable_set(query, routes[0][0], Detours.of(space, query, least))
        assert reachable.informed is not None
        return cls(
            world=world,
            space=space,
            samples=samples,
            routes=routes,
            informed=reachable.informed,
            kept=np.flatnonzero(reachable.leaves != Activity.INACTIVE),
            parts=compute_shared_faces(graph, remaining_faces(reachable), reachable, nearest),
        )


def _distinct(query: Query, samples: Floats, paths: list[Candidate]) -> list[tuple[float, Floats]]:
    """The shortest paths over the samples that differ from each other in more than two leaves."""
    found = []
    for path in paths:
        table = PathTable.of([path])
        cost, waypoints, _ = optimize_paths(query.start, query.goal, samples[table.faces], table)
        found.append((cost, waypoints, set(path.leaves)))
    found.sort(key=lambda one: one[0])
    chosen: list[tuple[float, Floats, set[int]]] = []
    for one in found:
        if all(len(one[2] ^ other[2]) > 2 for other in chosen):
            chosen.append(one)
    return [(cost, waypoints) for cost, waypoints, _ in chosen[:ROUTES]]
