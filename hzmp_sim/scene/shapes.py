"""Convex shapes with a closed-form support function and nearest point, in the plane and in space.

Two questions are all that the outer approximation asks of a shape K:
the support function h(d) = max over K of d.x, and the nearest point of K.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.optimize import brentq
from scipy.spatial import ConvexHull, QhullError

from hzmp_planners._arrays import Floats, Ints
from hzmp_sim.scene.constants import FLAT_HULL_THICKNESS, MAX_HULL_FACETS
from hzmp_sim.scene.directions import (
    ball_normals,
    bevel_normals,
    polygon_normals,
    prism_normals,
)
from hzmp_sim.scene.nearest import nearest_on_segments, nearest_on_triangles


class Shape(Protocol):
    """A bounded convex set in n dimensions."""

    def __hash__(self) -> int:
        """Of the object: what was found for a shape can be kept."""
        ...

    @property
    def centre(self) -> Floats:
        """A point well inside the set, shape (n,) [m]."""
        ...

    def support(self, directions: Floats) -> Floats:
        """h(d) = max of d.x over the set for directions (k, n); shape (k,)."""
        ...

    def project(self, points: Floats) -> Floats:
        """Nearest point of the set to each of (k, n) points; the point itself when inside."""
        ...

    def normals(self, grow: float, tolerance: float) -> Floats:
        """Unit normals (m, n) to start an outer polytope with; they enclose the set."""
        ...


@dataclass(frozen=True, eq=False)
class Box:
    """Oriented box (3-D) or rectangle (2-D)."""

    centre: Floats
    axes: Floats
    """Unit axes as columns, shape (n, n)."""
    half: Floats
    """Half lengths [m], shape (n,)."""

    @property
    def corners(self) -> Floats:
        """Its vertices [m], shape (2^n, n)."""
        n = self.half.size
        signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * n)).reshape(n, -1).T
        return np.asarray(self.centre + (signs * self.half) @ self.axes.T)

    def support(self, directions: Floats) -> Floats:
        return np.asarray(directions @ self.centre + np.abs(directions @ self.axes) @ self.half)

    def project(self, points: Floats) -> Floats:
        local = (points - self.centre) @ self.axes
        return np.asarray(self.centre + np.clip(local, -self.half, self.half) @ self.axes.T)

    def normals(self, grow: float, tolerance: float) -> Floats:
        if self.half.size == 2:  # corners are cut where they are
            return np.vstack([self.axes.T, -self.axes.T])
        return np.asarray(bevel_normals(grow, tolerance) @ self.axes.T)


@dataclass(frozen=True, eq=False)
class Capsule:
    """Points within `radius` of a segment; a ball (disc in 2-D) when the two ends are one."""

    ends: Floats
    """End points of the segment [m], shape (2, n)."""
    radius: float

    @property
    def centre(self) -> Floats:
        return np.asarray(self.ends.mean(axis=0))

    def support(self, directions: Floats) -> Floats:
        lengths = np.linalg.norm(directions, axis=1)
        return np.asarray((directions @ self.ends.T).max(axis=1) + self.radius * lengths)

    def project(self, points: Floats) -> Floats:
        foot = nearest_on_segments(points, self.ends[:1], self.ends[1:])[:, 0]
        offset = points - foot
        length = np.linalg.norm(offset, axis=1, keepdims=True)
        return np.asarray(foot + offset * np.minimum(1.0, self.radius / np.maximum(length, 1e-300)))

    def normals(self, grow: float, tolerance: float) -> Floats:
        n = self.ends.shape[1]
        axis = self.ends[1] - self.ends[0]
        if not axis.any():
            if n == 2:
                return polygon_normals(np.eye(2), self.radius + grow, tolerance)
            return ball_normals(self.radius + grow, tolerance)
        return prism_normals(axis / np.linalg.norm(axis), self.radius + grow, tolerance)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """Solid circular cylinder in 3-D."""

    centre: Floats
    axis: Floats
    """Unit vector, shape (3,)."""
    radius: float
    half: float
    """Half of its height [m]."""

    def support(self, directions: Floats) -> Floats:
        along = directions @ self.axis
        across = np.linalg.norm(directions - along[:, None] * self.axis, axis=1)
        return np.asarray(
            directions @ self.centre + np.abs(along) * self.half + across * self.radius
        )

    def project(self, points: Floats) -> Floats:
        offset = points - self.centre
        along = offset @ self.axis
        radial = offset - along[:, None] * self.axis
        length = np.linalg.norm(radial, axis=1)
        radial = radial * np.minimum(1.0, self.radius / np.maximum(length, 1e-300))[:, None]
        along = np.clip(along, -self.half, self.half)
        return np.asarray(self.centre + along[:, None] * self.axis + radial)

    def normals(self, grow: float, tolerance: float) -> Floats:
        return prism_normals(self.axis, self.radius + grow, tolerance)


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """Solid ellipsoid in 3-D, ellipse in 2-D."""

    centre: Floats
    axes: Floats
    """Unit principal axes as columns, shape (n, n)."""
    half: Floats
    """Semi-axes [m], shape (n,)."""

    def support(self, directions: Floats) -> Floats:
        return np.asarray(
            directions @ self.centre + np.linalg.norm((directions @ self.axes) * self.half, axis=1)
        )

    def project(self, points: Floats) -> Floats:
        """Root t >= 0 of the secular equation sum (a_i p_i / (a_i^2 + t))^2 = 1.

        The left side is convex and decreasing, so Newton's method rises monotonically to the root
        from the left. It starts where the largest term alone is 1. Inside, t = 0.
        """
        local = (points - self.centre) @ self.axes
        squares = self.half**2
        t = np.maximum((np.abs(local) * self.half - squares).max(axis=1), 0.0)
        for _ in range(60):
            terms = (self.half * local / (squares + t[:, None])) ** 2
            slope = 2.0 * (terms / (squares + t[:, None])).sum(axis=1)
            step = np.maximum(terms.sum(axis=1) - 1.0, 0.0) / np.maximum(slope, 1e-300)
            t = t + step
            if (step <= 1e-15 * t).all():
                break
        nearest = squares * local / (squares + t[:, None])
        return np.asarray(self.centre + nearest @ self.axes.T)

    def normals(self, grow: float, tolerance: float) -> Floats:
        del grow, tolerance  # the cuts find where it is round
        return np.vstack([self.axes.T, -self.axes.T])


@dataclass(frozen=True, eq=False)
class Hull:
    """Convex hull of points; build with `from_points`."""

    points: Floats
    """Its vertices [m], shape (k, n)."""
    facets: Ints
    """Vertex indices of the simplices of its surface, shape (f, n)."""
    equations: Floats
    """Distinct facet planes, outward unit normal and minus offset, shape (m, n + 1)."""
    origin: tuple[Hull, Floats, Floats] | None = None
    """The hull of which it is a copy, with the axes (n, n) as columns and the position (n,) [m]."""

    def moved(self, axes: Floats, position: Floats) -> Hull:
        """A copy turned by `axes` (n, n) and then shifted to `position` (n,) [m]."""
        normals = self.equations[:, :-1] @ axes.T
        offsets = self.equations[:, -1] - normals @ position
        points = self.points @ axes.T + position
        planes = np.column_stack([normals, offsets])
        return Hull(points, self.facets, planes, (self, axes, position))

    @classmethod
    def from_points(cls, points: Floats) -> Hull:
        """Hull of (k, n) points; flat sets are thickened by `FLAT_HULL_THICKNESS`."""
        try:
            hull = ConvexHull(points)
        except (QhullError, ValueError):
            shift = FLAT_HULL_THICKNESS * np.eye(points.shape[1])
            shifts = np.vstack([np.zeros((1, points.shape[1])), shift, -shift])
            hull = ConvexHull((points[:, None, :] + shifts).reshape(-1, points.shape[1]))
        scale = max(1.0, float(np.abs(hull.points).max()))
        keys = np.round(hull.equations / np.append(np.ones(points.shape[1]), scale), 9)
        _, first = np.unique(keys + 0.0, axis=0, return_index=True)
        index = np.zeros(len(hull.points), dtype=np.int64)
        index[hull.vertices] = np.arange(len(hull.vertices))
        return cls(
            hull.points[hull.vertices], index[hull.simplices], hull.equations[np.sort(first)]
        )

    @property
    def centre(self) -> Floats:
        return np.asarray(self.points.mean(axis=0))

    def support(self, directions: Floats) -> Floats:
        return np.asarray((directions @ self.points.T).max(axis=1))

    def project(self, points: Floats) -> Floats:
        n = self.points.shape[1]
        corners = self.points[self.facets]
        if n == 2:
            candidates = nearest_on_segments(points, corners[:, 0], corners[:, 1])
        else:
            candidates = nearest_on_triangles(points, corners)
        distance = np.linalg.norm(candidates - points[:, None, :], axis=2)
        nearest = candidates[np.arange(len(points)), distance.argmin(axis=1)]
        inside = (points @ self.equations[:, :n].T + self.equations[:, n]).max(axis=1) <= 0.0
        return np.where(inside[:, None], points, nearest)

    def normals(self, grow: float, tolerance: float) -> Floats:
        del grow, tolerance
        n = self.points.shape[1]
        if len(self.equations) <= MAX_HULL_FACETS[n]:
            return self.equations[:, :n]
        return np.vstack([np.eye(n), -np.eye(n)])


def farthest(centre: Floats, generators: Floats) -> float:
    """Largest |centre + generators u| over |u| <= 1 [m], for generators of shape (n, k).

    With S = G'G and g = G'c the maximum is the minimum over t >= max eig S of the Lagrange dual
    t + g'(t I - S)^-1 g + |c|^2 (strong duality of the trust-region problem).
    """
    values, vectors = np.linalg.eigh(generators.T @ generators)
    g = vectors.T @ (generators.T @ centre)
    top, size = float(values[-1]), float(np.linalg.norm(g))
    base = float(centre @ centre)

    def slope(t: float) -> float:
        return 1.0 - float((g**2 / (t - values) ** 2).sum())

    low, high = top + 1e-12 * (top + size) + 1e-300, top + size + 1e-12
    t = low if slope(low) >= 0.0 else float(brentq(slope, low, max(high, low), xtol=1e-14))
    return float(np.sqrt(t + (g**2 / (t - values)).sum() + base))
