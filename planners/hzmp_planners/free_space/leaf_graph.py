"""Leaves as nodes, shared faces as edges: the doors that a path may use."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hzmp_planners._arrays import Floats, Ints, frozen
from hzmp_planners._links import component_labels
from hzmp_planners._ragged import counts_of, order_by, owners_of, spans, starts_of


@dataclass(frozen=True, eq=False)
class SharedFace:
    """Common (n-1)-dimensional piece of two leaves' boundaries: Z_i and Z_j in contact.

    Corollary 3.4 of the HZ-MP paper obtains it as the generalised intersection of the two leaves;
    here it is the overlap of two facets on one plane, which is the same set.
    """

    leaves: tuple[int, int]
    vertices: Floats
    """Shape (k, n) [m]: a segment's ends in 2-D, a convex polygon in order in 3-D."""
    normal: Floats
    """Unit normal of the plane, from leaves[0] into leaves[1], shape (n,)."""
    offset: float
    """normal . x on the plane [m]."""


@dataclass(frozen=True, eq=False)
class LeafGraph:
    """Leaves as nodes, shared faces as edges, in arrays."""

    leaf_count: int
    ends: Ints
    """Leaves on both sides of each face, shape (F, 2)."""
    corners: Floats
    """Vertices of all faces, shape (F, k, n) [m]; short faces repeat their last vertex."""
    sizes: Ints
    """How many vertices each face has, shape (F,)."""
    normals: Floats
    """Unit normals, from the first leaf into the second, shape (F, n)."""
    offsets: Floats
    """normal . x on each face [m], shape (F,)."""

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.corners.shape[2])

    def __len__(self) -> int:
        """Number of faces."""
        return len(self.ends)

    @cached_property
    def faces(self) -> tuple[SharedFace, ...]:
        """The faces one by one."""
        return tuple(
            SharedFace((i, j), self.corners[row, :size], self.normals[row], float(offset))
            for row, ((i, j), size, offset) in enumerate(
                zip(self.ends.tolist(), self.sizes.tolist(), self.offsets, strict=True)
            )
        )

    @cached_property
    def _by_leaf(self) -> tuple[Ints, Ints]:
        """The faces of each leaf end to end, and where each list starts."""
        leaf = self.ends.ravel()
        order = order_by(leaf, self.leaf_count)
        return order >> 1, starts_of(np.bincount(leaf, minlength=self.leaf_count))

    @cached_property
    def pairs(self) -> Ints:
        """Pairs of faces of one leaf, shape (E, 3): face, face, leaf."""
        faces, starts = self._by_leaf
        leaf = owners_of(starts)
        entries = np.arange(len(faces))
        later = starts[1:][leaf] - entries - 1
        first = entries.repeat(later)
        second = spans(entries + 1, later)
        return frozen(np.column_stack([faces[first], faces[second], leaf[first]]))

    def faces_at(self, leaf: int) -> Ints:
        """Indices of the faces of one leaf."""
        faces, starts = self._by_leaf
        return faces[starts[leaf] : starts[leaf + 1]]

    def joining(self, one: Ints, two: Ints) -> tuple[Ints, Ints]:
        """The faces between leaves one[i] and two[i] != one[i]: faces, and the i of each."""
        faces, starts = self._by_leaf
        counts = counts_of(starts)[one]
        beside = faces[spans(starts[one], counts)]
        pair = np.arange(len(one)).repeat(counts)
        joins = (self.ends[beside] == two[pair, None]).any(axis=1).nonzero()[0]
        return beside[joins], pair[joins]

    @cached_property
    def faces_of(self) -> tuple[Ints, ...]:
        """Indices of the faces of each leaf."""
        faces, starts = self._by_leaf
        return tuple(frozen(part) for part in np.split(faces, starts[1:-1]))[: self.leaf_count]

    @cached_property
    def components(self) -> Ints:
        """Connected component of each leaf, shape (N,); two components have no path between."""
        return frozen(component_labels(self.ends, self.leaf_count))

    def connects(self, one: Ints, two: Ints) -> bool:
        """Whether shared faces lead from one of some leaves to one of some others."""
        labels = self.components
        return not set(labels[one].tolist()).isdisjoint(labels[two].tolist())

    @staticmethod
    def from_lists(
        leaf_count: int,
        ends: Ints,
        corners: Floats,
        starts: Ints,
        normals: Floats,
        offsets: Floats,
    ) -> LeafGraph:
        """A graph from faces whose corners lie end to end, face i's from starts[i] on."""
        sizes = counts_of(starts)
        n = normals.shape[1]
        width = int(sizes.max(initial=n))
        rows = starts[:-1, None] + np.minimum(np.arange(width), sizes[:, None] - 1)
        return LeafGraph(
            leaf_count,
            frozen(ends),
            frozen(corners[rows].reshape(-1, width, n)),
            frozen(sizes),
            frozen(normals),
            frozen(offsets),
        )
