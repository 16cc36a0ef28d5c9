"""The bend graph: pieces of obstacle edges, and which of them a short path may join straight.

A shortest path around convex obstacles in 3-D is a taut string: it bends at edges and is straight
in between (Sharir and Schorr 1986). Edges are far fewer than shared faces, and a string visits
fewer of them, so relaxing over them is cheaper and tighter. Every obstacle edge that meets the
informed set is a node unless other obstacles cover it; every two nodes are a pair unless something
excludes it:

- they lie on one line (a string along it also bends at other edges there);
- the way from start over both to goal is too long;
- no string is taut there: all lines of sight leave an edge on the outer side of both its facets,
  or on the inner side of both, into the obstacle (at a vertex of three facets one of the edges
  has the string on different sides; vertices of more facets are nodes of their own);
- they cannot see each other.

Obstacles are open sets here: between two that touch a string passes, although the leaf graph has
no door there. The bound is valid all the same, only lower.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.distance import cdist

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.bends.blockers import Blockers, any_touch, build_blockers
from hzmp_planners.planning.bends.edges import Edges, obstacle_edges
from hzmp_planners.planning.bends.exposure import exposed_edges
from hzmp_planners.planning.bends.sight import Sight
from hzmp_planners.planning.certificate import SOURCE, TARGET, CrossingGraph, Cuts
from hzmp_planners.planning.clock import Clock
from hzmp_planners.planning.crossings import prune_pairs, short_pairs, split_nodes
from hzmp_planners.planning.relaxation import Relaxation
from hzmp_planners.planning.rounding import mixing_points

_MARGIN = 1e-9
"""Depth inside a body that stops a line of sight [m at S = 1]."""
_OFF_PLANE = 1e-9
"""Height above or below a facet plane that counts [m at S = 1]."""
_ON_LINE = 1e-12
"""Distance from an edge's line that is none [m at S = 1]: round-off of coordinates. Heights above
the edge's facets would not do: near a sharp edge or a flat ridge they are next to nothing, too."""
_SHORTEST = 1e-4  # pieces shorter than this are not cut for sight's sake [m at S = 1]
_LEAST_FLOW = 1e-3  # flow below this is not worth a cut
_MOST_PIECES = 1500  # their pairs are compared all at once
_JOINED, _SEEN = 4000, 150  # pairs that are compared in other ways at a time
_EXPOSED = 4e-6  # [s] to find the exposed parts of one edge (measured)
_PREPARED = 1e-4  # [s] to list the edges of one obstacle, and whether it touches others (measured)


@dataclass(frozen=True, eq=False)
class BendWorld:
    """Edges and blockers of a free space, found once for all queries in it."""

    space: FreeSpace

    @cached_property
    def edges(self) -> Edges:
        """All edges of all obstacles."""
        return obstacle_edges(self.space.obstacles)

    @cached_property
    def blockers(self) -> Blockers:
        """The obstacles."""
        return build_blockers(self.space.obstacles)

    def prepare(self, clock: Clock) -> Generator[None, None, None]:
        """Find all that is asked for below, unless it is known; yields while there is no time."""
        if "cracked" not in vars(self):
            yield from clock.wait_for(_PREPARED * len(self.space.obstacles))
            _ = self.edges, self.cracked

    @cached_property
    def cracked(self) -> bool:
        """Whether obstacles touch, so that a string may pass where no path does."""
        return any_touch(self.blockers, PLANE_TOL * self.space.scale)


