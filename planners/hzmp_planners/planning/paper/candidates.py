"""The candidate paths P: found as they are needed, dropped as they are pruned."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space import LeafGraph
from hzmp_planners.planning.paper.breadth_first import Candidate, find_all_connected_paths
from hzmp_planners.planning.paper.most_promising import most_promising
from hzmp_planners.planning.paper.reachable import ReachableSet
from hzmp_planners.planning.paper.settings import PaperSettings
from hzmp_planners.planning.roadmap import Query
from hzmp_planners.sets import Activity

_FIRST = 1  # sequences in the first iteration, for an early path; each later one may double them


class Candidates:
    """At most K leaf sequences, the most promising of those that may still improve c_best.

    Where all sequences are few, breadth-first search finds them all; otherwise they come from a
    ranked search. A pruned one makes room for the next in rank.
    """

    def __init__(
        self,
        graph: LeafGraph,
        query: Query,
        points: Floats,
        settings: PaperSettings,
        expired: Callable[[], bool],
    ) -> None:
        """Look for all sequences; nothing is a candidate before `extend`.

        Args:
            graph: leaves and shared faces.
            query: start and goal, in different leaves.
            points: one on each face, through which sequences are ranked, shape (F, n) [m].
            settings: K and L_max.
            expired: whether the time is up.
        """
        self.paths: list[Candidate] = []
        self._inactive = [False] * len(graph)
        self._most = settings.sequences
        found = find_all_connected_paths(graph, query, settings.hop_limit, settings.sequences)
        self._ranked: Iterator[Candidate]
        if found is None:
            self._ranked = most_promising(
                graph, query, points, settings.hop_limit, self._pruned, expired
            )
        else:
            found.sort(key=lambda path: _estimate(path, query, points))
            self._ranked = iter(found)

    def _pruned(self, face: int) -> bool:
        return self._inactive[face]

    def _allows(self, path: Candidate) -> bool:
        return not any(map(self._pruned, path.faces))

    def extend(self) -> bool:
        """Take in the next sequences in rank; whether there were any."""
        room = min(self._most - len(self.paths), max(_FIRST, len(self.paths)))
        before = len(self.paths)
        while room > 0 and (path := next(self._ranked, None)) is not None:
            if self._allows(path):
                self.paths.append(path)
                room -= 1
        return len(self.paths) > before

    def prune(self, reachable: ReachableSet) -> None:
        """Lines 11 to 15 of algorithm 2: P_E has the paths that use no pruned face."""
        self._inactive = (reachable.faces == Activity.INACTIVE).tolist()
        self.paths = [path for path in self.paths if self._allows(path)]


def _estimate(path: Candidate, query: Query, points: Floats) -> float:
    """Length of a path through the given points [m]."""
    way = [query.start, *points[list(path.faces)], query.goal]
    return float(sum(np.linalg.norm(q - p) for p, q in pairwise(way)))
