"""Convex polyhedra: 3-D cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import (
    counts_of,
    order_by,
    owners_of,
    runs_of,
    sorted_along,
    spans,
    starts_of,
)
from hzmp_planners.free_space.cells import Cells, Sides, crossing_points, sides_of


@dataclass(frozen=True, eq=False)
class Polyhedra(Cells):
    """Vertices and facets, and the edges between them: each joins two vertices on two facets."""

    edges: Ints
    """The two vertices of each edge, shape (2, ne)."""
    edge_facets: Ints
    """The two facets of each edge, shape (2, ne)."""
    edge_starts: Ints
    """Polyhedron i owns the edges from [i] to [i + 1], shape (m + 1,)."""

    @cached_property
    def edge_owner(self) -> Ints:
        """The polyhedron of each edge."""
        return owners_of(self.edge_starts)

    def incidence(self) -> tuple[Ints, Ints, Ints]:
        """Every vertex on a facet: lists of (polyhedron, label, vertex), with repetitions."""
        labels = self.facets[self.edge_facets.repeat(2, axis=0)].ravel()
        return np.tile(self.edge_owner, 4), labels, np.tile(self.edges.ravel(), 2)

    def take(self, rows: Ints) -> Polyhedra:
        """Some of the polyhedra, in the given order."""
        vertex_counts = counts_of(self.vertex_starts)[rows]
        edge_counts = counts_of(self.edge_starts)[rows]
        facet_counts = counts_of(self.facet_starts)[rows]
        vertex_starts, facet_starts = starts_of(vertex_counts), starts_of(facet_counts)
        edges = spans(self.edge_starts[rows], edge_counts)
        vertex_shift = (vertex_starts[:-1] - self.vertex_starts[rows]).repeat(edge_counts)
        facet_shift = (facet_starts[:-1] - self.facet_starts[rows]).repeat(edge_counts)
        return Polyhedra(
            self.vertices.take(spans(self.vertex_starts[rows], vertex_counts), axis=0),
            vertex_starts,
            self.facets.take(spans(self.facet_starts[rows], facet_counts)),
            facet_starts,
            self.edges.take(edges, axis=1) + vertex_shift,
            self.edge_facets.take(edges, axis=1) + facet_shift,
            starts_of(edge_counts),
        )

    def relabelled(self, facets: Ints) -> Polyhedra:
        """The same polyhedra with other labels."""
        return replace(self, facets=facets)

    def joined(self, others: Sequence[Cells]) -> Polyhedra:
        """These polyhedra, then others."""
        batches = [self, *(batch for batch in others if isinstance(batch, Polyhedra))]
        vertices = starts_of(np.array([len(batch.vertices) for batch in batches])).tolist()
        facets = starts_of(np.array([len(batch.facets) for batch in batches])).tolist()
        edges = starts_of(np.array([batch.edges.shape[1] for batch in batches])).tolist()
        zero = np.zeros(1, dtype=np.int64)
        each = range(len(batches))
        return Polyhedra(
            np.concatenate([batch.vertices for batch in batches]),
            np.concatenate([zero, *(batches[i].vertex_starts[1:] + vertices[i] for i in each)]),
            np.concatenate([batch.facets for batch in batches]),
            np.concatenate([zero, *(batches[i].facet_starts[1:] + facets[i] for i in each)]),
            np.concatenate([batches[i].edges + vertices[i] for i in each], axis=1),
            np.concatenate([batches[i].edge_facets + facets[i] for i in each], axis=1),
            np.concatenate([zero, *(batches[i].edge_starts[1:] + edges[i] for i in each)]),
        )

    def divide(
        self, labels: Ints, normals: Floats, offsets: Floats, tol: float, wanted: Bools
    ) -> tuple[Polyhedra, Ints, Ints]:
        """Cut the edges, and join the two exits of each facet that is crossed: see `Cells`.

        An edge with one end beyond the plane leaves the half-space there. The two exits of a facet
        are joined by a new edge, and these edges bound the new facet, so vertices on the plane are
        no special case.
        """
        sides = sides_of(self, normals, offsets, tol, wanted)
        vertices, vertex_starts, halves = self._cut_edges(sides)
        facets, facet_starts, moved, caps = self._cut_facets(sides, halves, labels)
        crossed, one, two = _bridges(
            np.concatenate([2 * half.exit_facets + half.side for half in halves]),
            np.concatenate([half.exits for half in halves]),
            vertices,
        )
        facet, side = crossed >> 1, crossed & 1
        part = 2 * self.facet_owner.take(facet) + side
        names = np.array([moved[side, facet], caps.take(part)])
        owner = np.concatenate([*(half.parts for half in halves), sides.number.take(part)])
        _, order, edge_starts = _sorted_places(owner, sides.count)
        edges = np.concatenate([*(half.ends for half in halves), np.array([one, two])], axis=1)
        kept = [moved[half.side].take(half.facets) for half in halves]
        parts = Polyhedra(
            vertices,
            vertex_starts,
            facets,
            facet_starts,
            edges.take(order, axis=1),
            np.concatenate([*kept, names], axis=1).take(order, axis=1),
            edge_starts,
        )
        return parts, sides.kept >> 1, sides.kept & 1

    def _cut_edges(self, sides: Sides) -> tuple[Floats, Ints, list[_Half]]:
        """The vertices of all parts, where each part's begin, and its edges on each side."""
        owner, edge_owner, (tail, head) = self.vertex_owner, self.edge_owner, self.edges
        within = sides.below, sides.above
        tails = [inside.take(tail) for inside in within]
        heads = [inside.take(head) for inside in within]
        upward, downward = tails[0] & heads[1], tails[1] & heads[0]
        crossing = (upward | downward).nonzero()[0]
        fresh = crossing_points(
            self.vertices, sides.heights, tail.take(crossing), head.take(crossing),
            upward.take(crossing),
        )  # fmt: skip
        kept = [(~within[1 - side]).nonzero()[0] for side in sides.active]
        parts = [2 * owner.take(rows) + side for rows, side in zip(kept, sides.active, strict=True)]
        parts += [2 * edge_owner.take(crossing) + side for side in sides.active]
        places, order, starts = _placed(parts, sides)
        points = [self.vertices.take(rows, axis=0) for rows in kept]
        vertices = np.concatenate([*points, *[fresh] * len(kept)]).take(order, axis=0)
        halves = []
        for k, side in enumerate(sides.active):
            moved = np.zeros(len(owner), dtype=np.int64)
            moved[kept[k]] = places[k]
            cut_point = np.zeros(len(tail), dtype=np.int64)
            cut_point[crossing] = places[len(kept) + k]
            part = sides.number.take(2 * edge_owner + side)
            edge = ((tails[side] | heads[side]) & (part < sides.count)).nonzero()[0]
            point = cut_point.take(edge)
            ends = np.array(
                [
                    np.where(outside.take(edge), point, moved.take(end.take(edge)))
                    for end, outside in ((tail, tails[1 - side]), (head, heads[1 - side]))
                ]
            )
            starts_inside = tails[side].take(edge)
            leaving = (starts_inside != heads[side].take(edge)).nonzero()[0]
            exits = np.where(starts_inside, ends[1], ends[0]).take(leaving)
            facets = self.edge_facets.take(edge, axis=1)
            halves.append(
                _Half(
                    side,
                    part.take(edge),
                    ends,
                    facets,
                    facets.take(leaving, axis=1).ravel(),
                    np.concatenate([exits, exits]),
                )
            )
        return vertices, starts, halves

    def _cut_facets(
        self, sides: Sides, halves: list[_Half], labels: Ints
    ) -> tuple[Ints, Ints, Ints, Ints]:
        """The facets of all parts, and where they came from.

        Returns:
            Labels, where each part's begin, the new number of each old facet on each side (2, nf),
            and that of the new facet of each part (2 m,).
        """
        cut = sides.cut.nonzero()[0]
        kept = []
        for half in halves:
            held = np.zeros(len(self.facets), dtype=np.bool_)
            held[half.facets] = True
            kept.append(held.nonzero()[0])
        each = list(zip(kept, sides.active, strict=True))
        parts = [2 * self.facet_owner.take(rows) + side for rows, side in each]
        parts += [2 * cut + side for side in sides.active]
        places, order, starts = _placed(parts, sides)
        names = [self.facets.take(rows) for rows in kept]
        names += [labels[cut, side] for side in sides.active]
        moved = np.zeros((2, len(self.facets)), dtype=np.int64)
        caps = np.zeros(2 * len(self), dtype=np.int64)
        for k, (rows, side) in enumerate(each):
            moved[side, rows] = places[k]
            caps[2 * cut + side] = places[len(kept) + k]
        return np.concatenate(names).take(order), starts, moved, caps


