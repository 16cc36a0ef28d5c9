"""Copies of one shape at many poses share one outer polytope, turned and shifted.

A world of a thousand geoms has few different shapes, and cutting planes are what reading them
takes its time for. Turning and shifting is exact up to round-off, and so the error stays what it
was. Sums with a body's core are only shifted: the core does not turn with the geom.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope
from hzmp_sim.scene.minkowski import Difference
from hzmp_sim.scene.outer import Outer, outer_polytope
from hzmp_sim.scene.shapes import Box, Capsule, Cylinder, Ellipsoid, Hull, Shape

_KEPT = 256  # shapes, some kB each

_Key = tuple[str, tuple[float, ...], Hull | None]
"""Kind, numbers and original of a shape at the origin."""


def outer_of_copy(shape: Shape, grow: float, tolerance: float) -> Outer:
    """What `outer_polytope` gives, up to a choice of directions for round hulls.

    Args:
        shape: convex shape in 2-D or 3-D.
        grow: radius of the ball it is grown by [m], > 0.
        tolerance: largest distance of a point of the result to the grown shape [m], > 0.

    Raises:
        SceneError: the shape is too large or too thin for double precision.
    """
    if isinstance(shape, Difference):
        key = _key(shape.shape, turned=False)
        if key is None:
            return outer_polytope(shape, grow, tolerance)
        outer = _of_sum(key, shape.core, shape.precision, grow, tolerance)
        return _moved(outer, np.eye(shape.centre.size), _position(shape.shape))
    key = _key(shape, turned=True)
    if key is None:
        return outer_polytope(shape, grow, tolerance)
    axes = np.eye(shape.centre.size)
    if isinstance(shape, Box | Ellipsoid):
        axes = shape.axes
    elif isinstance(shape, Hull) and shape.origin is not None:
        axes = shape.origin[1]
    return _moved(_of_shape(key, grow, tolerance), axes, _position(shape))


def _position(shape: Shape) -> Floats:
    """Where the copy is, with the shape of `_key` at the origin."""
    return shape.origin[2] if isinstance(shape, Hull) and shape.origin else shape.centre


def _key(shape: Shape, *, turned: bool) -> _Key | None:
    """What copies have in common, that of turned ones too; None if it is not worth to look.

    A cylinder's polygon is aligned with the world: it is only shifted.
    """
    if isinstance(shape, Hull):
        if shape.origin is None:
            return None
        own, axes, _ = shape.origin
        return "hull", () if turned else tuple(axes.ravel().tolist()), own
    if isinstance(shape, Box | Ellipsoid):
        kind = "box" if isinstance(shape, Box) else "ellipsoid"
        axes = np.eye(shape.centre.size) if turned else shape.axes
        return kind, (*shape.half.tolist(), *axes.ravel().tolist()), None
    if isinstance(shape, Cylinder):
        return "cylinder", (*shape.axis.tolist(), shape.radius, shape.half), None
    if isinstance(shape, Capsule) and not np.ptp(shape.ends, axis=0).any():
        return "ball", (shape.radius, float(shape.centre.size)), None
    return None


@lru_cache(_KEPT)
def _of_shape(key: _Key, grow: float, tolerance: float) -> Outer:
    return outer_polytope(_at_origin(key), grow, tolerance)


@lru_cache(_KEPT)
def _of_sum(key: _Key, core: Shape, precision: float, grow: float, tolerance: float) -> Outer:
    return outer_polytope(Difference(_at_origin(key), core, precision), grow, tolerance)


def _at_origin(key: _Key) -> Shape:
    kind, sizes, own = key
    numbers = np.array(sizes)
    if own is not None:
        axes = numbers.reshape(own.centre.size, -1)
        return own.moved(axes, np.zeros(own.centre.size)) if numbers.size else own
    if kind == "cylinder":
        return Cylinder(np.zeros(3), numbers[:3], sizes[3], sizes[4])
    if kind == "ball":
        return Capsule(np.zeros((2, int(sizes[1]))), sizes[0])
    n = 2 if len(sizes) == 6 else 3
    half, axes = numbers[:n], numbers[n:].reshape(n, n)
    return (Box if kind == "box" else Ellipsoid)(np.zeros(n), axes, half)


def _moved(outer: Outer, axes: Floats, centre: Floats) -> Outer:
    normals = outer.polytope.A @ axes.T
    corners = outer.vertices @ axes.T + centre
    offsets = outer.polytope.b + normals @ centre
    return Outer(Polytope.from_both_forms(normals, offsets, corners), corners, outer.error)
