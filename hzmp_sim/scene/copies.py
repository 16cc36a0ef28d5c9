"""Copies of one shape at many poses share one outer polytope, turned and shifted.

A world of a thousand geoms has few different shapes, and cutting planes are what reading them
takes its time for. Turning and shifting is exact up to round-off, and so the error stays what it
was.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope
from hzmp_sim.scene.outer import Outer, outer_polytope
from hzmp_sim.scene.shapes import Box, Capsule, Cylinder, Ellipsoid, Hull, Shape

_KEPT = 256  # shapes, some kB each


def outer_of_copy(shape: Shape, grow: float, tolerance: float) -> Outer:
    """What `outer_polytope` gives, up to a choice of directions for round hulls.

    Args:
        shape: convex shape in 2-D or 3-D.
        grow: radius of the ball it is grown by [m], > 0.
        tolerance: largest distance of a point of the result to the grown shape [m], > 0.

    Raises:
        SceneError: the shape is too large or too thin for double precision.
    """
    centre, axes = shape.centre, np.eye(shape.centre.size)
    if isinstance(shape, Hull):
        if shape.origin is None:
            return outer_polytope(shape, grow, tolerance)
        own, axes, centre = shape.origin
        outer = _of_hull(own, grow, tolerance)
    elif isinstance(shape, Box | Ellipsoid):
        axes = shape.axes
        kind = "box" if isinstance(shape, Box) else "ellipsoid"
        outer = _of_sizes(kind, tuple(shape.half.tolist()), grow, tolerance)
    elif isinstance(shape, Cylinder):  # its polygon is aligned with the world: only shifted
        sizes = (*shape.axis.tolist(), shape.radius, shape.half)
        outer = _of_sizes("cylinder", sizes, grow, tolerance)
    elif isinstance(shape, Capsule) and not np.ptp(shape.ends, axis=0).any():
        outer = _of_sizes("ball", (shape.radius, float(centre.size)), grow, tolerance)
    else:
        return outer_polytope(shape, grow, tolerance)
    return _moved(outer, axes, centre)


@lru_cache(_KEPT)
def _of_hull(hull: Hull, grow: float, tolerance: float) -> Outer:
    return outer_polytope(hull, grow, tolerance)


@lru_cache(_KEPT)
def _of_sizes(kind: str, sizes: tuple[float, ...], grow: float, tolerance: float) -> Outer:
    """Of a shape at the origin, boxes and ellipsoids in their own axes."""
    numbers = np.array(sizes)
    shape: Shape
    if kind == "cylinder":
        shape = Cylinder(np.zeros(3), numbers[:3], sizes[3], sizes[4])
    elif kind == "ball":
        shape = Capsule(np.zeros((2, int(sizes[1]))), sizes[0])
    elif kind == "box":
        shape = Box(np.zeros(len(sizes)), np.eye(len(sizes)), numbers)
    else:
        shape = Ellipsoid(np.zeros(len(sizes)), np.eye(len(sizes)), numbers)
    return outer_polytope(shape, grow, tolerance)


def _moved(outer: Outer, axes: Floats, centre: Floats) -> Outer:
    normals = outer.polytope.A @ axes.T
    corners = outer.vertices @ axes.T + centre
    offsets = outer.polytope.b + normals @ centre
    return Outer(Polytope.from_both_forms(normals, offsets, corners), corners, outer.error)
