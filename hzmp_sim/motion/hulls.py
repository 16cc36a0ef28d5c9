"""Convex sets in which moving geoms could be met, all of them side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

import numpy as np

from hzmp_planners._arrays import Bools, Floats
from hzmp_planners.sets import Polytope


class Hulls(Sequence[Polytope | None]):
    """One convex set {x : A[i] x <= b[i]} for each of g geoms; as polytopes, only those asked for.

    Args:
        A: normals, unit or (where b is inf) of no meaning, shape (g, F, n).
        b: offsets, shape (g, F) [m]: inf where there is no facet; -inf for a geom without a set.
        vertices: shape (g, V, n) [m], where they are known.
    """

    def __init__(self, A: Floats, b: Floats, vertices: Floats | None = None) -> None:
        self.A, self.b, self._vertices = A, b, vertices

    @classmethod
    def none(cls, n: int) -> Hulls:
        """For no geoms, in R^n."""
        return cls(np.zeros((0, 1, n)), np.zeros((0, 1)))

    def __len__(self) -> int:
        return len(self.b)

    @overload
    def __getitem__(self, i: int) -> Polytope | None: ...
    @overload
    def __getitem__(self, i: slice) -> list[Polytope | None]: ...
    def __getitem__(self, i: int | slice) -> Polytope | list[Polytope | None] | None:
        if isinstance(i, slice):
            return [self[k] for k in range(*i.indices(len(self)))]
        if not (self.b[i] > -np.inf).all():
            return None
        if self._vertices is not None:
            return Polytope.from_both_forms(self.A[i], self.b[i], self._vertices[i])
        rows = self.b[i] < np.inf
        return Polytope.from_halfspaces(self.A[i, rows], self.b[i, rows])

    @property
    def exist(self) -> Bools:
        """Which geoms have a set, (g,)."""
        return np.asarray((self.b > -np.inf).all(axis=1))

    def contain(self, point: Floats) -> Bools:
        """Which of the sets hold a point (n,), (g,)."""
        return np.asarray((self.A @ point <= self.b).all(axis=1))

    def replaced(self, rows: Bools, other: Hulls) -> Hulls:
        """With the sets of others in some rows (g,): as many facets and vertices each."""
        vertices = None
        if self._vertices is not None and other._vertices is not None:
            vertices = np.where(rows[:, None, None], other._vertices, self._vertices)
        A = np.where(rows[:, None, None], other.A, self.A)
        return Hulls(A, np.where(rows[:, None], other.b, self.b), vertices)

    def without(self, rows: Bools) -> Hulls:
        """Without those of some rows (g,)."""
        return Hulls(self.A, np.where(rows[:, None], -np.inf, self.b), self._vertices)
