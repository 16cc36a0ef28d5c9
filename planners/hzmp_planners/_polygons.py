"""Convex polygons given by their corners in order."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints


def clip_polygon(corners: Floats, height: Floats) -> Floats:
    """The part of a segment or convex polygon where height <= 0 (Sutherland and Hodgman 1974).

    Args:
        corners: shape (k, n); two are the ends of a segment.
        height: values of an affine function at the corners, shape (k,).

    Returns:
        Corners in order, shape (m, n); (0, n) when nothing is left.
    """
    kept: list[Floats] = []
    for i in range(len(corners)):
        if len(corners) > 2 or i > 0:
            h, g = height[i - 1], height[i]
            if (h < 0.0 < g) or (g < 0.0 < h):
                kept.append(corners[i - 1] + (h / (h - g)) * (corners[i] - corners[i - 1]))
        if height[i] <= 0.0:
            kept.append(corners[i])
    return np.array(kept).reshape(-1, corners.shape[1])


def measure(corners: Floats) -> float:
    """Length of a segment or area of a convex polygon (k, n), 0 of a point [m or m^2].

    Corners may repeat.
    """
    if len(corners) == 2:
        return float(np.linalg.norm(corners[1] - corners[0]))
    spokes = corners[1:] - corners[0]
    # The area vectors of the triangles of a fan; those of a polygon in the plane point out of it.
    flat = np.pad(spokes, ((0, 0), (0, 3 - spokes.shape[1])))
    return float(np.linalg.norm(np.cross(flat[:-1], flat[1:]).sum(axis=0))) / 2.0


def counter_clockwise_rows(vertices: Floats) -> Ints:
    """Numbers of the vertices (k, 2) of a convex polygon in counter-clockwise order."""
    offset = vertices - vertices.mean(axis=0)
    return np.asarray(np.arctan2(offset[:, 1], offset[:, 0]).argsort())


def counter_clockwise(vertices: Floats) -> Floats:
    """The vertices (k, 2) of a convex polygon in counter-clockwise order."""
    return np.asarray(vertices[counter_clockwise_rows(vertices)])


def facet_corners(vertices: Floats, A: Floats, incidence: Bools) -> list[tuple[int, Ints]]:
    """The facets of a 3-D polytope: row of A, and corners counter-clockwise seen from outside.

    Half-spaces that touch fewer than three vertices bound no facet and are left out.

    Args:
        vertices: shape (k, 3) [m].
        A: outward unit normals, shape (m, 3).
        incidence: vertex i lies on the plane of half-space j, shape (k, m).
    """
    found = []
    for row, (normal, on) in enumerate(zip(A, incidence.T, strict=True)):
        corners = on.nonzero()[0]
        if len(corners) < 3:
            continue
        # Two axes in the plane. Written out: np.cross takes most of the time of a large space.
        x, y, z = normal.tolist()
        axis = int(np.abs(normal).argmin())
        u = np.array([(0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0)][axis])
        a, b, c = u.tolist()
        v = np.array([y * c - z * b, z * a - x * c, x * b - y * a])
        offset = vertices[corners] - vertices[corners].mean(axis=0)
        angles = np.arctan2(offset @ v, offset @ u)
        found.append((row, corners[angles.argsort()]))
    return found
