"""What every set can do, and what is the same for all of them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import null_space

from hzmp_planners._arrays import Bools, Floats, as_floats, as_point, frozen
from hzmp_planners.constants import SET_TOL
from hzmp_planners.errors import ShapeError

if TYPE_CHECKING:
    from typing import Self

    from matplotlib.artist import Artist

    from hzmp_planners.sets.convex_set import ConvexSet
    from hzmp_planners.sets.hybrid_zonotope import HybridZonotope


class AffineHull(NamedTuple):
    """Smallest affine space that holds a set."""

    point: Floats
    """A point of the set, shape (n,)."""
    basis: Floats
    """Orthonormal directions, shape (dimension, n)."""
    normals: Floats
    """Orthonormal directions in which the set has no extent, shape (n - dimension, n)."""
    corners: Floats
    """Points of the set that span the hull, shape (2 dimension or 1, n)."""


class Set(ABC):
    """A closed bounded set of points in n dimensions; immutable.

    Operators: ``A @ Z`` linear map, ``Z1 + Z2`` Minkowski sum (or shift by a vector), ``Z1 & Z2``
    intersection. Two operands may be of different types: the result has the smallest type that
    can hold it, never a narrower one than its operands have.
    """

    _points: Floats | None = None  # of a polytopal convex set: points whose hull it is, if known

    __array_ufunc__ = None  # numpy leaves `A @ Z` and `v + Z` to the methods below

    @property
    @abstractmethod
    def n(self) -> int:
        """Dimension of the space."""

    @abstractmethod
    def is_empty(self) -> bool:
        """True when the set has no point."""

    @abstractmethod
    def contains(self, X: ArrayLike, tol: float | None = None) -> Bools:
        """Which of the points (k, n) lie in the set; shape (k,).

        Args:
            X: points [m]; one point may be given as (n,).
            tol: points at most this far away count [m]; 1e-9 of the set's size unless given.
        """

    @abstractmethod
    def contains_set(self, inner: Set) -> bool:
        """Whether every point of `inner` is a point of this set, up to 1e-9 of its size.

        Raises:
            ShapeError: another dimension, or a pair of types that no exact test exists for.
        """

    @abstractmethod
    def project(self, x: ArrayLike) -> Floats:
        """A point of the set nearest to x (n,), shape (n,).

        Raises:
            ShapeError: the set is empty.
        """

    @abstractmethod
    def distance(self, other: Set | ArrayLike) -> float:
        """Least Euclidean distance to a set or a point [m]; inf when one of them is empty."""

    @abstractmethod
    def vertices(self) -> Floats:
        """Extreme points (of every leaf), shape (k, n) [m]; (0, n) when empty.

        Raises:
            ShapeError: the set is curved or unbounded: it has no vertex form.
        """

    @abstractmethod
    def convex_parts(self) -> Sequence[ConvexSet]:
        """Convex sets whose union this set is: itself, or its leaves."""

    @abstractmethod
    def volume(self) -> float:
        """Volume (area in 2-D) [m^n]; 0 for flat and empty sets.

        Raises:
            ShapeError: the set is curved and no ellipsoid: no closed form.
        """

    @abstractmethod
    def sample(self, k: int, rng: np.random.Generator) -> Floats:
        """K points, uniform in the set (in its affine hull when it is flat), shape (k, n) [m].

        Raises:
            ShapeError: the set is empty.
        """

    @abstractmethod
    def remove_redundancy(self) -> Self:
        """The same set with fewer generators, constraints or half-spaces where that is exact."""

    @abstractmethod
    def convex_relaxation(self) -> Set:
        """The set itself when it is convex; a hybrid zonotope with its binaries in [-1, 1]."""

    @abstractmethod
    def _farthest(self, d: Floats) -> Floats | None:
        """A point with the largest d.x, shape (n,); None when the set is empty."""

    @abstractmethod
    def _mapped(self, R: Floats) -> Self:
        """R times the set; R of shape (m, n)."""

    @abstractmethod
    def _shifted(self, v: Floats) -> Self:
        """The set moved by v (n,)."""

    @abstractmethod
    def _fields(self) -> dict[str, Any]:
        """What `from_json` passes on, as JSON values."""

    def support_point(self, d: ArrayLike) -> Floats:
        """A point of the set with the largest d.x, for d of shape (n,); shape (n,).

        Raises:
            ShapeError: the set is empty.
            SolverError: no verdict that holds.
        """
        point = self._farthest(as_point(d, "d", self.n))
        if point is None:
            raise ShapeError("an empty set has no support point")
        return point

    def support(self, d: ArrayLike) -> float:
        """Largest d.x over the set, d of shape (n,); -inf when empty.

        Raises:
            SolverError: no verdict that holds.
        """
        direction = as_point(d, "d", self.n)
        point = self._farthest(direction)
        return -math.inf if point is None else float(direction @ point)

    def interval_hull(self) -> tuple[Floats, Floats]:
        """Smallest axis-aligned box (lo, hi), each (n,) [m].

        Raises:
            ShapeError: the set is empty.
        """
        return self._interval_hull

    @cached_property
    def _interval_hull(self) -> tuple[Floats, Floats]:
        if self.is_empty():
            raise ShapeError("an empty set has no interval hull")
        if self._points is not None:
            return frozen(self._points.min(axis=0)), frozen(self._points.max(axis=0))
        eye = np.eye(self.n)
        hi = np.array([self.support(axis) for axis in eye])
        lo = np.array([-self.support(-axis) for axis in eye])
        return frozen(lo), frozen(hi)

    def affine_hull(self) -> AffineHull:
        """The affine hull, from at most 2 n support points beyond the interval hull.

        A direction in which the set is thinner than 1e-9 of its size is a normal of it.

        Raises:
            ShapeError: the set is empty.
        """
        return self._affine_hull

    @cached_property
    def _affine_hull(self) -> AffineHull:
        lo, hi = self.interval_hull()
        n = self.n
        extent = hi - lo
        size = float(extent.max(initial=0.0))
        flat = max(SET_TOL * size, 8.0 * np.finfo(np.float64).eps * float(np.abs([lo, hi]).max()))
        d = np.eye(n)[int(extent.argmax())]
        corners: list[Floats] = []
        basis, normals = np.zeros((0, n)), np.zeros((0, n))
        for _ in range(n):
            ends = [self.support_point(d), self.support_point(-d)]
            span = ends[0] - ends[1]
            if span @ d > flat:
                corners += ends
                for known in (normals, basis):
                    span = span - known.T @ (known @ span)
                basis = np.vstack([basis, span / np.linalg.norm(span)])
            else:
                normals = np.vstack([normals, d])
            if len(basis) + len(normals) < n:
                d = null_space(np.vstack([basis, normals]))[:, 0]
        found = np.array(corners) if corners else self.support_point(d)[None]
        return AffineHull(frozen(found[0]), frozen(basis), frozen(normals), frozen(found))

    def affine_dimension(self) -> int:
        """Dimension of the affine hull: n for a set with interior, 0 for a point, -1 when empty."""
        return -1 if self.is_empty() else len(self.affine_hull().basis)

    def intersection(self, other: Set, R: ArrayLike | None = None) -> Set:
        """Points z of this set with R z in the other one (generalised intersection).

        Args:
            other: a set, of dimension m when R is given. A `Polytope` may be unbounded.
            R: shape (m, n); the identity unless given.

        Raises:
            ShapeError: shapes do not fit, or no type holds the result.
        """
        from hzmp_planners.sets.pairs import intersection

        return intersection(self, other, None if R is None else as_floats(R, "R", 2))

    def cartesian_product(self, other: Set) -> Set:
        """Points (x, y) with x in this set and y in the other one."""
        from hzmp_planners.sets.pairs import cartesian_product

        return cartesian_product(self, other)

    def union(self, *others: Set) -> HybridZonotope:
        """The union with other polytopal sets, as one hybrid zonotope."""
        from hzmp_planners.sets.hybrid_zonotope import HybridZonotope

        for other in others:
            self._check_dimension(other)
        return HybridZonotope.from_union([self, *others])

    def __rmatmul__(self, matrix: ArrayLike) -> Self:
        R = as_floats(matrix, "the matrix of a linear map", 2)
        if not len(R):
            raise ShapeError("the matrix of a linear map needs at least one row")
        if R.shape[1] != self.n:
            raise ShapeError(f"the matrix must have {self.n} columns for this set, got {R.shape}")
        return self._mapped(R)

    @overload
    def __add__(self, other: Set) -> Set: ...
    @overload
    def __add__(self, other: ArrayLike) -> Self: ...
    def __add__(self, other: Set | ArrayLike) -> Set:
        from hzmp_planners.sets.pairs import minkowski_sum

        if isinstance(other, Set):
            return minkowski_sum(self, other)
        return self._shifted(as_point(other, "the shift", self.n))

    def __radd__(self, other: ArrayLike) -> Self:
        return self + other

    def __and__(self, other: Set) -> Set:
        return self.intersection(other)

    def _check_dimension(self, other: object) -> None:
        if not isinstance(other, Set):
            raise ShapeError(f"the other operand must be a set, got {other!r:.60}")
        if other.n != self.n:
            raise ShapeError(f"sets of dimensions {self.n} and {other.n} share no points")

    def to_json(self) -> str:
        """JSON text that `from_json` turns into the same set."""
        from hzmp_planners.sets.text import to_json

        return to_json(self)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The set that `to_json` wrote.

        Raises:
            ShapeError: not such a text, or a set of another type than the class asked.
        """
        from hzmp_planners.sets.text import from_json

        found = from_json(text)
        if not isinstance(found, cls):
            raise ShapeError(f"the text holds a {type(found).__name__}, not a {cls.__name__}")
        return found

    def plot(self, ax: Any, **style: Any) -> list[Artist]:
        """Draw a 2-D set on matplotlib axes, or a 3-D set on 3-D axes.

        Args:
            ax: axes to draw on.
            style: passed to the polygons, for example color, alpha, linewidth, label.

        Raises:
            ShapeError: another dimension than 2 or 3.
        """
        from hzmp_planners.sets.plot import plot

        return plot(self, ax, style)
