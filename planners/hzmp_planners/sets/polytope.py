"""Convex polytopes in half-space and vertex form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError

from hzmp_planners._arrays import Bools, Floats, as_floats, as_points, frozen
from hzmp_planners._linprog import minimize_linear
from hzmp_planners.constants import PLANE_TOL, SET_TOL
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.convex_set import ConvexSet
from hzmp_planners.sets.form.form import GeneratorForm
from hzmp_planners.sets.hulls.vertex_enumeration import facets_of, inscribed_ball, vertices_of


@dataclass(frozen=True, eq=False, init=False)
class Polytope(ConvexSet):
    r"""Convex polytope :math:`P = \{x : A x \le b\}` with unit facet normals.

    Build one with `from_box`, `from_vertices` or `from_halfspaces`. Flat polytopes (segments,
    single points) carry each equality as two opposite half-spaces. Unbounded ones have no vertex
    form; they can cut any other set, ``Z & P``.
    """

    A: Floats
    """Outward unit normals, shape (m, n)."""
    b: Floats
    """Offsets [m], shape (m,)."""

    def __init__(self, A: ArrayLike, b: ArrayLike) -> None:
        normals, offsets = as_floats(A, "A", 2), as_floats(b, "b", 1)
        if normals.shape[0] != offsets.shape[0]:
            raise ShapeError(f"A has {normals.shape[0]} rows but b has {offsets.shape[0]} entries")
        if normals.size == 0:
            raise ShapeError(
                f"A must have at least one row and one column, got shape {normals.shape}"
            )
        norms = np.linalg.norm(normals, axis=1)
        if (norms == 0.0).any():
            raise ShapeError(f"row {int(np.argmin(norms))} of A is zero: not a half-space")
        if (np.abs(norms - 1.0) > 1e-12).any():
            normals, offsets = normals / norms[:, None], offsets / norms
        vars(self).update(A=frozen(normals), b=frozen(offsets))

    @classmethod
    def from_box(cls, lo: ArrayLike, hi: ArrayLike) -> Polytope:
        """Axis-aligned box with corners `lo` and `hi`, each of shape (n,) [m].

        Raises:
            ShapeError: shapes differ, or some lo > hi.
        """
        low, high = as_floats(lo, "lo", 1), as_floats(hi, "hi", 1)
        if low.shape != high.shape or low.size == 0:
            raise ShapeError(f"lo and hi must have one shape (n,), got {low.shape}, {high.shape}")
        if (low > high).any():
            axis = int(np.argmax(low - high))
            raise ShapeError(f"lo must not exceed hi, but axis {axis}: {low[axis]} > {high[axis]}")
        eye = np.eye(low.size)
        box = cls(np.vstack([eye, -eye]), np.concatenate([high, -low]))
        corners = np.array(list(product(*zip(low.tolist(), high.tolist(), strict=True))))
        return cls.from_both_forms(box.A, box.b, np.unique(corners, axis=0))

    @classmethod
    def from_vertices(cls, V: ArrayLike) -> Polytope:
        """Convex hull of the points `V` of shape (m, n) [m]; flat hulls are allowed.

        Raises:
            ShapeError: no points, or not finite.
        """
        points = as_floats(V, "V", 2)
        if points.shape[0] == 0 or points.shape[1] == 0:
            raise ShapeError(f"V must hold at least one point, got shape {points.shape}")
        centre = points.mean(axis=0)
        size = float(np.abs(points - centre).max())
        # Thinner than the tolerance, or than the round-off of coordinates far away, is flat.
        thin = max(PLANE_TOL * size, 8.0 * np.finfo(np.float64).eps * float(np.abs(points).max()))
        _, spread, axes = np.linalg.svd(points - centre, full_matrices=True)
        rank = int((spread > thin * math.sqrt(points.shape[0])).sum())
        A, extreme = np.zeros((0, 0)), np.zeros(0, dtype=np.int64)
        if rank == points.shape[1]:
            A, extreme = facets_of(points)
            rank -= len(extreme) <= rank  # too thin for facets that are told apart
        basis, normals = axes[:rank], axes[rank:]
        coordinates = (points - centre) @ basis.T
        if rank == points.shape[1]:
            pass
        elif rank == 0:
            A, extreme = np.zeros((0, points.shape[1])), np.array([0])
        else:
            inner, extreme = facets_of(coordinates)
            A = inner @ basis
        A = np.vstack([A, normals, -normals])
        return cls.from_both_forms(A, (points[extreme] @ A.T).max(axis=0), points[extreme])

    @classmethod
    def from_halfspaces(
        cls,
        A: ArrayLike,
        b: ArrayLike,
        A_eq: ArrayLike | None = None,
        b_eq: ArrayLike | None = None,
    ) -> Polytope:
        """The set of x with A x <= b and A_eq x = b_eq; perhaps empty, perhaps unbounded.

        Args:
            A: shape (m, n); rows are normalised.
            b: shape (m,).
            A_eq: shape (k, n), or None. Each row is kept as two opposite half-spaces.
            b_eq: shape (k,).

        Raises:
            ShapeError: shapes do not fit, a row is zero, or there is no row at all.
        """
        if (A_eq is None) != (b_eq is None):
            raise ShapeError("A_eq and b_eq come together: A_eq x = b_eq")
        if A_eq is None or b_eq is None:
            return cls(A, b)
        E, e = as_floats(A_eq, "A_eq", 2), as_floats(b_eq, "b_eq", 1)
        if len(E) != len(e):
            raise ShapeError(f"A_eq has {len(E)} rows but b_eq has {len(e)} entries")
        if np.size(A) == 0 and np.size(b) == 0:
            return cls(np.vstack([E, -E]), np.concatenate([e, -e]))
        inequalities = cls(A, b)
        if inequalities.n != E.shape[1]:
            raise ShapeError(f"A has {inequalities.n} columns but A_eq has {E.shape[1]}")
        rows = np.vstack([inequalities.A, E, -E])
        return cls(rows, np.concatenate([inequalities.b, e, -e]))

    @classmethod
    def from_both_forms(cls, A: Floats, b: Floats, vertices: Floats) -> Polytope:
        """Half-spaces and the vertices that the caller has computed already; not checked."""
        polytope = cls(A, b)
        polytope._remember_points(vertices)
        return polytope

    @classmethod
    def empty(cls, n: int) -> Polytope:
        """The empty set of R^n, as two half-spaces that exclude each other."""
        if n < 1:
            raise ShapeError(f"a set needs a space of at least one dimension, got {n}")
        A = np.zeros((2, n))
        A[:, 0] = 1.0, -1.0
        return cls.from_both_forms(A, -np.ones(2), np.zeros((0, n)))

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.A.shape[1])

    def _make_form(self) -> GeneratorForm:
        if self.is_empty():  # no factors meet 0 = 1
            none = np.zeros((self.n, 0))
            return GeneratorForm(none, np.zeros(self.n), np.zeros((1, 0)), np.ones(1), ())
        return GeneratorForm.of_points(self.vertices())

    def to_polytope(self) -> Polytope:
        """The set itself."""
        return self

    def vertices(self) -> Floats:
        """Extreme points, shape (k, n) [m]; (0, n) when empty.

        Raises:
            ShapeError: the polytope is unbounded.
        """
        if self._points is None:
            self._remember_points(vertices_of(self.A, self.b))
        assert self._points is not None
        return self._points

    @cached_property
    def incidence(self) -> Bools:
        """Shape (k, m): vertex i lies on the hyperplane of facet j."""
        gap = np.abs(self.vertices() @ self.A.T - self.b)
        return frozen(gap <= 10.0 * PLANE_TOL * max(1.0, float(np.abs(self.b).max(initial=0.0))))

    def violation(self, X: ArrayLike) -> Floats:
        """Signed distance of points (k, n) beyond the worst facet [m], shape (k,); <= 0 inside."""
        points = as_points(X, "X", self.n)
        return np.asarray((points @ self.A.T - self.b).max(axis=1))

    def contains(self, X: ArrayLike, tol: float | None = None) -> Bools:
        """Which of the points (k, n) lie in the polytope; shape (k,).

        Args:
            X: points [m]; one point may be given as (n,).
            tol: points at most this far beyond each facet count [m]; 1e-9 of the largest offset
                unless given.
        """
        room = SET_TOL * (float(np.abs(self.b).max()) or 1.0) if tol is None else tol
        return np.asarray(self.violation(X) <= room)

    def _mapped(self, R: Floats) -> Polytope:
        if R.shape[0] == R.shape[1] and np.linalg.cond(R) < 1e8:  # also when it is unbounded
            A = self.A @ np.linalg.inv(R)
            if self._points is None:
                return Polytope(A, self.b)
            return Polytope.from_both_forms(A, self.b, self._points @ R.T)
        points = self.vertices() @ R.T
        return Polytope.from_vertices(points) if len(points) else Polytope.empty(len(R))

    def _shifted(self, v: Floats) -> Polytope:
        b = self.b + self.A @ v
        if self._points is None:
            return Polytope(self.A, b)
        return Polytope.from_both_forms(self.A, b, self._points + v)

    def is_empty(self) -> bool:
        """True when no point satisfies the half-spaces, up to 1e-10 of the largest offset.

        Raises:
            SolverError: no verdict that holds.
        """
        if self._points is not None:
            return len(self._points) == 0
        return self._is_empty

    @cached_property
    def _is_empty(self) -> bool:
        return inscribed_ball(self.A, self.b)[1] < 0.0

    def _farthest(self, d: Floats) -> Floats | None:
        points = self.vertices()
        return np.asarray(points[int((points @ d).argmax())]) if len(points) else None

    def volume(self) -> float:
        """Volume (area in 2-D) [m^n]; 0 for flat and empty polytopes."""
        points = self.vertices()
        if len(points) <= self.n:
            return 0.0
        extent = np.ptp(points, axis=0)  # qhull's tolerances are absolute: axes of unit extent
        if extent.min() == 0.0:
            return 0.0
        if self.n == 1:
            return float(extent[0])
        try:
            return float(ConvexHull(points / extent).volume * np.prod(extent))
        except QhullError:
            return 0.0

    def surface_area(self) -> float:
        """Area of the boundary (perimeter in 2-D) [m^(n-1)]; 0 for flat and empty polytopes."""
        flat = self.n == 1 or self.volume() == 0.0
        return 0.0 if flat else float(ConvexHull(self.vertices()).area)

    def remove_redundancy(self) -> Polytope:
        """The same polytope without half-spaces that the others imply: a linear program each.

        Raises:
            SolverError: a linear program ended without a verdict.
        """
        if self.is_empty():  # any half-space can seem implied by others that exclude each other
            return Polytope.empty(self.n)
        keep = np.ones(len(self.b), dtype=np.bool_)
        room = PLANE_TOL * max(1.0, float(np.abs(self.b).max()))
        for i in range(len(self.b)):
            keep[i] = False
            rows = np.append(np.flatnonzero(keep), i)
            wider = self.b[rows] + np.append(np.zeros(keep.sum()), 1.0)  # bounds the program
            found = minimize_linear(
                -self.A[i], upper=(self.A[rows], wider), purpose="redundancy of a half-space"
            )
            keep[i] = found is not None and -found.value > self.b[i] + room
        if not keep.any():
            return self
        smaller = Polytope(self.A[keep], self.b[keep])
        if self._points is not None:
            smaller._remember_points(self._points)
        return smaller

    def _fields(self) -> dict[str, Any]:
        known = {} if self._points is None else {"points": self._points.tolist()}
        return {"A": self.A.tolist(), "b": self.b.tolist()} | known
