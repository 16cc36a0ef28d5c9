"""From half-spaces to vertices and back."""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import csc_array
from scipy.spatial import ConvexHull, QhullError, cKDTree

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._clarabel import solve_socp
from hzmp_planners._linprog import attempt_linear, minimize_linear
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.errors import ShapeError, SolverError


def inscribed_ball(A: Floats, b: Floats) -> tuple[Floats, float]:
    """Centre and radius of a large ball in {A x <= b}, at most ten times the largest offset.

    max r subject to A x + r 1 <= b. A negative radius says that the half-spaces exclude each other
    and by how much at least: weights lam >= 0 with sum 1 and A'lam = 0 give r <= b.lam for every x.
    Both the ball and that bound are recomputed from what the solver returns. Radii within the
    tolerance of 0 are returned as 0, others are at least half of the largest one.

    Args:
        A: unit normals, shape (m, n).
        b: offsets [m], shape (m,).

    Raises:
        SolverError: neither HiGHS nor Clarabel returned a verdict that holds.
    """
    m, n = A.shape
    unit = float(np.abs(b).max(initial=0.0)) or 1.0
    most, tol = 10.0, PLANE_TOL
    scaled = b / unit
    rows = csc_array(np.hstack([A, np.ones((m, 1))]))
    cost = np.append(np.zeros(n), -1.0)
    for solve in (_highs, _clarabel):
        found = solve(cost, rows, scaled, most)
        if found is None:
            continue
        x, weights = found[0][:n], np.maximum(found[1], 0.0)
        radius = min(float((scaled - A @ x).min(initial=most)), most)
        # For every point in reach: r <= b.lam - x.(A'lam) + (1 - sum lam) most.
        reach = 1e3 * max(1.0, float(np.abs(x).max()))
        bound = float(scaled @ weights) + max(0.0, 1.0 - float(weights.sum())) * most
        bound += reach * float(np.abs(A.T @ weights).sum())
        if bound < -tol:
            return x * unit, bound * unit
        if radius > tol and bound <= 2.0 * radius:
            return x * unit, radius * unit
        if radius >= -tol and bound <= 2.0 * tol:
            return x * unit, 0.0
    raise SolverError("largest ball in a polytope: no solver found a verdict that holds")


def _highs(
    cost: Floats, A: csc_array[np.float64], b: Floats, most: float
) -> tuple[Floats, Floats] | None:
    lo, hi = np.full(cost.size, -np.inf), np.append(np.full(cost.size - 1, np.inf), most)
    none = csc_array((0, cost.size)), np.zeros(0)
    answer = attempt_linear(cost, upper=(A, b), equal=none, lo=lo, hi=hi)
    return None if answer is None else (answer.x, -answer.upper)


def _clarabel(
    cost: Floats, A: csc_array[np.float64], b: Floats, most: float
) -> tuple[Floats, Floats] | None:
    cap = csc_array(([1.0], ([0], [cost.size - 1])), shape=(1, cost.size))
    stacked = csc_array(np.vstack([A.toarray(), cap.toarray()]))
    answer = solve_socp(cost, stacked, np.append(b, most), [("nonnegative", len(b) + 1)])
    if not (np.isfinite(answer.x).all() and np.isfinite(answer.z).all()):
        return None
    return answer.x, answer.z[:-1]


def vertices_of(A: Floats, b: Floats) -> Floats:
    """Vertices of {A x <= b} (k, n): dual hull about an inner point; recursion for flat sets.

    Args:
        A: unit normals, shape (m, n).
        b: offsets [m], shape (m,).

    Raises:
        ShapeError: unbounded.
        SolverError: no verdict that holds.
    """
    n = A.shape[1]
    scale = max(1.0, float(np.abs(b).max(initial=0.0)))
    centre, radius = inscribed_ball(A, b)
    if radius < 0.0:
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
    inner = vertices_of(
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


def facets_of(points: Floats) -> tuple[Floats, Ints]:
    """Facet normals (m, n), coplanar simplices merged, and indices of extreme points.

    Of points that coincide one is taken, and a point that lies on fewer than n facets after
    merging (within an edge, say) is not extreme.
    """
    size = float(np.ptp(points, axis=0).max())
    double = cKDTree(points).query_pairs(1e-11 * size, output_type="ndarray")
    distinct = np.setdiff1d(np.arange(len(points)), double[:, 1])
    points = points[distinct]
    if points.shape[1] == 1:
        ends = np.unique([int(points[:, 0].argmin()), int(points[:, 0].argmax())])
        return np.array([[1.0], [-1.0]]), distinct[ends].astype(np.int64)
    hull = ConvexHull(points)
    scale = max(1.0, float(np.abs(points).max()))
    normals: list[Floats] = []
    offsets: list[float] = []
    for equation in hull.equations:
        for normal, offset in zip(normals, offsets, strict=True):
            same = np.abs(normal - equation[:-1]).max() < 1e-9
            if same and abs(offset - equation[-1]) < 1e-9 * scale:
                break
        else:
            normals.append(equation[:-1])
            offsets.append(equation[-1])
    A, b = np.array(normals), -np.array(offsets)
    extreme = np.sort(hull.vertices)
    on = np.abs(points[extreme] @ A.T - b) <= 1e-9 * scale
    extreme = extreme[on.sum(axis=1) >= points.shape[1]]
    return A, distinct[extreme].astype(np.int64)
