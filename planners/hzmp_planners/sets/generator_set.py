"""What is the same for all sets that are given by generators."""

from __future__ import annotations

import itertools
import math
from abc import abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Bools, Floats, as_floats, as_points, frozen
from hzmp_planners.constants import SET_TOL
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.convex_set import ConvexSet
from hzmp_planners.sets.form import queries
from hzmp_planners.sets.form.ellipsoids import ellipsoid_volume
from hzmp_planners.sets.form.form import GeneratorForm
from hzmp_planners.sets.form.polytopal_balls import with_polytopal_balls
from hzmp_planners.sets.form.redundancy import without_redundancy
from hzmp_planners.sets.hulls.nearest import nearest_of_hulls

if TYPE_CHECKING:
    from typing import Self

    from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope
    from hzmp_planners.sets.polytope import Polytope

_DIRECT_QUERIES = 12  # more points than this are worth the facets of a polytopal set


class GeneratorSet(ConvexSet):
    """A convex set with fields G and c, and perhaps constraints A xi = b."""

    c: Floats
    _operands: tuple[Floats, Floats] | None = None

    @classmethod
    @abstractmethod
    def _of_form(cls, form: GeneratorForm) -> Self:
        """The set of this type that has the form."""

    @classmethod
    def _unchecked(cls, form: GeneratorForm, **fields: Floats) -> Self:
        """A set from matrices that an operation has computed from checked ones."""
        made = object.__new__(cls)
        vars(made).update({name: frozen(value) for name, value in fields.items()}, form=form)
        return made

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.c.size)

    @property
    def ng(self) -> int:
        """Number of generators."""
        return int(self.form.G.shape[1])

    @property
    def nb(self) -> int:
        """Number of binary generators: none."""
        return 0

    @property
    def nc(self) -> int:
        """Number of constraints."""
        return int(self.form.b.size)

    def _mapped(self, R: Floats) -> Self:
        mapped = type(self)._of_form(self.form.mapped(R))
        if self._points is not None:
            mapped._remember_points(self._points @ R.T)
        return mapped

    def _shifted(self, v: Floats) -> Self:
        moved = type(self)._of_form(self.form.shifted(v))
        if self._points is not None:
            moved._remember_points(self._points + v)
        return moved

    def is_empty(self) -> bool:
        """True when no factors satisfy the constraints, up to 1e-9 of rows scaled to unit size.

        Raises:
            SolverError: no verdict that holds.
        """
        return self._is_empty

    @cached_property
    def _is_empty(self) -> bool:
        if self._points is not None:
            return not len(self._points)
        if self._operands is not None:
            one, two = self._operands
            pair = nearest_of_hulls(one, two)
            if pair is not None:
                return math.dist(*pair) > SET_TOL * max(points_size(one), points_size(two))
        return queries.is_empty(self.form)

    def _as_intersection_of(self, one: ConvexSet, two: ConvexSet, R: Floats | None) -> Self:
        """Remember the points of both operands: their distance decides emptiness faster."""
        first, second = one._points, two._points
        if R is None and first is not None and second is not None and len(first) and len(second):
            vars(self)["_operands"] = (first, second)
        return self

    def contains(self, X: ArrayLike, tol: float | None = None) -> Bools:
        """Which of the points (k, n) lie in the set; shape (k,).

        Points outside the box of the generators are settled at once. The others are compared with
        the facets when the set is polytopal and they are known or worth finding; by the
        pseudo-inverse when it is an ellipsoid; else by a program each.

        Args:
            X: points [m]; one point may be given as (n,).
            tol: points at most this far away, in each coordinate or beyond each facet, count
                [m]; 1e-9 of the set's size unless given.

        Raises:
            SolverError: no verdict that holds.
        """
        points = as_points(X, "X", self.n)
        form = self.form
        room = SET_TOL * form.size if tol is None else tol
        near = np.abs(points - form.c) <= form.reaches(np.eye(self.n)) + room
        inside: Bools = np.asarray(near.all(axis=1))
        if not inside.any() or self.is_empty():
            return np.zeros(len(points), dtype=np.bool_)
        rest = points[inside]
        if form.is_ellipsoid:
            held = _in_ellipsoid(form, rest, room)
            if tol is not None and tol > SET_TOL * form.size:  # along its axes that is not distance
                held[~held] = [queries.distance_by_axes(form, x) <= tol for x in rest[~held]]
            inside[inside] = held
        elif (
            form.is_polytopal
            and self.n <= 3
            and (self._points is not None or len(rest) > _DIRECT_QUERIES)
        ):
            inside[inside] = self.to_polytope().contains(rest, room)
        else:
            inside[inside] = [queries.distance_by_axes(form, x) <= room for x in rest]
        return inside

    def to_polytope(self) -> Polytope:
        """The set in half-space and vertex form, from its support function alone.

        Raises:
            ShapeError: the set is curved.
            SolverError: no verdict that holds.
        """
        return self._polytope

    @cached_property
    def _polytope(self) -> Polytope:
        from hzmp_planners.sets.polytope import Polytope

        points = self.hull_points()
        return Polytope.from_vertices(points) if len(points) else Polytope.empty(self.n)

    def vertices(self) -> Floats:
        """Extreme points, shape (k, n) [m]; (0, n) when empty. See `support_hull`.

        Raises:
            ShapeError: the set is curved.
            SolverError: no verdict that holds.
        """
        return self.to_polytope().vertices()

    def volume(self) -> float:
        """Volume (area in 2-D) [m^n]; 0 for flat and empty sets.

        Zonotopes: 2^n times the sum of |det| over all n generators (Shephard 1974). Ellipsoids: in
        closed form. Other polytopal sets: of the hull of their vertices.

        Raises:
            ShapeError: the set is curved and no ellipsoid.
        """
        form = self.form
        if form.is_ellipsoid:
            return ellipsoid_volume(form)
        if form.is_polytopal and not self.nc and math.comb(self.ng, self.n) <= 100_000:
            chosen = np.array(list(itertools.combinations(range(self.ng), self.n)), dtype=np.int64)
            minors = np.linalg.det(form.G[:, chosen.reshape(-1, self.n)].swapaxes(0, 1))
            return float(2.0**self.n * np.abs(minors).sum())
        return self.to_polytope().volume()

    def remove_redundancy(self) -> Self:
        """The same set with fewer generators and constraints, all steps exact; see `redundancy`."""
        smaller = type(self)._of_form(without_redundancy(self.form))
        if self._points is not None:
            smaller._remember_points(self._points)
        return smaller

    def enclosing_zonotope(self, directions: int = 24) -> ConstrainedZonotope:
        """A constrained zonotope around the set (Figure 4 of the HZ-MP paper).

        Each norm ball is replaced by the polytope of its tangent half-spaces in `directions`
        directions, spread evenly over a ball of two or three factors.

        Args:
            directions: more are tighter: in the plane the radius is exceeded by a factor of at
                most 1 / cos(pi / directions).
        """
        return with_polytopal_balls(self.form, directions, outside=True)

    def enclosed_zonotope(self, directions: int = 24) -> ConstrainedZonotope:
        """A constrained zonotope inside the set: each norm ball by the hull of its points.

        Args:
            directions: more are tighter: in the plane the radius is missed by a factor of at most
                cos(pi / directions).
        """
        return with_polytopal_balls(self.form, directions, outside=False)


