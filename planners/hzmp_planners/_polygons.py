"""Convex polygons: many in a few arrays, each cut by a plane of its own at the same time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import counts_of, owners_of, spans, starts_of


@dataclass(frozen=True, eq=False)
class Polygons:
    """Corners of convex polygons in order, with a label on each side; the lists lie end to end.

    Polygons in the plane are 2-D cells; polygons in space are faces of 3-D cells.
    """

    vertices: Floats
    """Corners, shape (nv, n) [m]."""
    vertex_starts: Ints
    """Shape (m + 1,): polygon i owns the corners from [i] to [i + 1]."""
    facets: Ints
    """Label of the side from each corner to the next, shape (nv,)."""

    def __len__(self) -> int:
        return len(self.vertex_starts) - 1

    @cached_property
    def vertex_owner(self) -> Ints:
        """The polygon of each corner."""
        return owners_of(self.vertex_starts)

    @property
    def facet_owner(self) -> Ints:
        """The polygon of each side."""
        return self.vertex_owner

    @property
    def facet_starts(self) -> Ints:
        """Where the sides of each polygon start."""
        return self.vertex_starts

    @cached_property
    def following(self) -> Ints:
        """The next corner of the same polygon."""
        after = np.arange(1, len(self.vertices) + 1)
        after[self.vertex_starts[1:] - 1] = self.vertex_starts[:-1]
        return after

    def take(self, rows: Ints) -> Polygons:
        """Some of the polygons, in the given order."""
        counts = counts_of(self.vertex_starts)[rows]
        corners = spans(self.vertex_starts[rows], counts)
        return Polygons(
            self.vertices.take(corners, axis=0), starts_of(counts), self.facets.take(corners)
        )

    @staticmethod
    def join(batches: Sequence[Polygons]) -> Polygons:
        """Several batches as one."""
        shifts = starts_of(np.array([len(batch.vertices) for batch in batches]))
        starts = [batches[i].vertex_starts[1:] + shifts[i] for i in range(len(batches))]
        return Polygons(
            np.concatenate([batch.vertices for batch in batches]),
            np.concatenate([np.zeros(1, dtype=np.int64), *starts]),
            np.concatenate([batch.facets for batch in batches]),
        )

    def relabelled(self, facets: Ints) -> Polygons:
        """The same polygons with other labels."""
        return Polygons(self.vertices, self.vertex_starts, facets)

    def divide(
        self, labels: Ints, normals: Floats, offsets: Floats, tol: float, wanted: Bools
    ) -> tuple[Polygons, Ints, Ints]:
        """Cut each polygon by its own plane, and keep the wanted sides.

        Sutherland and Hodgman (1974) for all polygons and both sides at once. A polygon with
        corners strictly on one side only stays whole.

        Args:
            labels: of the new sides, (below, above) for each polygon, shape (m, 2).
            normals: unit normal of each polygon's plane, shape (m, n).
            offsets: normal . x on it [m], shape (m,).
            tol: corners within this distance lie on the plane [m].
            wanted: which parts to keep, below (a.x <= b) and above, shape (m, 2).

        Returns:
            The parts, ordered by polygon, the lower first; the polygon and side (0, 1) of each.
        """
        owner, starts, after = self.vertex_owner, self.vertex_starts[:-1], self.following
        heights = np.einsum("ij,ij->i", self.vertices, normals.take(owner, axis=0))
        heights -= offsets.take(owner)
        below, above = heights < -tol, heights > tol
        has_below = np.logical_or.reduceat(below, starts)
        has_above = np.logical_or.reduceat(above, starts)
        cut = has_below & has_above
        if not cut.all():
            cut_corner = cut.take(owner)
            below = np.where(cut_corner, below, has_below.take(owner))
            above = np.where(cut_corner, above, has_above.take(owner))
        present = np.empty((len(cut), 2), dtype=np.bool_)
        present[:, 0], present[:, 1] = has_below, has_above
        present &= wanted
        # Part 2 * polygon is below, 2 * polygon + 1 above.
        sides = present.ravel().nonzero()[0]
        count = len(sides)
        part = np.full(present.size, count)  # what is not wanted sorts last and is dropped
        part[sides] = np.arange(count)

        below_next, above_next = below.take(after), above.take(after)
        upward, downward = below & above_next, above & below_next
        crossing = (upward | downward).nonzero()[0]
        up, here, there = upward.take(crossing), crossing, after.take(crossing)
        # From below to above, so that both polygons on this side get the same point.
        low, high = np.where(up, here, there), np.where(up, there, here)
        fall, rise = heights.take(low), heights.take(high)
        t = (fall / (fall - rise))[:, None]
        fresh = self.vertices.take(low, axis=0) * (1.0 - t) + self.vertices.take(high, axis=0) * t

        # A corner is entry 2 i, the point on the side that follows it 2 i + 1.
        size = len(heights)
        points = np.empty((2 * size, self.vertices.shape[1]))
        points[::2], points[2 * crossing + 1] = self.vertices, fresh
        kept = np.zeros((2, 2 * size), dtype=np.bool_)
        kept[0, ::2], kept[1, ::2] = ~above, ~below
        kept[:, 2 * crossing + 1] = True
        # Where the boundary leaves its side of the plane, the new side follows.
        leaves = np.empty((2, 2 * size), dtype=np.bool_)
        leaves[0, ::2], leaves[1, ::2] = above_next & ~below, below_next & ~above
        leaves[0, 1::2], leaves[1, 1::2] = upward, downward
        entry = kept.ravel().nonzero()[0]
        upper = entry >= 2 * size
        place = entry - 2 * size * upper
        corner = place >> 1
        half = 2 * owner.take(corner) + upper
        target = part.take(half)
        order = target.argsort(kind="stable")
        starts = starts_of(np.bincount(target, minlength=count + 1)[:count])
        order = order[: starts[-1]]
        facets = np.where(
            leaves.ravel().take(entry), labels.ravel().take(half), self.facets.take(corner)
        )
        parts = Polygons(points.take(place.take(order), axis=0), starts, facets.take(order))
        return parts, sides >> 1, sides & 1


def clip_polygon(corners: Floats, height: Floats) -> Floats:
    """The part of a segment or convex polygon where height <= 0 (Sutherland and Hodgman 1974).

    Args:
        corners: shape (k, n); two are the ends of a segment.
        height: values of an affine function at the corners, shape (k,).

    Returns:
        Corners in order, shape (m, n); (0, n) when nothing is left.
    """
    kept: list[Floats] = []
    for i in range(len(corners)):
        if len(corners) > 2 or i > 0:
            h, g = height[i - 1], height[i]
            if (h < 0.0 < g) or (g < 0.0 < h):
                kept.append(corners[i - 1] + (h / (h - g)) * (corners[i] - corners[i - 1]))
        if height[i] <= 0.0:
            kept.append(corners[i])
    return np.array(kept).reshape(-1, corners.shape[1])
