"""Many convex polyhedra in a few arrays, each cut by a plane of its own at the same time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import counts_of, owners_of, runs_of, spans, starts_of

@dataclass(frozen=True, eq=False)
class Polyhedra:
    """Vertices, edges and labelled facets of convex polyhedra; the lists lie end to end.

    An edge joins two vertices and lies on two facets.
    """

    vertices: Floats
    """Shape (nv, 3) [m]."""
    vertex_starts: Ints
    """Shape (m + 1,): cell i owns the vertices from [i] to [i + 1]."""
    edges: Ints
    """The two vertices of each edge, shape (2, ne)."""
    edge_facets: Ints
    """The two facets of each edge, shape (2, ne)."""
    edge_starts: Ints
    facets: Ints
    """Labels, shape (nf,)."""
    facet_starts: Ints

    def __len__(self) -> int:
        return len(self.vertex_starts) - 1

    @cached_property
    def vertex_owner(self) -> Ints:
        """The cell of each vertex."""
        return owners_of(self.vertex_starts)

    @cached_property
    def edge_owner(self) -> Ints:
        """The cell of each edge."""
        return owners_of(self.edge_starts)

    @cached_property
    def facet_owner(self) -> Ints:
        """The cell of each facet."""
        return owners_of(self.facet_starts)

    def take(self, rows: Ints) -> Polyhedra:
        """Some of the cells, in the given order."""
        vertex_counts = counts_of(self.vertex_starts)[rows]
        edge_counts = counts_of(self.edge_starts)[rows]
        facet_counts = counts_of(self.facet_starts)[rows]
        vertex_starts, facet_starts = starts_of(vertex_counts), starts_of(facet_counts)
        edges = spans(self.edge_starts[rows], edge_counts)
        vertex_shift = (vertex_starts[:-1] - self.vertex_starts[rows]).repeat(edge_counts)
        facet_shift = (facet_starts[:-1] - self.facet_starts[rows]).repeat(edge_counts)
        return Polyhedra(
            self.vertices[spans(self.vertex_starts[rows], vertex_counts)],
            vertex_starts,
            self.edges.take(edges, axis=1) + vertex_shift,
            self.edge_facets.take(edges, axis=1) + facet_shift,
            starts_of(edge_counts),
            self.facets[spans(self.facet_starts[rows], facet_counts)],
            facet_starts,
        )

    @staticmethod
    def join(batches: Sequence[Polyhedra]) -> Polyhedra:
        """Several batches as one."""
        vertices = starts_of(np.array([len(cells.vertices) for cells in batches]))
        edges = starts_of(np.array([cells.edges.shape[1] for cells in batches]))
        facets = starts_of(np.array([len(cells.facets) for cells in batches]))
        zero = np.zeros(1, dtype=np.int64)
        each = range(len(batches))
        return Polyhedra(
            np.concatenate([cells.vertices for cells in batches]),
            np.concatenate([zero, *(batches[i].vertex_starts[1:] + vertices[i] for i in each)]),
            np.concatenate([batches[i].edges + vertices[i] for i in each], axis=1),
            np.concatenate([batches[i].edge_facets + facets[i] for i in each], axis=1),
            np.concatenate([zero, *(batches[i].edge_starts[1:] + edges[i] for i in each)]),
            np.concatenate([cells.facets for cells in batches]),
            np.concatenate([zero, *(batches[i].facet_starts[1:] + facets[i] for i in each)]),
        )

    def relabelled(self, facets: Ints) -> Polyhedra:
        """The same polyhedra with other labels."""
        return replace(self, facets=facets)

    def divide(
        self, codes: Ints, normals: Floats, offsets: Floats, tol: float, wanted: Bools
    ) -> tuple[Polyhedra, Ints, Ints]:
        """Cut each cell by its own plane, and keep the wanted sides.

        An edge with one end beyond the plane leaves it there. The two exits of a face that the
        plane crosses are joined by a new edge, and these edges bound the new facet, so vertices on
        the plane are no special case. A cell with vertices strictly on one side only stays whole.

        Args:
            codes: what the new facets are called, (below, above) of each cell, shape (m, 2).
            normals: unit normal of each cell's plane, shape (m, n).
            offsets: normal . x on it [m], shape (m,).
            tol: vertices within this distance lie on the plane [m].
            wanted: which sides to keep, below (a.x <= b) and above, shape (m, 2).

        Returns:
            The parts, ordered by cell, the lower one first; the cell of each and its side (0, 1).
        """
        owner, starts = self.vertex_owner, self.vertex_starts[:-1]
        heights = np.einsum("ij,ij->i", self.vertices, normals.take(owner, axis=0))
        heights -= offsets.take(owner)
        below, above = heights < -tol, heights > tol
        has_below = np.logical_or.reduceat(below, starts)
        has_above = np.logical_or.reduceat(above, starts)
        cut = has_below & has_above
        if not cut.all():
            cut_vertex = cut.take(owner)
            below = np.where(cut_vertex, below, has_below.take(owner))
            above = np.where(cut_vertex, above, has_above.take(owner))
        present = np.empty((len(cut), 2), dtype=np.bool_)
        present[:, 0], present[:, 1] = has_below, has_above
        present &= wanted
        # Sides of things are numbered 2 * thing + side, below first.
        sides = present.ravel().nonzero()[0]
        count = len(sides)
        part = np.full(present.size, count)  # what is not wanted sorts last and is dropped
        part[sides] = np.arange(count)

        tail, head = self.edges
        tail_below, tail_above = below.take(tail), above.take(tail)
        head_below, head_above = below.take(head), above.take(head)
        upward, downward = tail_below & head_above, tail_above & head_below
        crossing = (upward | downward).nonzero()[0]
        # From below to above, so that every cell that has this edge gets the same point.
        up, start, stop = upward.take(crossing), tail.take(crossing), head.take(crossing)
        low, high = np.where(up, start, stop), np.where(up, stop, start)
        fall, rise = heights.take(low), heights.take(high)
        t = (fall / (fall - rise))[:, None]
        fresh = self.vertices.take(low, axis=0) * (1.0 - t)
        fresh += self.vertices.take(high, axis=0) * t

        lower, upper = (~above).nonzero()[0], (~below).nonzero()[0]
        edge_part = 2 * self.edge_owner
        cut_part = edge_part.take(crossing)
        placed = np.concatenate([2 * owner.take(lower), 2 * owner.take(upper) + 1, cut_part, cut_part + 1])
        place, order, vertex_starts = _sorted_places(part.take(placed), count)
        vertices = np.concatenate(
            [self.vertices.take(lower, axis=0), self.vertices.take(upper, axis=0), fresh, fresh]
        ).take(order, axis=0)
        ends = np.array([len(lower), len(upper), len(crossing)]).cumsum()
        lowered = np.zeros(len(owner), dtype=np.int64)
        raised = lowered.copy()
        lowered[lower], raised[upper] = place[: ends[0]], place[ends[0] : ends[1]]
        cut_below = np.zeros(len(tail), dtype=np.int64)
        cut_above = cut_below.copy()
        cut_below[crossing], cut_above[crossing] = place[ends[1] : ends[2]], place[ends[2] :]

        halves = []
        for side, ends_in, ends_out, moved, cut_point in (
            (0, (tail_below, head_below), (tail_above, head_above), lowered, cut_below),
            (1, (tail_above, head_above), (tail_below, head_below), raised, cut_above),
        ):
            of = part.take(edge_part + side)
            edge = ((ends_in[0] | ends_in[1]) & (of < count)).nonzero()[0]
            point = cut_point.take(edge)
            new_ends = [
                np.where(out.take(edge), point, moved.take(end.take(edge)))
                for end, out in zip((tail, head), ends_out, strict=True)
            ]
            tail_in = ends_in[0].take(edge)
            leaving = (tail_in != ends_in[1].take(edge)).nonzero()[0]
            exits = np.where(tail_in, new_ends[1], new_ends[0]).take(leaving)
            halves.append((of.take(edge), edge, new_ends, edge.take(leaving), exits))
        (part_0, edge_0, ends_0, leaving_0, exits_0), (part_1, edge_1, ends_1, leaving_1, exits_1) = halves

        kept_0, kept_1 = self.edge_facets.take(edge_0, axis=1), self.edge_facets.take(edge_1, axis=1)
        held = np.zeros((2, len(self.facets)), dtype=np.bool_)
        held[0][kept_0], held[1][kept_1] = True, True
        facet_0, facet_1 = held[0].nonzero()[0], held[1].nonzero()[0]
        cut_cells = cut.nonzero()[0]
        placed = np.concatenate(
            [
                2 * self.facet_owner.take(facet_0),
                2 * self.facet_owner.take(facet_1) + 1,
                2 * cut_cells,
                2 * cut_cells + 1,
            ]
        )
        place, order, facet_starts = _sorted_places(part.take(placed), count)
        facets = np.concatenate(
            [self.facets.take(facet_0), self.facets.take(facet_1), codes[cut_cells].T.ravel()]
        ).take(order)
        ends = np.array([len(facet_0), len(facet_1), len(cut_cells)]).cumsum()
        facet_moved = np.zeros(held.shape, dtype=np.int64)
        facet_moved[0, facet_0], facet_moved[1, facet_1] = place[: ends[0]], place[ends[0] : ends[1]]
        cap = np.zeros(present.size, dtype=np.int64)
        cap[2 * cut_cells], cap[2 * cut_cells + 1] = place[ends[1] : ends[2]], place[ends[2] :]

        faces_0 = self.edge_facets.take(leaving_0, axis=1)
        faces_1 = self.edge_facets.take(leaving_1, axis=1)
        faces = np.concatenate([2 * faces_0.ravel(), 2 * faces_1.ravel() + 1])
        exits = np.concatenate([exits_0, exits_0, exits_1, exits_1])
        faces, one, two = _bridges(faces, exits, vertices)
        crossed, at = faces >> 1, faces & 1
        bridge_part = 2 * self.facet_owner.take(crossed) + at
        labels = np.stack([facet_moved[at, crossed], cap.take(bridge_part)])
        _, order, edge_starts = _sorted_places(
            np.concatenate([part_0, part_1, part.take(bridge_part)]), count
        )
        edges = np.stack(
            [
                np.concatenate([ends_0[0], ends_1[0], one]),
                np.concatenate([ends_0[1], ends_1[1], two]),
            ]
        ).take(order, axis=1)
        edge_facets = np.concatenate(
            [facet_moved[0].take(kept_0), facet_moved[1].take(kept_1), labels], axis=1
        ).take(order, axis=1)
        parts = Polyhedra(vertices, vertex_starts, edges, edge_facets, edge_starts, facets, facet_starts)
        return parts, sides >> 1, sides & 1


def _sorted_places(owner: Ints, count: int) -> tuple[Ints, Ints, Ints]:
    """Sort entries by owner: the new place of each, the kept ones in order, and list starts.

    Entries of owner `count` are dropped.
    """
    order = owner.argsort(kind="stable")
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
    first = runs_of(faces)
    sizes = counts_of(np.append(first, len(faces)))
    if len(sizes) and sizes.max() > 2:
        where = vertices[points]
        extent = np.maximum.reduceat(where, first) - np.minimum.reduceat(where, first)
        axis = extent.argmax(axis=1).repeat(sizes)
        order = np.lexsort((where[np.arange(len(axis)), axis], faces))
        points = points[order]
    one, two = points[first], points[first + sizes - 1]
    crossed = one != two
    return faces[first[crossed]], one[crossed], two[crossed]