def points_size(points: Floats) -> float:
    """Unit of length of a hull [m], as `GeneratorForm.size`: its extent, or round-off far away."""
    extent = float(np.ptp(points, axis=0).max())
    return max(extent, 1e-5 * float(np.abs(points).max()))


def checked_form(
    G: ArrayLike, c: ArrayLike, A: ArrayLike | None = None, b: ArrayLike | None = None
) -> tuple[Floats, Floats, Floats, Floats]:
    """The four matrices, checked against each other; without A and b there are no constraints.

    Raises:
        ShapeError: not finite numbers, or shapes that do not fit.
    """
    generators, centre = as_floats(G, "G", 2), as_floats(c, "c", 1)
    if centre.size == 0:
        raise ShapeError("c must have at least one coordinate: a set needs a space")
    if generators.shape[0] != centre.size:
        raise ShapeError(f"G has {generators.shape[0]} rows but c has {centre.size} entries")
    ng = generators.shape[1]
    if (A is None) != (b is None):
        raise ShapeError("A and b come together: A xi = b")
    if A is None or b is None:
        return generators, centre, np.zeros((0, ng)), np.zeros(0)
    constraints, offsets = as_floats(A, "A", 2), as_floats(b, "b", 1)
    if constraints.shape != (offsets.size, ng):
        raise ShapeError(
            f"A must have shape ({offsets.size}, {ng}) for these b and G, got {constraints.shape}"
        )
    return generators, centre, constraints, offsets


def _in_ellipsoid(form: GeneratorForm, points: Floats, room: float) -> Bools:
    """By the factors of least norm; points off the range of G by more than `room` are outside."""
    offset = points - form.c
    factors = offset @ np.linalg.pinv(form.G, rcond=SET_TOL).T
    inside = factors / np.maximum(1.0, np.linalg.norm(factors, axis=1))[:, None]
    return np.asarray(np.linalg.norm(inside @ form.G.T - offset, axis=1) <= room)
