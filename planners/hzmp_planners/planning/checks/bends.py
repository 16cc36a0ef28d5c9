"""Checking that bend graphs hold every taut string shorter than their thresholds.

A shortest path bends only at obstacle edges. Where several obstacles touch one point, a shortcut
past the bend, within the plane of its two segments, is stopped by a single one of them. So two
facets of that obstacle have the string above one of their planes and below the other, on one side
of the bend this way round and on the other side that way. The two share an edge, except at a vertex
of more than three facets. The workspace is convex: its walls bend nothing.

So it is enough that the nodes of the first graph cover every edge and every such vertex, and that
a pair of nodes that is not there is on no short way, or never taut, or out of sight. Nodes that are
on no way from start to goal may be missing, too.
"""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.certificate import SOURCE, TARGET, CrossingGraph
from hzmp_planners.planning.checks.detours import detour_bounds, reached, short_part
from hzmp_planners.planning.checks.edge_list import Edge, list_edges, open_parts, overlap, without
from hzmp_planners.planning.checks.taut import Sight, never_taut, too_long

_TINY = 1e-10
"""Lengths that are none [m at S = 1]: a tenth of what the planner takes for none, so that nothing
that is needed here can have been left out there by round-off."""
_BESIDE = 1e-8
"""Nodes at most this far beside an edge are on it, and cover what is at most this far beyond their
ends [m at S = 1]: vertices this near to each other are not told apart."""

_Role = tuple[int, Edge]
"""A node of the first graph, and the edge that it is (a part of)."""


