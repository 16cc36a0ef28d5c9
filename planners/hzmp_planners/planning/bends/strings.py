"""Short paths over lines of sight between points sampled on obstacle edges, finer and finer.

A roadmap over samples of the bend graph's pieces holds strings of all homotopy classes at once,
where faces of leaves hold one corridor after the other. It is searched lazily: only lines on ways
that would be short if nothing stopped them are tested for sight. The pairs of pieces on ways that
are still short then are few, and are sampled again, finer. The strings of each level are tightened
over their pieces and followed through the leaves.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import dijkstra

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._links import link_matrix
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.attempt import Attempt
from hzmp_planners.planning.bends.bend_graph import BendGraphs
from hzmp_planners.planning.certificate import SOURCE, TARGET, CrossingGraph
from hzmp_planners.planning.clock import Clock
from hzmp_planners.planning.follow import follow, offer_known
from hzmp_planners.planning.refine import FACE_TIME, refine
from hzmp_planners.planning.result import path_length
from hzmp_planners.planning.roadmap import chain_to

_LEVELS = ((5, 1e-2), (9, 3e-3), (17, 1e-3))
"""Samples on each piece, and how much longer than the best route a sampled string may be: it is
longer than the taut one by about the square of the spacing."""
_STRINGS = 5  # strings that are tightened at each level
_BLENDS = (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)  # how far a sampled string is tightened, if it stays free
_MOST_LINES = 1_000_000  # more take longer to list than they are worth
_LISTED, _LINES = 3e-7, 1000  # [s] to list and search a line (measured); tested for sight at a time


@dataclass(frozen=True, eq=False)
class _Roadmap:
    """Points on pieces, and lines between them."""

    points: Floats
    """The samples of piece after piece, shape (M S, 3) [m]."""
    samples: int
    """On each piece: S."""
    links: Ints
    """Numbers of the points that a line joins, shape (L, 2)."""
    lengths: Floats
    """Shape (L,) [m]."""
    pair: Ints
    """The pair of pieces that it belongs to, shape (L,)."""

    def take(self, kept: Bools) -> _Roadmap:
        """Some of the lines."""
        lines = self.links[kept], self.lengths[kept], self.pair[kept]
        return _Roadmap(self.points, self.samples, *lines)

    def within(self, limit: float) -> _Roadmap:
        """Lines on ways from start to goal shorter than the limit [m]."""
        ahead, back, _, _ = self.distances()
        tail, head = self.links.T
        return self.take(ahead[tail] + self.lengths + back[head] < limit)

    def distances(self) -> tuple[Floats, Floats, Ints, Ints]:
        """From the start and to the goal [m], and the neighbours on the way there."""
        found: list[Floats] = []
        neighbours: list[Ints] = []
        for links, root in ((self.links, SOURCE), (self.links[:, ::-1], TARGET)):
            matrix = link_matrix(links, len(self.points), self.lengths)
            roots = [root * self.samples]
            cost, before = dijkstra(matrix, indices=roots, return_predecessors=True)
            found.append(cost[0])
            neighbours.append(before[0])
        return found[0], found[1], neighbours[0], neighbours[1]


def tighten_strings(
    attempt: Attempt, space: FreeSpace, graphs: BendGraphs, graph: CrossingGraph
) -> Iterator[None]:
    """Improve the route of an attempt by strings of a bend graph; yields when the time is over.

    Args:
        attempt: has a route.
        space: its free space.
        graphs: of the query.
        graph: pieces and pairs that a path shorter than the route may use.
    """
    pairs, tried = graph.pairs, set[tuple[int, ...]]()
    for samples, slack in _LEVELS:
        if len(pairs) * samples**2 > _MOST_LINES:
            return
        yield from attempt.clock.wait_for(_LISTED * len(pairs) * samples**2)
        limit = attempt.limit * (1.0 + slack)
        lines = _sampled(graph, pairs, samples).within(limit)
        lines = lines.take(~(yield from _hidden(lines, graphs, attempt.clock))).within(limit)
        for points, nodes in _shortest(lines):
            if nodes not in tried:
                tried.add(nodes)
                yield from _tighten(attempt, space, points, graph.corners[list(nodes)])
            if attempt.closed:
                return
        pairs = pairs[np.unique(lines.pair)]


def _sampled(graph: CrossingGraph, pairs: Ints, samples: int) -> _Roadmap:
    """All lines between samples of the pieces of pairs; a piece that is a point has one."""
    share = np.linspace(0.0, 1.0, samples)[:, None]
    first, last = graph.corners[:, None, 0], graph.corners[:, None, 1]
    points = (first + share * (last - first)).reshape(-1, 3)
    slots = np.arange(samples)
    shape = (len(pairs), samples, samples)
    tail = np.broadcast_to(samples * pairs[:, 0, None, None] + slots[:, None], shape).ravel()
    head = np.broadcast_to(samples * pairs[:, 1, None, None] + slots, shape).ravel()
    number = np.arange(len(pairs)).repeat(samples**2)
    distinct = (slots == 0) | (first != last).any(axis=2)
    kept = distinct.ravel()[tail] & distinct.ravel()[head]
    links = np.column_stack([tail[kept], head[kept]])
    lengths = np.linalg.norm(points[links[:, 0]] - points[links[:, 1]], axis=1)
    return _Roadmap(points, samples, links, lengths, number[kept])


def _hidden(lines: _Roadmap, graphs: BendGraphs, clock: Clock) -> Generator[None, None, Bools]:
    """Lines that an obstacle stops, shape (L,)."""
    used, links = np.unique(lines.links, return_inverse=True)
    links = links.reshape(-1, 2)
    sight = graphs.sight(lines.points[used][:, None])

    def work(rows: slice) -> Bools:
        return sight.hidden(links[rows], 0)

    return (yield from clock.in_pieces(work, len(links), _LINES))


def _shortest(lines: _Roadmap) -> Iterator[tuple[Floats, tuple[int, ...]]]:
    """The shortest strings, each through other pieces: points (k, 3) [m], pieces in between."""
    ahead, back, before, after = lines.distances()
    through = ahead + back
    found: set[tuple[int, ...]] = set()
    for point in np.argsort(through, kind="stable").tolist():
        if not np.isfinite(through[point]) or len(found) == _STRINGS:
            return
        chain = chain_to(before, point)[::-1] + chain_to(after, point)[1:]
        nodes = tuple(number // lines.samples for number in chain[1:-1])
        if nodes not in found:
            found.add(nodes)
            yield lines.points[chain], nodes


def _tighten(attempt: Attempt, space: FreeSpace, points: Floats, pieces: Floats) -> Iterator[None]:
    """Offer a string, tightened over its pieces as far as it stays free."""
    yield from attempt.clock.wait_for(FACE_TIME * len(pieces))
    taut = refine(attempt.query.start, attempt.query.goal, pieces)
    if path_length(taut) >= attempt.limit:
        return
    for share in _BLENDS:
        yield from attempt.clock.wait_for()
        if (yield from offer_known(attempt, space, points + share * (taut - points))):
            return
    yield from follow(attempt, taut)