class BendGraphs:
    """The bend graphs of one query: the first one, and finer ones whose pieces are divided."""

    def __init__(self, world: BendWorld, start: Floats, goal: Floats, clock: Clock) -> None:
        self._world, self._foci, self._clock = world, (start, goal), clock
        self._scale = world.space.scale

    def build(self, threshold: float) -> Generator[None, None, CrossingGraph | None]:
        """Everything that a path shorter than the threshold may do; None where that is too much."""
        world, foci = self._world, self._foci
        bounds, scale = world.space.bounds, self._scale
        yield from self._clock.wait_for(_EXPOSED * len(world.edges))
        edges = exposed_edges(world.edges, world.blockers, bounds, foci, threshold, scale)
        if len(edges) > _MOST_PIECES:
            return None
        middle, reach = (foci[0] + foci[1]) / 2.0, threshold / 2.0
        self._blockers = world.blockers.within(middle - reach, middle + reach)
        self._normals = np.concatenate([np.zeros((2, 2, 3)), edges.normals])
        pieces = np.concatenate([np.array([[foci[0]] * 2, [foci[1]] * 2]), edges.ends])
        tail, head = np.nonzero(_short_enough(pieces, foci, threshold))
        number, pairs = np.arange(len(pieces)), np.column_stack([tail, head])
        owner, facets = (np.append([-1, -1], part) for part in (edges.owner, edges.facets))
        graph = CrossingGraph(pieces, number, owner, facets, pairs, "edges")
        return (yield from self._without_excluded(graph, np.ones(len(pieces), dtype=np.bool_)))

    def loose_points(self, relaxation: Relaxation) -> Cuts:
        """Pieces that the flow joins by a blocked line of sight, and those on which it mixes."""
        graph = relaxation.certificate.graph
        used = np.flatnonzero(relaxation.flow > _LEAST_FLOW)
        points = np.concatenate([relaxation.tails[used], relaxation.heads[used]])[:, None]
        number = np.arange(len(used))
        sight = np.column_stack([number, number + len(used)])
        blocked = self.sight(points).hidden(sight, 0)
        cuts = mixing_points(relaxation)
        order = np.argsort(-relaxation.flow[used[blocked]], kind="stable")
        for row in used[blocked][order][: len(graph.corners)].tolist():
            ends = (relaxation.tails[row], relaxation.heads[row])
            for node, point in zip(graph.pairs[row].tolist(), ends, strict=True):
                if node > TARGET and node not in cuts:
                    cut = _cut_at(graph.corners[node], point, _SHORTEST * self._scale)
                    if cut is not None:
                        cuts[node] = cut
        return cuts

    def divide(
        self, graph: CrossingGraph, cuts: Cuts, threshold: float
    ) -> Generator[None, None, CrossingGraph]:
        """Cut pieces in two, and leave out what the halves exclude."""
        divided = split_nodes(graph, cuts)
        short = yield from short_pairs(divided, threshold, self._clock)
        changed = np.arange(len(divided.corners)) >= len(graph.corners)
        changed[list(cuts)] = True
        divided = replace(divided, pairs=divided.pairs[short])
        return (yield from self._without_excluded(divided, changed))

    def _without_excluded(
        self, graph: CrossingGraph, changed: Bools
    ) -> Generator[None, None, CrossingGraph]:
        """Without pairs, one of them a changed node, that no taut string joins."""
        kept = np.ones(len(graph.pairs), dtype=np.bool_)
        rows = np.flatnonzero(changed[graph.pairs].any(axis=1))
        normals, sight = self._normals[graph.face], self.sight(graph.corners)

        def slack(part: slice) -> Bools:
            return never_joined(graph.corners, normals, graph.pairs[rows[part]], self._scale)

        def blocked(part: slice) -> Bools:
            return sight.hidden(graph.pairs[rows[part]])

        for excluded, size in ((slack, _JOINED), (blocked, _SEEN)):
            gone = yield from self._clock.in_pieces(excluded, len(rows), size)
            kept[rows[gone]] = False
            rows = rows[~gone]
        return prune_pairs(graph, kept)

    def sight(self, pieces: Floats) -> Sight:
        """Among the obstacles that may stop a line of sight, after `build`."""
        return Sight(pieces, self._blockers, _MARGIN * self._scale)


def _cut_at(piece: Floats, point: Floats, shortest: float) -> tuple[Floats, Floats] | None:
    """Cut a piece at a point of it, in the middle if that is near an end; None when too short."""
    along = piece[1] - piece[0]
    length = float(np.linalg.norm(along))
    if length < shortest:
        return None
    share = float((point - piece[0]) @ along) / length**2
    if not 0.2 <= share <= 0.8:
        share = 0.5
    return piece[0] + share * along, along / length


def _short_enough(pieces: Floats, foci: tuple[Floats, Floats], threshold: float) -> Bools:
    """Pairs (P, P) whose balls a path shorter than the threshold may visit one after the other."""
    middle = pieces.mean(axis=1)
    radius = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1) / 2.0
    ahead, back = (np.linalg.norm(middle - focus, axis=1) - radius for focus in foci)
    # Squares and products would lose half of the digits between points that are near each other.
    between = np.maximum(cdist(middle, middle) - radius[:, None] - radius, 0.0)
    short = ahead[:, None] + between + back < threshold * (1.0 + 1e-9)
    short[TARGET] = short[:, SOURCE] = False
    np.fill_diagonal(short, False)
    return np.asarray(short)


def never_joined(pieces: Floats, normals: Floats, pairs: Ints, scale: float) -> Bools:
    """Pairs that no taut string joins straight, shape (E,): see the reasons above.

    Args:
        pieces: shape (P, 2, 3) [m].
        normals: of the facets at each piece, shape (P, 2, 3); zero at start and goal.
        pairs: shape (E, 2).
        scale: size of the world's coordinates [m].
    """
    excluded = np.zeros(len(pairs), dtype=np.bool_)
    for here, there in (pairs.T, pairs.T[::-1]):
        away = pieces[there] - pieces[here, :1]
        along = pieces[here, 1] - pieces[here, 0]
        length = np.linalg.norm(along, axis=1)
        aside = np.linalg.norm(np.cross(away, along[:, None]), axis=2).max(axis=1)
        heights = np.einsum("ekn,emn->emk", away, normals[here])
        outside = (heights > _OFF_PLANE * scale).all(axis=(1, 2))
        inside = (heights < -_OFF_PLANE * scale).all(axis=(1, 2))
        on_line = (aside <= _ON_LINE * scale * length) & (length > 0.0)
        excluded |= outside | inside | on_line
    return excluded
