"""Building the crossing graph, pruning it with distance bounds, and splitting its faces."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from scipy.sparse.csgraph import breadth_first_order

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._links import link_matrix
from hzmp_planners._polygons import clip_polygon
from hzmp_planners.free_space import LeafGraph
from hzmp_planners.planning.certificate import SOURCE, TARGET, CrossingGraph, Cuts
from hzmp_planners.planning.clock import Clock
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.planning.relaxation import Relaxation
from hzmp_planners.planning.roadmap import Query
from hzmp_planners.planning.rounding import mixing_points

_BOUNDED = 1000  # pairs whose bounds are found at a time
_LISTED = 2e-5  # [s] to list the crossings that may follow those of a face (measured)


class CrossingGraphs:
    """The crossing graphs that follow a first one, with faces divided."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def loose_points(self, relaxation: Relaxation) -> Cuts:
        """The faces on which flows mix most, at their mean points."""
        return mixing_points(relaxation)

    def divide(
        self, graph: CrossingGraph, cuts: Cuts, threshold: float
    ) -> Generator[None, None, CrossingGraph]:
        """Cut faces in two, and leave out what the halves exclude."""
        divided = split_nodes(graph, cuts)
        return prune_pairs(divided, (yield from short_pairs(divided, threshold, self._clock)))


def build_crossings(
    graph: LeafGraph, query: Query, detours: Floats, threshold: float, clock: Clock
) -> Generator[None, None, CrossingGraph]:
    """All directed crossings of faces that a path shorter than `threshold` may make.

    Args:
        graph: leaves and shared faces.
        query: start and goal.
        detours: f* of each face, shape (F,) [m].
        threshold: faces and pairs that only paths this long or longer use are left out [m].
        clock: yields whenever its time is over.
    """
    faces = np.flatnonzero(detours < threshold)
    yield from clock.wait_for(_LISTED * len(faces))
    ends, n = graph.ends[faces], query.start.size
    k = graph.corners.shape[1]
    terminals = np.array([[query.start] * k, [query.goal] * k])
    corners = np.concatenate([terminals, graph.corners[faces], graph.corners[faces]])
    out_of = np.concatenate([[-1, -1], ends[:, 0], ends[:, 1]])
    into = np.concatenate([[-1, -1], ends[:, 1], ends[:, 0]])
    face = np.concatenate([[-1, -1], faces, faces])
    leaving: dict[int, list[int]] = {}
    for node, leaf in enumerate(out_of.tolist()):
        leaving.setdefault(leaf, []).append(node)
    tails: list[Ints] = []
    heads: list[Ints] = []
    for node, leaf in enumerate(into.tolist()):
        exits = leaving.get(leaf, []) if node > TARGET else []
        heads.append(np.array([j for j in exits if face[j] != face[node]], dtype=np.int64))
        tails.append(np.full(len(heads[-1]), node))
    first = np.flatnonzero(np.isin(out_of, query.start_leaves))
    last = np.flatnonzero(np.isin(into, query.goal_leaves))
    tails += [np.full(len(first), SOURCE), last]
    heads += [first, np.full(len(last), TARGET)]
    pairs = np.column_stack([np.concatenate(tails), np.concatenate(heads)]).astype(np.int64)
    whole = CrossingGraph(corners.reshape(-1, k, n), face, into, out_of, pairs)
    return prune_pairs(whole, (yield from short_pairs(whole, threshold, clock)))


def short_pairs(
    graph: CrossingGraph, threshold: float, clock: Clock
) -> Generator[None, None, Bools]:
    """Pairs that a path shorter than the threshold [m] may use, shape (E,)."""

    def work(rows: slice) -> Bools:
        return np.asarray(three_leg_bounds(graph, graph.pairs[rows]) < threshold)

    return (yield from clock.in_pieces(work, len(graph.pairs), _BOUNDED))


