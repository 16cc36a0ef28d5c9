"""Unit normals to start an outer polytope of a round shape with: symmetric, hence few."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats

_ROUND = 0.02
"""Share of the radius that corners of the polygon around a disc stand out by: it has 16."""


def polygon_normals(frame: Floats, radius: float, tolerance: float) -> Floats:
    """Normals of the smallest 4k-gon whose corners stay within `tolerance` of a circle.

    `frame` (2, n) spans the plane of the circle. At most 64 sides: what is rounder than that for
    its tolerance is huge, and cuts are better placed where they are needed.
    """
    count = 4
    while count < 64 and radius * (1.0 / np.cos(np.pi / count) - 1.0) > tolerance:
        count += 4
    angle = 2.0 * np.pi * np.arange(count) / count
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    circle[np.abs(circle) < 1e-15] = 0.0
    return np.asarray(circle @ frame)


def ball_normals(radius: float, tolerance: float) -> Floats:
    """The 6 directions to the faces of a cube, with its 8 corners, or its 12 edges as well.

    Corners of the tangent polytopes stand out by 0.733, 0.240 and 0.129 of the radius.
    """
    return _cube_directions(corners=0.733 * radius > tolerance, edges=0.240 * radius > tolerance)


def round_normals(n: int) -> Floats:
    """Directions all around in 2-D or 3-D: 16 or 26."""
    return ball_normals(1.0, 0.0) if n == 3 else polygon_normals(np.eye(2), 1.0, _ROUND)


def bevel_normals(radius: float, tolerance: float) -> Floats:
    """The 6 directions to the faces of a cube, with its 12 edges, or its 8 corners as well.

    Around a box grown by the radius they stand out by 0.733, 0.225 and 0.129 of it: a bevel along
    each edge, where a corner's plane would only cut its ends.
    """
    return _cube_directions(edges=0.733 * radius > tolerance, corners=0.225 * radius > tolerance)


def _cube_directions(*, edges: bool, corners: bool) -> Floats:
    """Unit directions to the faces of a cube, and to its edges and corners if asked for."""
    grid = np.array(np.meshgrid(*[(-1.0, 0.0, 1.0)] * 3)).reshape(3, -1).T
    order = np.abs(grid).sum(axis=1)  # 1: face, 2: edge, 3: corner
    chosen = (order == 1) | (edges & (order == 2)) | (corners & (order == 3))
    return np.asarray(grid[chosen] / np.sqrt(order[chosen])[:, None])


def prism_normals(axis: Floats, radius: float, tolerance: float) -> Floats:
    """The two directions along a unit axis and those of a polygon around it (the sides in 2-D)."""
    if axis.size == 2:
        side = np.array([-axis[1], axis[0]])
        return np.vstack([axis, -axis, side, -side])
    # The frame nearest the world axes: shared plane directions mean fewer leaves.
    nearest = np.eye(3)[np.abs(axis).argmin()]
    first: Floats = nearest - (nearest @ axis) * axis
    first = first / np.linalg.norm(first)
    frame = np.vstack([first, np.cross(axis, first)])
    return np.vstack([axis, -axis, polygon_normals(frame, radius, tolerance)])
