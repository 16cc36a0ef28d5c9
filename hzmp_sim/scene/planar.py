"""Shapes seen by a body that moves in a horizontal plane: the slice at its height, from above.

The slice of a shape S between two heights, projected to the plane, has by Lagrangian duality the
support function  h(d) = min over t of h_S(d, t) + max(-t low, -t high):  one-dimensional, convex,
and an upper bound for every t, so what is built from it always contains the true slice.
"""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.scene.constants import SLICE_DIRECTIONS, TOUCH_TOL
from hzmp_sim.scene.geoms import HalfSpace, corners
from hzmp_sim.scene.shapes import Box, Capsule, Cylinder, Ellipsoid, Hull, Shape

_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


def vertical_range(shape: Shape) -> tuple[float, float]:
    """Lowest and highest z of the shape [m]."""
    top, minus_bottom = shape.support(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]))
    return -float(minus_bottom), float(top)


def slice_support(shape: Shape, directions: Floats, low: float, high: float) -> Floats:
    """Support function (k,) of the slice low <= z <= high in horizontal directions (k, 2) [m].

    The slice must not be empty. Golden-section search over the angle of (d, t), exact to round-off
    and never below the true value.
    """

    def bound(angle: Floats) -> Floats:
        t = np.tan(angle)
        lifted = np.column_stack([directions, t])
        return np.asarray(shape.support(lifted) + np.maximum(-t * low, -t * high))

    a = np.full(len(directions), -0.5 * np.pi + 1e-6)
    b = -a
    best = bound(np.zeros(len(directions)))
    for _ in range(70):
        c, d = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
        at_c, at_d = bound(c), bound(d)
        best = np.minimum(best, np.minimum(at_c, at_d))
        left = at_c <= at_d
        a, b = np.where(left, a, c), np.where(left, d, b)
    return best


def slice_shape(shape: Shape, low: float, high: float, tolerance: float) -> tuple[Shape, float]:
    """The slice low <= z <= high of a shape, projected to the plane, as a 2-D shape.

    Args:
        shape: 3-D shape that reaches into the slice.
        low: lower height [m].
        high: upper height [m].
        tolerance: how far the result may go beyond the slice [m], > 0.

    Returns:
        The 2-D shape, which contains the slice, and how far at most it goes beyond it [m].
    """
    if isinstance(shape, Hull):
        return Hull.from_points(_clipped(shape, low, high)), 0.0
    if isinstance(shape, Box):
        upright = np.abs(shape.axes[2]) > 1.0 - 1e-12
        if upright.any():
            flat = shape.axes[:2, ~upright]
            return Box(shape.centre[:2], flat, shape.half[~upright]), 0.0
        return Hull.from_points(_clipped(Hull.from_points(corners(shape)), low, high)), 0.0
    if _turns_about_vertical(shape):
        centre = shape.centre[:2]
        radius = float(slice_support(shape, np.array([[1.0, 0.0]]), low, high)[0] - centre[0])
        return Capsule(np.vstack([centre, centre]), radius), 0.0
    polygon, excess = _circumscribed(shape, low, high, SLICE_DIRECTIONS[0])
    for sides in SLICE_DIRECTIONS[1:]:
        if excess <= tolerance:
            break
        polygon, excess = _circumscribed(shape, low, high, sides)
    return polygon, excess


def slice_halfspace(plane: HalfSpace, low: float, high: float) -> HalfSpace | None:
    """The slice of a half-space as a 2-D half-space; None for a floor or ceiling.

    Horizontal planes that reach into the range fill the whole plane: the offset is then +inf.
    """
    across = float(np.linalg.norm(plane.normal[:2]))
    lowest = min(plane.normal[2] * low, plane.normal[2] * high)
    if across < 1e-9:
        return (
            None if plane.offset - lowest <= TOUCH_TOL else HalfSpace(np.array([1.0, 0.0]), np.inf)
        )
    return HalfSpace(plane.normal[:2] / across, (plane.offset - lowest) / across)


def is_upright_prism(shape: Shape, low: float, high: float) -> bool:
    """True when every horizontal cut of the shape between the two heights is the same set."""
    bottom, top = vertical_range(shape)
    if bottom > low + TOUCH_TOL or top < high - TOUCH_TOL:
        return False
    low, high = max(low, bottom), min(high, top)
    directions = _circle(SLICE_DIRECTIONS[0])
    whole = slice_support(shape, directions, low, high)
    ends = [slice_support(shape, directions, z, z) for z in (low, high)]
    return all(float(np.abs(whole - end).max()) < 1e-5 for end in ends)


def _circle(k: int) -> Floats:
    angle = 2.0 * np.pi * np.arange(k) / k
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _turns_about_vertical(shape: Shape) -> bool:
    if isinstance(shape, Capsule):
        return not (shape.ends[1] - shape.ends[0])[:2].any()
    if isinstance(shape, Cylinder):
        return bool(abs(shape.axis[2]) > 1.0 - 1e-12)
    if isinstance(shape, Ellipsoid):
        upright = np.abs(shape.axes[2]) > 1.0 - 1e-12
        return bool(upright.any() and np.ptp(shape.half[~upright]) < 1e-12)
    return False


def _clipped(hull: Hull, low: float, high: float) -> Floats:
    """Projections (k, 2) of the corners of the part of a polyhedron between two heights."""
    points = hull.points
    z = points[:, 2]
    found = [points[(z >= low) & (z <= high)]]
    pairs = np.vstack([hull.facets[:, [0, 1]], hull.facets[:, [1, 2]], hull.facets[:, [2, 0]]])
    for level in (low, high):
        side = z[pairs] - level
        crossing = side[:, 0] * side[:, 1] < 0.0
        start, end = points[pairs[crossing, 0]], points[pairs[crossing, 1]]
        share = side[crossing, 0] / (side[crossing, 0] - side[crossing, 1])
        found.append(start + share[:, None] * (end - start))
    return np.vstack(found)[:, :2]


def _circumscribed(shape: Shape, low: float, high: float, sides: int) -> tuple[Hull, float]:
    """Polygon of tangents around the slice, and a bound on how far it stands out.

    The slice touches every side of the polygon; a corner is therefore nearer to the slice than to
    the chord between its two neighbouring corners.
    """
    directions = _circle(sides)
    offsets = slice_support(shape, directions, low, high)
    following, offset = np.roll(directions, -1, axis=0), np.roll(offsets, -1)
    det = directions[:, 0] * following[:, 1] - directions[:, 1] * following[:, 0]
    x = (offsets * following[:, 1] - offset * directions[:, 1]) / det
    y = (directions[:, 0] * offset - following[:, 0] * offsets) / det
    points = np.column_stack([x, y])
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    chord, to_corner = after - before, points - before
    area = np.abs(chord[:, 0] * to_corner[:, 1] - chord[:, 1] * to_corner[:, 0])
    height = area / np.maximum(np.linalg.norm(chord, axis=1), 1e-12)
    return Hull.from_points(points), float(height.max())
