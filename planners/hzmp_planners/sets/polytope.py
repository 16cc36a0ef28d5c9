"""Convex polytopes in half-space and vertex form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError

from hzmp_planners._arrays import Bools, Floats, Ints, as_floats, as_point, as_points, frozen
from hzmp_planners._linprog import minimize_linear
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.errors import ShapeError, SolverError


@dataclass(frozen=True, eq=False)
class Polytope:
    r"""Convex polytope :math:`P = \{x : A x \le b\}` with unit facet normals.

    Build one with `from_box`, `from_vertices` or `from_halfspaces`. Flat polytopes (segments,
    single points) carry each equality as two opposite half-spaces.
    """

    A: Floats
    """Outward unit normals, shape (m, n)."""
    b: Floats
    """Offsets [m], shape (m,)."""

    def __post_init__(self) -> None:
        A, b = as_floats(self.A, "A", 2), as_floats(self.b, "b", 1)
        if A.shape[0] != b.shape[0]:
            raise ShapeError(f"A has {A.shape[0]} rows but b has {b.shape[0]} entries")
        if A.size == 0:
            raise ShapeError(f"A must have at least one row and one column, got shape {A.shape}")
        norms = np.linalg.norm(A, axis=1)
        if (norms == 0.0).any():
            raise ShapeError(f"row {int(np.argmin(norms))} of A is zero: not a half-space")
        if not np.allclose(norms, 1.0, rtol=0.0, atol=1e-12):
            A, b = A / norms[:, None], b / norms
        object.__setattr__(self, "A", frozen(A))
        object.__setattr__(self, "b", frozen(b))

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
        basis, normals = axes[:rank], axes[rank:]
        coordinates = (points - centre) @ basis.T
        if rank == points.shape[1]:
            A, extreme = _hull(points)
        elif rank == 0:
            A, extreme = np.zeros((0, points.shape[1])), np.array([0])
        else:
            inner, extreme = _hull(coordinates)
            A = inner @ basis
        A = np.vstack([A, normals, -normals])
        return cls.from_both_forms(A, (points[extreme] @ A.T).max(axis=0), points[extreme])

    @classmethod
    def from_halfspaces(cls, A: ArrayLike, b: ArrayLike) -> Polytope:
        """The set of x with A x <= b, A of shape (m, n), b of shape (m,). Rows are normalised."""
        return cls(as_floats(A, "A", 2), as_floats(b, "b", 1))

    @classmethod
    def from_both_forms(cls, A: Floats, b: Floats, vertices: Floats) -> Polytope:
        """Half-spaces and the vertices that the caller has computed already; not checked."""
        polytope = cls(A, b)
        polytope.__dict__["vertices"] = frozen(vertices)
        return polytope

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.A.shape[1])

    @cached_property
    def vertices(self) -> Floats:
        """Extreme points, shape (k, n) [m]; (0, n) when empty.

        Raises:
            ShapeError: the polytope is unbounded.
        """
        return frozen(_vertices(self.A, self.b))

    @cached_property
    def incidence(self) -> Bools:
        """Shape (k, m): vertex i lies on the hyperplane of facet j."""
        gap = np.abs(self.vertices @ self.A.T - self.b)
        return frozen(gap <= 10.0 * PLANE_TOL * self._scale)

    @property
    def _scale(self) -> float:
        return max(1.0, float(np.abs(self.b).max(initial=0.0)))

    def violation(self, X: ArrayLike) -> Floats:
        """Signed distance of points (k, n) beyond the worst facet [m], shape (k,); <= 0 inside."""
        points = as_points(X, "X", self.n)
        return np.asarray((points @ self.A.T - self.b).max(axis=1))

    def contains(self, X: ArrayLike, tol: float = 0.0) -> Bools:
        """Which of the points (k, n) lie in the polytope, up to `tol` [m]; shape (k,)."""
        return np.asarray(self.violation(X) <= tol)

    def support(self, d: ArrayLike) -> float:
        """Largest d.x over the polytope, d of shape (n,); -inf when empty."""
        direction = as_point(d, "d", self.n)
        return float((self.vertices @ direction).max(initial=-math.inf))

    def is_empty(self) -> bool:
        """True when no point satisfies the half-spaces."""
        return len(self.vertices) == 0

    def interval_hull(self) -> tuple[Floats, Floats]:
        """Smallest axis-aligned box (lo, hi) around the polytope [m]."""
        if self.is_empty():
            raise ShapeError("an empty polytope has no interval hull")
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    def volume(self) -> float:
        """Volume (area in 2-D) [m^n]; 0 for flat and empty polytopes."""
        if self.vertices.shape[0] <= self.n:
            return 0.0
        if self.n == 1:
            return float(np.ptp(self.vertices))
        try:
            return float(ConvexHull(self.vertices).volume)
        except QhullError:
            return 0.0


def _hull(points: Floats) -> tuple[Floats, Ints]:
    """Facet normals (m, n), coplanar simplices merged, and indices of extreme points."""
    if points.shape[1] == 1:
        ends = np.unique([int(points[:, 0].argmin()), int(points[:, 0].argmax())])
        return np.array([[1.0], [-1.0]]), ends.astype(np.int64)
    hull = ConvexHull(points)
    normals: list[Floats] = []
    offsets: list[float] = []
    scale = max(1.0, float(np.abs(points).max()))
    for equation in hull.equations:
        for normal, offset in zip(normals, offsets, strict=True):
            same = np.abs(normal - equation[:-1]).max() < 1e-9
            if same and abs(offset - equation[-1]) < 1e-9 * scale:
                break
        else:
            normals.append(equation[:-1])
            offsets.append(equation[-1])
    return np.array(normals), np.sort(hull.vertices).astype(np.int64)


def _vertices(A: Floats, b: Floats) -> Floats:
    """Vertices of {A x <= b}: Chebyshev centre, then the dual hull; recursion for flat sets."""
    n = A.shape[1]
    scale = max(1.0, float(np.abs(b).max(initial=0.0)))
    centre, radius = _chebyshev(A, b)
    if centre is None:
        return np.zeros((0, n))
    if radius > 10.0 * PLANE_TOL * scale:
        return _full_vertices(A, b, centre, radius)
    # Flat: keep the hyperplanes on which the whole set lies, and recurse inside them.
    flat = [i for i in range(A.shape[0]) if _depth(A, b, i) <= 1e-8 * scale]
    _, values, axes = np.linalg.svd(A[flat], full_matrices=True)
    rank = int((values > 1e-9).sum())
    if rank == 0:
        raise SolverError("a polytope without interior has no implicit equality")
    if rank == n:
        return centre[None, :]
    basis = axes[rank:]
    projected = A @ basis.T
    norms = np.linalg.norm(projected, axis=1)
    keep = norms > 1e-9
    inner = _vertices(
        projected[keep] / norms[keep, None], (b[keep] - A[keep] @ centre) / norms[keep]
    )
    return np.asarray(centre + inner @ basis)


def _full_vertices(A: Floats, b: Floats, centre: Floats, radius: float) -> Floats:
    if A.shape[1] == 1:
        upper = (b[A[:, 0] > 0]).min(initial=math.inf)
        lower = (-b[A[:, 0] < 0]).max(initial=-math.inf)
        if not math.isfinite(upper - lower):
            raise ShapeError("the polytope is unbounded: it has no vertex form")
        return np.array([[lower], [upper]])
    # In units of the inscribed ball, since qhull's tolerances are absolute: the facets of the dual
    # points' hull are the vertices, at distances 1 / -offset; the origin is inside iff bounded.
    try:
        facets = ConvexHull(A * (radius / (b - A @ centre))[:, None]).equations
    except QhullError as error:
        raise ShapeError("the polytope is unbounded: it has no vertex form") from error
    if facets[:, -1].max() > -1e-9:
        raise ShapeError("the polytope is unbounded or a sliver: it has no usable vertex form")
    points = centre - radius * facets[:, :-1] / facets[:, -1:]
    size = float(np.ptp(points, axis=0).max())
    found: list[Floats] = []
    for point in points:
        if all(np.abs(point - other).max() > 1e-9 * max(size, 1e-3) for other in found):
            found.append(point)
    return np.array(found)


def _chebyshev(A: Floats, b: Floats) -> tuple[Floats | None, float]:
    """Centre and radius of a largest inscribed ball (None when empty)."""
    n = A.shape[1]
    size = 1.0 + float(np.abs(b).max(initial=0.0))
    optimum = minimize_linear(
        np.append(np.zeros(n), -1.0),
        upper=(np.hstack([A, np.ones((len(b), 1))]), b),
        lo=np.append(np.full(n, -math.inf), 0.0),
        hi=np.append(np.full(n, math.inf), 10.0 * size),
        purpose="largest ball in a polytope",
    )
    if optimum is None:
        return None, 0.0
    return optimum.x[:n], float(optimum.x[n])


def _depth(A: Floats, b: Floats, facet: int) -> float:
    """How far the polytope reaches inward from one of its half-spaces, at most 1 [m]."""
    n = A.shape[1]
    slack = np.append(np.zeros(len(b)), 1.0)[:, None]
    optimum = minimize_linear(
        np.append(np.zeros(n), -1.0),
        upper=(np.hstack([np.vstack([A, A[facet]]), slack]), np.append(b, b[facet])),
        hi=np.append(np.full(n, math.inf), 1.0),
        purpose="width of a flat polytope",
    )
    return 1.0 if optimum is None else float(optimum.x[n])
