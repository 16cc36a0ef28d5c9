"""Convex leaves on one list of vertices: their facets, and the vertices on each facet."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from hzmp_planners._arrays import Floats, Ints, frozen
from hzmp_planners._links import component_labels
from hzmp_planners._ragged import (
    counts_of,
    distinct,
    distinct_points,
    owners_of,
    reduced,
    runs_of,
    sorted_along,
    spans,
    starts_of,
)
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.free_space.cells import Cells


@dataclass(frozen=True, eq=False)
class Complex:
    """Leaves as lists of facets, facets as lists of vertices, all end to end."""

    vertices: Floats
    """Shape (nv, n) [m]."""
    facets: Ints
    """The half-space of each facet, a code of `PlaneTable`, shape (nf,)."""
    leaf_starts: Ints
    """Leaf i has the facets from [i] to [i + 1], shape (N + 1,)."""
    rows: Ints
    """Numbers of the vertices on the facets, ascending on each."""
    facet_starts: Ints
    """Facet j holds the rows from [j] to [j + 1], shape (nf + 1,)."""

    def __len__(self) -> int:
        return len(self.leaf_starts) - 1

    @property
    def n(self) -> int:
        """Dimension, 2 or 3."""
        return int(self.vertices.shape[1])

    @cached_property
    def facet_owner(self) -> Ints:
        """The leaf of each facet."""
        return owners_of(self.leaf_starts)

    @cached_property
    def members(self) -> tuple[Ints, Ints]:
        """The vertices of each leaf, ascending and end to end, and where each list starts."""
        leaf = self.facet_owner[owners_of(self.facet_starts)]
        width = max(1, len(self.vertices))
        keys = distinct(leaf * width + self.rows)
        return keys % width, starts_of(np.bincount(keys // width, minlength=len(self)))

    @cached_property
    def corners(self) -> Floats:
        """The vertices of each leaf in the order of `members`, with repetitions, [m]."""
        return self.vertices.take(self.members[0], axis=0)

    @cached_property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates of each leaf, shape (N, n) each [m]."""
        starts = self.members[1]
        return reduced(np.minimum, self.corners, starts), reduced(np.maximum, self.corners, starts)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.vertices)

    def take(self, leaves: Ints) -> Complex:
        """Some of the leaves, on the same vertices."""
        counts = counts_of(self.leaf_starts)[leaves]
        facets = spans(self.leaf_starts[leaves], counts)
        widths = counts_of(self.facet_starts)[facets]
        rows = self.rows[spans(self.facet_starts[facets], widths)]
        some = Complex(
            self.vertices, self.facets[facets], starts_of(counts), rows, starts_of(widths)
        )
        if "bounds" in vars(self):
            low, high = self.bounds
            vars(some)["bounds"] = low[leaves], high[leaves]
        return some

    def joined(self, other: Complex) -> Complex:
        """The leaves of both, on the vertices of the other, which must begin with these."""
        both = Complex(
            other.vertices,
            np.concatenate([self.facets, other.facets]),
            np.concatenate([self.leaf_starts, other.leaf_starts[1:] + self.leaf_starts[-1]]),
            np.concatenate([self.rows, other.rows]),
            np.concatenate([self.facet_starts, other.facet_starts[1:] + self.facet_starts[-1]]),
        )
        if "bounds" in vars(self):
            pairs = zip(self.bounds, other.bounds, strict=True)
            vars(both)["bounds"] = tuple(np.concatenate(pair) for pair in pairs)
        return both

    def compact(self) -> Complex:
        """The same leaves without the vertices that none of them has."""
        used = np.zeros(len(self.vertices), dtype=np.bool_)
        used[self.rows] = True
        if used.all():
            return self
        rows = (used.cumsum() - 1)[self.rows]
        return replace(self, vertices=frozen(self.vertices[used]), rows=rows)

    def with_cells(self, cells: Cells, scale: float) -> tuple[Complex, Ints]:
        """Cells as leaves on the vertices of this complex and new ones after them.

        Vertices within tolerance are one. Cells smaller than that collapse and are left out.

        Args:
            cells: with codes of half-spaces as facets.
            scale: unit of the tolerance [m].

        Returns:
            Their complex, without the leaves of this one, and the leaf of each cell, -1 for those
            left out.
        """
        tol = 4.0 * PLANE_TOL * scale
        # Most points come from several cells, alike to the last bit.
        single, copy = distinct_points(cells.vertices)
        points, known = cells.vertices.take(single, axis=0), len(self.vertices)
        number = np.full(len(points), -1)
        if known and len(points):
            distance, row = self._tree.query(points, distance_upper_bound=tol)
            number = np.where(np.isfinite(distance), row, -1)
        fresh = (number < 0).nonzero()[0]
        pairs = cKDTree(points[fresh]).query_pairs(tol, output_type="ndarray")
        labels = component_labels(pairs, len(fresh))
        number[fresh] = known + labels
        first = np.zeros(int(labels.max(initial=-1)) + 1, dtype=np.int64)
        first[labels[::-1]] = fresh[::-1]  # the first of each cluster is written last
        vertices = np.concatenate([self.vertices, points[first]])
        number = number[copy]
        leaf, code, vertex = cells.incidence()
        whole = from_incidence(frozen(vertices), leaf, code, number[vertex], len(cells))
        bounded = counts_of(whole.leaf_starts) > whole.n
        leaves = np.where(bounded, bounded.cumsum() - 1, -1)
        return (whole if bounded.all() else whole.take(bounded.nonzero()[0])), leaves


def empty_complex(n: int) -> Complex:
    """No leaves and no vertices."""
    none, start = np.zeros(0, dtype=np.int64), np.zeros(1, dtype=np.int64)
    return Complex(np.zeros((0, n)), none, start, none, start)


def from_incidence(vertices: Floats, leaf: Ints, code: Ints, vertex: Ints, count: int) -> Complex:
    """Leaves from (leaf, facet, vertex) triples in any order, repeated or not.

    Facets with too few vertices to bound are dropped; a leaf may be left without facets.

    Args:
        vertices: shape (nv, n) [m].
        leaf: shape (k,), below `count`.
        code: half-space of the facet, shape (k,).
        vertex: shape (k,).
        count: number of leaves.
    """
    width, codes = max(1, len(vertices)), int(code.max(initial=0)) + 1
    keys = distinct((leaf * codes + code) * width + vertex)
    facet, vertex = keys // width, keys % width
    starts = runs_of(facet)
    if vertices.shape[1] == 2 and (counts_of(starts) > 2).any():
        kept = _outermost(vertices[vertex], starts)
        facet, vertex = facet[kept], vertex[kept]
        starts = runs_of(facet)
    widths = counts_of(starts)
    facet, wide = facet[starts[:-1]], widths >= vertices.shape[1]
    return Complex(
        vertices,
        facet[wide] % codes,
        starts_of(np.bincount(facet[wide] // codes, minlength=count)),
        vertex[wide.repeat(widths)],
        starts_of(widths[wide]),
    )


def _outermost(points: Floats, starts: Ints) -> Ints:
    """The two ends of each side in the plane.

    A side has more vertices where two sides on nearly equal lines have become one.
    """
    order = sorted_along(points, starts)
    return np.unique(np.concatenate([order[starts[:-1]], order[starts[1:] - 1]]))
