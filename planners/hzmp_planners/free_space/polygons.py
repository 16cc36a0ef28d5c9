"""Convex polygons: 2-D cells, and faces of 3-D cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import counts_of, order_by, spans, starts_of
from hzmp_planners.free_space.cells import Cells, crossing_points, sides_of


@dataclass(frozen=True, eq=False)
class Polygons(Cells):
    """Corners in order, in the plane or in space; facet i is the side that follows corner i."""

    @classmethod
    def of(cls, corners: Floats, starts: Ints, sides: Ints) -> Polygons:
        """Polygon i has the corners, and the sides that follow them, from starts[i] on."""
        return cls(corners, starts, sides, starts)

    @cached_property
    def following(self) -> Ints:
        """The next corner of the same polygon."""
        after = np.arange(1, len(self.vertices) + 1)
        after[self.vertex_starts[1:] - 1] = self.vertex_starts[:-1]
        return after

    def incidence(self) -> tuple[Ints, Ints, Ints]:
        """Every corner on a side: lists of (polygon, label, corner)."""
        ends = np.concatenate([np.arange(len(self.vertices)), self.following])
        return np.tile(self.vertex_owner, 2), np.tile(self.facets, 2), ends

    def take(self, rows: Ints) -> Polygons:
        """Some of the polygons, in the given order."""
        counts = counts_of(self.vertex_starts)[rows]
        corners = spans(self.vertex_starts[rows], counts)
        return Polygons.of(
            self.vertices.take(corners, axis=0), starts_of(counts), self.facets.take(corners)
        )

    def relabelled(self, facets: Ints) -> Polygons:
        """The same polygons with other labels."""
        return Polygons.of(self.vertices, self.vertex_starts, facets)

    def joined(self, others: Sequence[Cells]) -> Polygons:
        """These polygons, then others."""
        batches = [self, *others]
        shifts = starts_of(np.array([len(batch.vertices) for batch in batches]))
        starts = [
            batch.vertex_starts[1:] + shift for batch, shift in zip(batches, shifts, strict=False)
        ]
        return Polygons.of(
            np.concatenate([batch.vertices for batch in batches]),
            np.concatenate([np.zeros(1, dtype=np.int64), *starts]),
            np.concatenate([batch.facets for batch in batches]),
        )

    def divide(
        self, labels: Ints, normals: Floats, offsets: Floats, tol: float, wanted: Bools
    ) -> tuple[Polygons, Ints, Ints]:
        """Sutherland and Hodgman (1974) for all polygons and both sides at once: see `Cells`."""
        sides = sides_of(self, normals, offsets, tol, wanted)
        owner, after = self.vertex_owner, self.following
        below, above = sides.below, sides.above
        below_next, above_next = below.take(after), above.take(after)
        upward, downward = below & above_next, above & below_next
        crossing = (upward | downward).nonzero()[0]
        fresh = crossing_points(
            self.vertices, sides.heights, crossing, after.take(crossing), upward.take(crossing)
        )
        # A corner is entry 2 i, the point on the side that follows it 2 i + 1.
        size = len(owner)
        points = np.empty((2 * size, self.vertices.shape[1]))
        points[::2], points[2 * crossing + 1] = self.vertices, fresh
        kept = np.zeros((2, 2 * size), dtype=np.bool_)
        for side in sides.active:
            kept[side, ::2] = ~(below if side else above)
            kept[side, 2 * crossing + 1] = True
        # Where the boundary leaves its half of the plane, the new side follows.
        leaves = np.empty((2, 2 * size), dtype=np.bool_)
        leaves[0, ::2], leaves[1, ::2] = above_next & ~below, below_next & ~above
        leaves[0, 1::2], leaves[1, 1::2] = upward, downward
        entry = kept.ravel().nonzero()[0]
        upper = entry >= 2 * size
        place = entry - 2 * size * upper
        corner = place >> 1
        part = 2 * owner.take(corner) + upper
        target = sides.number.take(part)
        starts = starts_of(np.bincount(target, minlength=sides.count + 1)[: sides.count])
        order = order_by(target, sides.count + 1)[: starts[-1]]
        facets = np.where(
            leaves.ravel().take(entry), labels.ravel().take(part), self.facets.take(corner)
        )
        parts = Polygons.of(points.take(place.take(order), axis=0), starts, facets.take(order))
        return parts, sides.kept >> 1, sides.kept & 1
