"""One table of all planes of a world, so that coinciding facets are one plane by identity."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from hzmp_planners._arrays import Floats, Ints, frozen
from hzmp_planners._links import component_labels
from hzmp_planners.constants import NORMAL_TOL, PLANE_TOL

_TOL = max(NORMAL_TOL, 10.0 * PLANE_TOL)
_MANY = 500


@dataclass(frozen=True, eq=False)
class PlaneTable:
    """Distinct planes a.x = b.

    A half-space is a code: 2 * plane + 1 for a.x <= b, 2 * plane for a.x >= b.
    """

    normals: Floats
    """Unit normals, shape (p, n)."""
    offsets: Floats
    """Offsets [m], shape (p,)."""
    scale: float
    """Offsets agree when they do in this unit [m]."""

    @classmethod
    def empty(cls, n: int, scale: float) -> PlaneTable:
        """A table without planes."""
        return cls(np.zeros((0, n)), np.zeros(0), scale)

    def extended(self, A: Floats, b: Floats) -> tuple[PlaneTable, Ints]:
        """The table with the planes of the half-spaces A x <= b, and the codes of these.

        Half-spaces within tolerance of each other, or of a known plane, are on one plane: touching
        boxes, repeated obstacles and obstacles on the workspace wall would otherwise produce planes
        that differ by round-off, and leaves as thin as that. Known planes keep their numbers.

        Args:
            A: unit normals, shape (m, n).
            b: offsets [m], shape (m,).
        """
        keys = self._keys(A, b)
        first = group = np.arange(len(keys))
        if len(keys) > _MANY:
            first, group = _rounded(keys)
        codes = self._known(keys[first])
        fresh = (codes < 0).nonzero()[0]
        rows = first[fresh]
        plane, side, leaders = _clustered(keys[rows])
        codes[fresh] = 2 * (plane + len(self.offsets)) + side
        table = PlaneTable(
            frozen(np.concatenate([self.normals, A[rows[leaders]]])),
            frozen(np.concatenate([self.offsets, b[rows[leaders]]])),
            self.scale,
        )
        return table, codes[group]

    def halfspaces(self, codes: Ints) -> tuple[Floats, Floats]:
        """Outward unit normals (m, n) and offsets (m,) of half-spaces."""
        plane, sides = codes >> 1, 2.0 * (codes & 1) - 1.0
        return self.normals[plane] * sides[:, None], self.offsets[plane] * sides

    def _keys(self, A: Floats, b: Floats) -> Floats:
        return np.column_stack([A, b / self.scale])

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._keys(self.normals, self.offsets))

    def _known(self, keys: Floats) -> Ints:
        """Codes of the half-spaces on planes of the table, -1 for others."""
        codes = np.full(len(keys), -1)
        if len(self.offsets):
            both = np.concatenate([keys, -keys])
            distance, plane = self._tree.query(both, distance_upper_bound=_TOL)
            near = np.isfinite(distance).reshape(2, -1)
            for side, there, planes in zip((1, 0), near, plane.reshape(2, -1), strict=True):
                codes[there] = 2 * planes[there] + side
        return codes


def _rounded(keys: Floats) -> tuple[Ints, Ints]:
    """The first of the half-spaces that agree after rounding, and the group of each.

    Worlds on a grid repeat their planes so often that pairs of near ones are too many.
    """
    _, first, group = np.unique(
        np.round(keys / (0.5 * _TOL)).astype(np.int64), axis=0,
        return_index=True, return_inverse=True,
    )  # fmt: skip
    order = first.argsort()
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[group.ravel()]


def _clustered(keys: Floats) -> tuple[Ints, Ints, Ints]:
    """The planes of half-spaces, numbered as they appear.

    Returns:
        The plane of each half-space, its side: 1 as the first one on it, and these first ones.
    """
    each = np.arange(len(keys))
    if not len(keys):
        return each, each, each
    # Both orientations of every plane are points of one set; those within tolerance are one.
    both = np.concatenate([keys, -keys])
    pairs = cKDTree(both).query_pairs(_TOL, output_type="ndarray")
    if not len(pairs):
        return each, np.ones_like(each), each
    count = len(keys)
    labels = component_labels(pairs, 2 * count)
    one, two = labels[:count], labels[count:]
    # A plane is its lower label; the first half-space on it decides which side is which.
    lower = np.minimum(one, two)
    first = np.full(2 * count, count)
    np.minimum.at(first, lower, each)
    leader = first[lower]
    leads = leader == each
    plane = (leads.cumsum() - 1)[leader]
    return plane, (one == one[leader]).astype(np.int64), leads.nonzero()[0]
