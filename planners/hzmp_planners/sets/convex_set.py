"""What is the same for all convex sets: everything that follows from their generator form."""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import pdist

from hzmp_planners._arrays import Floats, as_count, as_point, frozen
from hzmp_planners.constants import SET_TOL
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.base import Set
from hzmp_planners.sets.form import queries
from hzmp_planners.sets.form.ellipsoids import ellipsoid_reach, sample_ellipsoid
from hzmp_planners.sets.form.form import GeneratorForm
from hzmp_planners.sets.hulls.nearest import nearest_of_hulls
from hzmp_planners.sets.hulls.sampling import sample_by_rejection, sample_hull
from hzmp_planners.sets.hulls.support_hull import support_hull

if TYPE_CHECKING:
    from typing import Self

    from hzmp_planners.sets.polytope import Polytope


class ConvexSet(Set):
    """A convex set; a polytopal one knows, or finds, points whose convex hull it is."""

    @cached_property
    def form(self) -> GeneratorForm:
        """Generators, constraints and norm balls of the set."""
        return self._make_form()

    @abstractmethod
    def _make_form(self) -> GeneratorForm:
        """The form, computed once."""

    @abstractmethod
    def to_polytope(self) -> Polytope:
        """The set in half-space and vertex form.

        Raises:
            ShapeError: the set is curved or unbounded.
        """

    def hull_points(self) -> Floats:
        """Points whose convex hull the set is, shape (k, n) [m]; perhaps more than its vertices.

        Raises:
            ShapeError: the set is curved or unbounded.
        """
        if self._points is None:
            if not self.form.is_polytopal:
                raise ShapeError(
                    f"a curved {type(self).__name__} is not the hull of finitely many points; "
                    "one that encloses it, or that it encloses, is"
                )
            self._remember_points(support_hull(self))
        assert self._points is not None
        return self._points

    def _remember_points(self, points: Floats) -> None:
        vars(self)["_points"] = frozen(points)  # a frozen dataclass, filled in late

    def _farthest(self, d: Floats) -> Floats | None:
        if self._points is None:
            return queries.farthest(self.form, d)
        if not len(self._points):
            return None
        return np.asarray(self._points[int((self._points @ d).argmax())])

    def project(self, x: ArrayLike) -> Floats:
        """A point of the set nearest to x (n,), shape (n,).

        To round-off where the points are known whose hull the set is. Else the distance is exact to
        1e-8 of itself, and the point along a curved or slanting boundary to about the root of that.

        Raises:
            ShapeError: the set is empty.
            SolverError: no verdict that holds.
        """
        point = as_point(x, "x", self.n)
        if self._points is not None and len(self._points):
            pair = nearest_of_hulls(self._points, point[None])
            if pair is not None:
                return pair[0]
        found = queries.nearest_point(self.form, point)
        if found is None:
            raise ShapeError("an empty set has no nearest point")
        return found

    def nearest_points(self, other: ConvexSet) -> tuple[Floats, Floats]:
        """A point of this set and one of the other at the least distance, each (n,).

        Where the points whose hulls they are are known, by Wolfe's algorithm to round-off; else,
        or if that proves nothing, by a second-order cone program.

        Raises:
            ShapeError: one of the sets is empty, or different dimensions.
            SolverError: no verdict that holds.
        """
        self._check_dimension(other)
        pair = None
        first, second = self._points, other._points
        if first is not None and second is not None and len(first) and len(second):
            pair = nearest_of_hulls(first, second)
        if pair is None:
            pair = queries.nearest_points(self.form, other.form)
        if pair is None:
            raise ShapeError("an empty set has no nearest points")
        return pair

    def distance(self, other: Set | ArrayLike) -> float:
        """Least Euclidean distance to a set or a point [m]; inf when one of them is empty.

        Raises:
            SolverError: no verdict that holds.
        """
        if not isinstance(other, Set):
            point = as_point(other, "the point", self.n)
            return math.inf if self.is_empty() else math.dist(self.project(point), point)
        if not isinstance(other, ConvexSet):
            return other.distance(self)
        self._check_dimension(other)
        if self.is_empty() or other.is_empty():
            return math.inf
        return math.dist(*self.nearest_points(other))

    def contains_set(self, inner: Set) -> bool:
        """Whether every point of `inner` is a point of this set, up to 1e-9 of its size.

        By the facets of this set and the support function of the inner one, or by the inner
        one's vertices, or for two ellipsoids by the trust-region problem: all exact.

        Raises:
            ShapeError: another dimension, or two curved sets that are not both ellipsoids.
            SolverError: no verdict that holds.
        """
        self._check_dimension(inner)
        if not isinstance(inner, ConvexSet):
            return all(self.contains_set(leaf) for leaf in inner.convex_parts())
        if inner.is_empty():
            return True
        if self.is_empty():
            return False
        if self.form.is_polytopal:
            outer = self.to_polytope()
            room = 10.0 * SET_TOL * self.form.size
            facets = zip(outer.A, outer.b.tolist(), strict=True)
            return all(inner.support(a) <= b + room for a, b in facets)
        if inner.form.is_polytopal:
            return bool(self.contains(inner.hull_points()).all())
        if self.form.is_ellipsoid and inner.form.is_ellipsoid:
            return ellipsoid_reach(self.form, inner.form) <= 1.0 + 10.0 * SET_TOL
        raise ShapeError(
            f"no exact test whether a curved {type(self).__name__} contains a curved "
            f"{type(inner).__name__}: enclose the inner one in a constrained zonotope"
        )

    def sample(self, k: int, rng: np.random.Generator) -> Floats:
        """K points, uniform in the set (in its affine hull when it is flat), shape (k, n) [m].

        Polytopal sets are split into simplices, ellipsoids mapped from the ball; other curved
        sets are sampled by rejection from an enclosing polytope.

        Raises:
            ShapeError: the set is empty.
        """
        as_count(k, "k")
        if self.is_empty():
            raise ShapeError("an empty set has no points to sample")
        if self.form.is_polytopal:
            return sample_hull(self.hull_points(), self.affine_hull(), k, rng)
        if self.form.is_ellipsoid:
            return sample_ellipsoid(self.form, k, rng)
        return sample_by_rejection(self, k, rng)

    def diameter(self) -> float:
        """Largest distance of two of its points [m]; 0 when empty.

        Raises:
            ShapeError: the set is curved and no ellipsoid.
        """
        if self.form.is_ellipsoid:
            return 2.0 * float(np.linalg.svd(self.form.G, compute_uv=False).max(initial=0.0))
        return float(pdist(self.to_polytope().vertices()).max(initial=0.0))

    def convex_parts(self) -> tuple[Self, ...]:
        """The set itself, as the one convex part of its own union."""
        return (self,)

    def convex_relaxation(self) -> Self:
        """The set itself."""
        return self
