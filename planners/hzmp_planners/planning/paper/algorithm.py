"""Algorithm 1 of the HZ-MP paper, line by line."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.attempt import Attempt, Route
from hzmp_planners.planning.paper.candidates import Candidates
from hzmp_planners.planning.paper.informed_faces import compute_shared_faces, generate_samples
from hzmp_planners.planning.paper.optimize import PathTable, optimize_paths
from hzmp_planners.planning.paper.reachable import (
    Detours,
    ReachableSet,
    remaining_faces,
    update_reachable_set,
)
from hzmp_planners.planning.paper.settings import Iteration, PaperSettings
from hzmp_planners.planning.result import path_length


def solve_paper(
    attempt: Attempt, space: FreeSpace, settings: PaperSettings, rng: np.random.Generator
) -> Iterator[None]:
    """Run algorithm 1 until the gap or the last iteration is reached; yields when time is over.

    Lines 1 to 5 and 7 are done: the free space is decomposed, its leaf graph holds the adjacency
    and the shared faces, and the attempt knows the leaves of start and goal. Start and goal are in
    different leaves that shared faces connect.

    Args:
        attempt: the query, its clock, and the best path so far. Its lower bound is the straight
            line, the only one that the paper has.
        space: the free space.
        settings: L_max, K, N_s and N_max.
        rng: of the samples.
    """
    graph, query = attempt.graph, attempt.query
    began = time.perf_counter()

    def expired() -> bool:
        return attempt.clock.time_left <= 0.0

    paths = Candidates(graph, query, attempt.nearest, settings, expired)  # line 6: P
    detours = Detours.of(space, query, attempt.detours)
    reachable = ReachableSet.everything(graph)  # lines 8 and 9: c_best = inf, no path
    table: PathTable | None = None
    parts = np.zeros((0, graph.n))
    number = 0  # line 10
    last = time.perf_counter()
    while number != settings.iterations and not attempt.closed:  # line 11
        while expired():
            yield
        if paths.extend() or table is None:
            if not paths.paths:
                if expired():
                    continue
                break  # L_max excludes all ways
            table = PathTable.of(paths.paths)
            parts = compute_shared_faces(graph, table.faces, reachable, attempt.nearest)  # line 18
        samples = generate_samples(parts, settings.samples, rng)  # lines 12, 13: for all p in P
        cost, waypoints, path = optimize_paths(query.start, query.goal, samples, table)  # line 14
        number += 1  # line 19
        adopted = cost < attempt.cost
        if adopted:  # lines 15 and 16
            leaves = np.array(path.leaves, dtype=np.int64)
            attempt.offer(Route(waypoints, leaves, path_length(waypoints)))
            attempt.samples.append(samples.reshape(-1, graph.n))
            reachable = update_reachable_set(query, attempt.cost, detours)  # line 17
            paths.prune(reachable)
            table = None
        if settings.observe is not None:
            settings.observe(
                Iteration(
                    number=number,
                    time_s=time.perf_counter() - began,
                    cost=cost,
                    best=attempt.cost,
                    adopted=adopted,
                    waypoints=waypoints,
                    sequences=len(paths.paths),
                    faces=len(remaining_faces(reachable)),
                    leaves=reachable.leaves,
                )
            )
        # Iterations take about equally long: one that would run over the deadline is not begun.
        before, last = last, time.perf_counter()
        if last - before > attempt.clock.time_left:
            yield
            last = time.perf_counter()