class _Half(NamedTuple):
    """The edges that cells keep on one side of their planes."""

    side: int
    parts: Ints
    """The part that each edge belongs to."""
    ends: Ints
    """Its vertices, shape (2, k)."""
    facets: Ints
    """Its facets, still in the old numbers, shape (2, k)."""
    exit_facets: Ints
    """Facets of edges that leave the half-space, in the old numbers, shape (e,)."""
    exits: Ints
    """The vertices where they do, shape (e,)."""


def _placed(parts: list[Ints], sides: Sides) -> tuple[list[Ints], Ints, Ints]:
    """Sort lists of things of parts by part, end to end.

    Returns:
        The new places of each list's entries, the order of those kept, and where each part's begin.
    """
    place, order, starts = _sorted_places(sides.number.take(np.concatenate(parts)), sides.count)
    ends = starts_of(np.array([len(part) for part in parts])).tolist()
    return [place[start:stop] for start, stop in pairwise(ends)], order, starts


def _sorted_places(owner: Ints, count: int) -> tuple[Ints, Ints, Ints]:
    """Sort entries by owner: the new place of each, the kept ones in order, and list starts.

    Entries of owner `count` are dropped.
    """
    order = order_by(owner, count + 1)
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    starts = starts_of(np.bincount(owner, minlength=count + 1)[:count])
    return place, order[: starts[-1]], starts


def _bridges(faces: Ints, points: Ints, vertices: Floats) -> tuple[Ints, Ints, Ints]:
    """The faces that are crossed and their two exits.

    Round-off may give a thin face more than two exits: then those farthest apart along the longest
    extent of all exits count.
    """
    order = faces.argsort(kind="stable")
    faces, points = faces[order], points[order]
    runs = runs_of(faces)
    if (counts_of(runs) > 2).any():
        points = points[sorted_along(vertices[points], runs)]
    first = runs[:-1]
    one, two = points[first], points[runs[1:] - 1]
    crossed = one != two
    return faces[first[crossed]], one[crossed], two[crossed]