def three_leg_bounds(graph: CrossingGraph, pairs: Ints) -> Floats:
    """Lower bound of |x - s| + |z - x| + |g - z| over the faces of each pair, shape (E,) [m].

    |v| >= u.v for unit u makes the sum linear, minimal at vertices; the directions u are those of
    a nearly optimal x and z, found by two rounds of exact detours.

    Args:
        graph: nodes.
        pairs: shape (E, 2).
    """
    s, g = graph.corners[SOURCE, 0], graph.corners[TARGET, 0]
    tail, head = graph.corners[pairs[:, 0]], graph.corners[pairs[:, 1]]
    _, z = least_detour(head, s, g)
    _, x = least_detour(tail, s, z)
    _, z = least_detour(head, x, g)
    _, x = least_detour(tail, s, z)
    first, last = _unit(x - s), _unit(g - z)
    middle = _unit(z - x)
    still = (np.linalg.norm(z - x, axis=1) < 1e-12)[:, None]
    middle = np.where(still, (first + last) / 2.0, middle)
    ahead = np.einsum("ekn,en->ek", tail, first - middle).min(axis=1)
    behind = np.einsum("ekn,en->ek", head, middle - last).min(axis=1)
    return np.asarray(ahead + behind - first @ s + last @ g)


def _unit(v: Floats) -> Floats:
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return np.asarray(v / np.where(length > 0.0, length, 1.0))


def prune_pairs(graph: CrossingGraph, kept: Bools) -> CrossingGraph:
    """Keep some pairs, then only what still lies on a way from start to goal."""
    pairs = graph.pairs[kept]
    count = len(graph.corners)
    ahead = np.zeros(count, dtype=np.bool_)
    back = np.zeros(count, dtype=np.bool_)
    for reached, ways, root in ((ahead, pairs, SOURCE), (back, pairs[:, ::-1], TARGET)):
        links = link_matrix(ways, count)
        reached[breadth_first_order(links, root, return_predecessors=False)] = True
    alive = ahead & back
    alive[[SOURCE, TARGET]] = True
    pairs = pairs[alive[pairs[:, 0]] & alive[pairs[:, 1]]]
    number = np.cumsum(alive) - 1
    return CrossingGraph(
        graph.corners[alive],
        graph.face[alive],
        graph.into[alive],
        graph.out_of[alive],
        number[pairs],
        graph.over,
    )


def split_nodes(graph: CrossingGraph, cuts: Cuts) -> CrossingGraph:
    """Cut faces in two; both halves keep the pairs of the whole.

    The relaxation averages the flows that meet on one face; two faces cannot be averaged.

    Args:
        graph: crossing graph.
        cuts: where to cut which nodes.
    """
    extra: list[Floats] = []
    parents: list[int] = []
    corners = list(graph.corners)
    for node, (point, direction) in cuts.items():
        height = (graph.corners[node] - point) @ direction
        corners[node] = clip_polygon(graph.corners[node], height)
        extra.append(clip_polygon(graph.corners[node], -height))
        parents.append(node)
    rows = corners + extra
    width = max(len(row) for row in rows)
    padded = np.array([row[np.minimum(np.arange(width), len(row) - 1)] for row in rows])
    origin = np.array(parents, dtype=np.int64)
    clone = np.full(len(graph.corners), -1)
    clone[origin] = len(graph.corners) + np.arange(len(origin))
    pairs = [graph.pairs]
    tail, head = graph.pairs.T
    both = (clone[tail] >= 0) & (clone[head] >= 0)
    pairs.append(np.column_stack([clone[tail], head])[clone[tail] >= 0])
    pairs.append(np.column_stack([tail, clone[head]])[clone[head] >= 0])
    pairs.append(np.column_stack([clone[tail], clone[head]])[both])
    return CrossingGraph(
        padded,
        np.concatenate([graph.face, graph.face[origin]]),
        np.concatenate([graph.into, graph.into[origin]]),
        np.concatenate([graph.out_of, graph.out_of[origin]]),
        np.concatenate(pairs),
        graph.over,
    )
