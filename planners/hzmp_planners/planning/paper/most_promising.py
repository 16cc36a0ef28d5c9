"""The most promising leaf sequences, best first, when there are too many for all (section 3.4).

The paper keeps the K most promising ones "ranked by a geometric cost lower bound" (Yen 1971,
Eppstein 1998) and leaves the bound open. Sums of distances between consecutive faces are one; but
faces of one leaf mostly touch or nearly do, and the sums rank poorly (docs/paper.md has figures).
The weights here are lengths between one point on each face, the one that lengthens the way from
start to goal least (`least_detour`). So a sequence is ranked by the length of a path through it:
an estimate of its optimum from above, no lower bound. The lower bound of a sequence that discards
it is another one, max f*(F) over its faces (`reachable`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from heapq import heappop, heappush

import numpy as np
from scipy.sparse.csgraph import dijkstra

from hzmp_planners._arrays import Floats
from hzmp_planners._links import link_matrix
from hzmp_planners.free_space import LeafGraph
from hzmp_planners.planning.paper.breadth_first import Candidate, doors_of
from hzmp_planners.planning.roadmap import Query

Step = tuple[int, int]
"""A crossing: the shared face, and the leaf that it leads into."""
_START: Step = (-1, -1)
_GOAL: Step = (-2, -2)


class _Crossings:
    """The graph that is searched: crossings of faces as nodes, straight lines through leaves.

    Such lengths obey the triangle inequality, so that a shortest way visits no leaf twice.
    """

    def __init__(
        self, graph: LeafGraph, query: Query, points: Floats, pruned: Callable[[int], bool]
    ) -> None:
        self._graph, self._pruned = graph, pruned
        self._points: list[list[float]] = points.tolist()
        self._start: list[float] = query.start.tolist()
        self._goal: list[float] = query.goal.tolist()
        self.start_leaves = frozenset(query.start_leaves.tolist())
        self.goal_leaves = frozenset(query.goal_leaves.tolist())
        self._doors: dict[int, list[Step]] = {}
        # Shortest ways from each face to the goal: exact where nothing is barred, never too long.
        count = len(graph)
        pairs = graph.pairs[:, :2]
        last = np.unique(np.concatenate([graph.faces_at(leaf) for leaf in self.goal_leaves]))
        links = np.concatenate([pairs, np.column_stack([last, np.full(len(last), count)])])
        ends = np.concatenate([points, query.goal[None]])
        lengths = np.linalg.norm(ends[links[:, 0]] - ends[links[:, 1]], axis=1)
        matrix = link_matrix(links, count + 1, lengths)
        self._to_goal: list[float] = dijkstra(matrix, directed=False, indices=[count])[0].tolist()

    def length(self, one: Step, two: Step) -> float:
        """Of the straight line from one crossing to the next [m]."""
        p = self._start if one is _START else self._points[one[0]]
        return math.dist(p, self._goal if two is _GOAL else self._points[two[0]])

    def _rest(self, step: Step) -> float:
        return 0.0 if step is _GOAL else self._to_goal[step[0]]

    def _following(self, step: Step) -> list[Step]:
        if step is _START:
            return [way for leaf in sorted(self.start_leaves) for way in self._leaving(leaf)]
        face, leaf = step
        if leaf in self.goal_leaves:
            return [_GOAL]
        return [way for way in self._leaving(leaf) if way[0] != face]

    def _leaving(self, leaf: int) -> list[Step]:
        if leaf not in self._doors:
            self._doors[leaf] = [
                (face, into)
                for face, into in doors_of(self._graph, leaf)
                if math.isfinite(self._to_goal[face])
            ]
        return self._doors[leaf]

    def shortest(
        self, origin: Step, closed: set[int], barred: set[Step]
    ) -> tuple[float, list[Step]] | None:
        """Shortest way from a crossing to the goal (A*), the origin not included; None: no way.

        Args:
            origin: where it begins.
            closed: leaves that it must not enter.
            barred: crossings that it must not begin with.
        """
        least = {origin: 0.0}
        before: dict[Step, Step] = {}
        heap: list[tuple[float, float, Step]] = [(0.0, 0.0, origin)]
        while heap:
            _, so_far, step = heappop(heap)
            if step is _GOAL:
                way = [step]
                while (step := before[step]) is not origin:
                    way.append(step)
                return so_far, way[::-1]
            if so_far > least[step]:
                continue
            for following in self._following(step):
                if following[1] in closed or (step is origin and following in barred):
                    continue
                if following is not _GOAL and self._pruned(following[0]):
                    continue
                length = so_far + self.length(step, following)
                if length < least.get(following, math.inf):
                    least[following] = length
                    before[following] = step
                    heappush(heap, (length + self._rest(following), length, following))
        return None


def most_promising(
    graph: LeafGraph,
    query: Query,
    points: Floats,
    hop_limit: int | None,
    pruned: Callable[[int], bool],
    expired: Callable[[], bool],
) -> Iterator[Candidate]:
    """Leaf sequences that visit no leaf twice, by length through given points (Yen 1971).

    Each sequence found is left after each of its beginnings in turn, by the shortest way that no
    sequence with this beginning has taken yet.

    Args:
        graph: leaves and shared faces.
        query: start and goal, in different leaves.
        points: one on each face, shape (F, n) [m].
        hop_limit: L_max, the most leaves of a sequence.
        pruned: whether a face may not be used any more; once pruned it stays so.
        expired: asked now and then whether to stop.
    """
    crossings = _Crossings(graph, query, points, pruned)
    limit = graph.leaf_count if hop_limit is None else hop_limit
    taken: dict[tuple[Step, ...], set[Step]] = {}
    heap: list[tuple[float, list[Step], int]] = []
    first = crossings.shortest(_START, set(crossings.start_leaves), set())
    if first is not None:
        heap.append((*first, 0))
    while heap:
        _, way, since = heappop(heap)
        steps = way[:-1]
        leaves = _leaves_of(graph, steps)
        # Ways that end a barred beginning anew may visit a leaf twice: they only lead to others.
        dropped = any(pruned(face) for face, _ in steps)
        if len(set(leaves)) == len(leaves) <= limit and not dropped:
            yield Candidate(tuple(face for face, _ in steps), leaves)
        closed, length = set(crossings.start_leaves), 0.0
        for k in range(len(steps)):
            if k:
                if steps[k - 1][1] in closed or pruned(steps[k - 1][0]):
                    break
                closed.add(steps[k - 1][1])
                length += crossings.length(steps[k - 2] if k > 1 else _START, steps[k - 1])
            if k < since:
                continue
            if expired():
                return
            beginning = tuple(steps[:k])
            barred = taken.setdefault(beginning, set())
            barred.add(steps[k])
            found = crossings.shortest(steps[k - 1] if k else _START, closed, barred)
            if found is not None:
                heappush(heap, (length + found[0], steps[:k] + found[1], k))


def _leaves_of(graph: LeafGraph, steps: list[Step]) -> tuple[int, ...]:
    face, into = steps[0]
    return (int(graph.ends[face].sum()) - into, *(leaf for _, leaf in steps))