class BendCheck:
    """What the nodes of the bend graphs of one query stand for, and what may be missing in them."""

    def __init__(
        self, space: FreeSpace, foci: tuple[Floats, Floats], first: CrossingGraph, limit: float
    ) -> None:
        """Match the first graph of a chain with the edges of a free space.

        Args:
            space: where the obstacles are.
            foci: start and goal of the query, each (3,) [m].
            first: the first graph.
            limit: ways this long or longer need not be in it [m].
        """
        self._space, self._foci, self._limit = space, foci, limit
        self._tiny = _TINY * space.scale
        self._sight = Sight(space.obstacles, self._tiny)
        numbers = first.face.tolist()
        roles = self._match(first) if self._is_of_query(first) else None
        self.complete = roles is not None
        """Whether every way shorter than the limit is in the first graph."""
        self._edges_of: dict[int, list[Edge]] = {}
        for node, edge in roles or []:
            self._edges_of.setdefault(numbers[node], []).append(edge)

    def never_joined(self, graph: CrossingGraph, pairs: Ints) -> Bools:
        """Pairs of (parts of) nodes of the first graph that no taut string joins, shape (E,).

        Where a node may stand for several edges the reason must hold for each of them; one that
        stands for none is not needed at all.
        """
        never = np.zeros(len(pairs), dtype=np.bool_)
        face = graph.face.tolist()
        for here, there in (pairs.T, pairs.T[::-1]):
            for node in np.unique(here[here > TARGET]).tolist():
                rows = np.flatnonzero(here == node)
                excluded = np.ones(len(rows), dtype=np.bool_)
                for edge in self._edges_of.get(face[node], []):
                    excluded &= never_taut(
                        edge, graph.corners[node], graph.corners[there[rows]], self._tiny
                    )
                never[rows] |= excluded
        rows = np.flatnonzero(~never)
        never[rows] = self._sight.blocked(graph.corners, pairs[rows])
        return never

    def _is_of_query(self, first: CrossingGraph) -> bool:
        """Whether a graph begins with start and goal, and its nodes are segments told apart."""
        terminals = np.array([[focus, focus] for focus in self._foci])
        apart = len(set(first.face.tolist())) == len(first.corners)
        return self._space.n == 3 and apart and np.array_equal(first.corners[:2], terminals)

    def _match(self, first: CrossingGraph) -> list[_Role] | None:
        """What the nodes stand for; None if something is missing in the graph."""
        edges = self._short_edges()
        roles = [(node, edge) for edge in edges for node in self._nodes_on(first, edge).tolist()]
        parts = self._not_covered(first, edges, roles)
        nodes = [SOURCE, TARGET, *(node for node, _ in roles)]
        pieces = np.concatenate([first.corners[nodes], *(ends[None] for ends, _ in parts)])
        bends = [None, None, *(edge for _, edge in roles), *(edge for _, edge in parts)]
        present = np.zeros((len(first.corners),) * 2, dtype=np.bool_)
        present[tuple(first.pairs.T)] = True
        there = np.zeros((len(pieces),) * 2, dtype=np.bool_)
        # In two roles a node is visited once all the same.
        same = np.equal.outer(nodes, nodes)
        there[: len(nodes), : len(nodes)] = present[np.ix_(nodes, nodes)] | same
        missing = self._unexplained(pieces, bends, there)
        ways = np.concatenate([np.argwhere(there), missing])
        useful = reached(ways, SOURCE, len(pieces)) & reached(ways[:, ::-1], TARGET, len(pieces))
        return None if useful[missing].all(axis=1).any() else roles

    def _short_edges(self) -> list[Edge]:
        """Edges that a way shorter than the limit can touch."""
        edges = list_edges(self._space.obstacles)
        ends = np.array([edge.ends for edge in edges]).reshape(-1, 2, 3)
        near = detour_bounds(ends, *self._foci) < self._limit
        return [edges[k] for k in np.flatnonzero(near).tolist()]

    def _nodes_on(self, first: CrossingGraph, edge: Edge) -> Ints:
        """Nodes that lie on an edge, and have its name or none; vertices are on vertices only."""
        point = (first.corners[:, 0] == first.corners[:, 1]).all(axis=1)
        nameless = (first.out_of == -1) & (point == (len(edge.normals) == 0))
        named = nameless | ((first.out_of == edge.facets) & (first.out_of != -1))
        named &= first.into == edge.owner
        named[[SOURCE, TARGET]] = False
        nodes = np.flatnonzero(named)
        share, aside = _along(edge, first.corners[nodes])
        off = np.linalg.norm(np.diff(edge.ends, axis=0)) * np.maximum(-share, share - 1.0)
        on = (np.maximum(aside, off) <= _BESIDE * self._space.scale).all(axis=1)
        return np.asarray(nodes[on])

    def _not_covered(
        self, first: CrossingGraph, edges: list[Edge], roles: list[_Role]
    ) -> list[tuple[Floats, Edge]]:
        """Parts (2, 3) of edges that no node covers, and the edge of each."""
        nodes_of: dict[Edge, list[int]] = {}
        for node, edge in roles:
            nodes_of.setdefault(edge, []).append(node)
        lows, highs = (np.array(side) for side in zip(*self._space.obstacle_boxes, strict=True))
        parts: list[tuple[Floats, Edge]] = []
        for edge in edges:
            near = (lows < edge.ends.max(axis=0)).all(axis=1)
            near &= (highs > edge.ends.min(axis=0)).all(axis=1)
            near[edge.owner] = False
            others = [self._space.obstacles[k] for k in np.flatnonzero(near).tolist()]
            share, _ = _along(edge, first.corners[nodes_of.get(edge, [])])
            length = float(np.linalg.norm(edge.ends[1] - edge.ends[0]))
            beside = _BESIDE * self._space.scale
            wider = beside / max(length, 0.5 * beside)  # any node on a vertex covers it
            covers = [(low - wider, high + wider) for low, high in np.sort(share).tolist()]
            short = short_part(edge.ends, *self._foci, self._limit)
            bare = open_parts(edge, others, self._space.bounds, self._tiny)
            for part in without(overlap(bare, short), covers):
                shares = np.array(part)[:, None]
                parts.append(((1.0 - shares) * edge.ends[0] + shares * edge.ends[1], edge))
        return parts

    def _unexplained(self, pieces: Floats, edges: list[Edge | None], there: Bools) -> Ints:
        """Pairs of pieces that are not there although a short string may join them, (E, 2)."""
        settled = there | too_long(pieces, self._limit)
        for number, edge in enumerate(edges):
            if edge is not None:
                never = never_taut(edge, pieces[number], pieces, self._tiny)
                settled[number] |= never
                settled[:, number] |= never
        pairs = np.argwhere(~settled)
        return np.asarray(pairs[~self._sight.blocked(pieces, pairs)])


def _along(edge: Edge, points: Floats) -> tuple[Floats, Floats]:
    """Share of the way along an edge, and distance beside it [m], of points (..., 3)."""
    axis = edge.ends[1] - edge.ends[0]
    offset = points - edge.ends[0]
    share = offset @ axis / max(float(axis @ axis), 1e-300)
    return share, np.linalg.norm(offset - share[..., None] * axis, axis=-1)
