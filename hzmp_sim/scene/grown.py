"""A part of a geom, grown by the moving body: where the body's centre must not be."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope
from hzmp_sim.scene.bodies import Body
from hzmp_sim.scene.body_shape import BodyShape
from hzmp_sim.scene.constants import (
    CLIP_RATIO,
    MIN_GROWTH,
    SLICE_SHARE,
    SUM_SHARE,
    SUM_TOL,
    TOUCH_TOL,
)
from hzmp_sim.scene.copies import outer_of_copy
from hzmp_sim.scene.geoms import HalfSpace, Part
from hzmp_sim.scene.minkowski import Difference
from hzmp_sim.scene.outer import Outer, outer_polytope
from hzmp_sim.scene.placement import Bounds
from hzmp_sim.scene.planar import slice_halfspace, slice_shape, vertical_range
from hzmp_sim.scene.scene import Role
from hzmp_sim.scene.shapes import Shape


def grown_obstacle(
    part: Part,
    body: Body,
    shape: BodyShape,
    bounds: Bounds,
    clearance: float,
    margin: float,
    tolerance: float,
) -> tuple[Outer | None, Role, str]:
    """The obstacle of the centre that a part of a geom is, or None; its role, and why it is none.

    Args:
        part: of a geom, in the world.
        body: how it moves.
        shape: what stands for it.
        bounds: box of the centre (lo, hi), each (n,) [m].
        clearance: distance to keep [m].
        margin: contact margin of the geom [m].
        tolerance: how much larger than exact the obstacle may be [m].
    """
    solid, excess = part.shape, part.excess + shape.excess
    if body.planar:
        low, high = body.heights
        span = f"{round(low, 6) + 0.0:g} to {round(high, 6) + 0.0:g} m"
        beside = f"not within the heights {span} that the body moves in"
        # Clearance is kept upwards and downwards too, from what reaches into these heights.
        thick = (low - clearance, high + clearance)
        if isinstance(solid, HalfSpace):
            if slice_halfspace(solid, low, high) is None:
                return None, "beside", beside
            solid = slice_halfspace(solid, *thick) or solid
        else:
            bottom, top = vertical_range(solid)
            if top <= low + TOUCH_TOL or bottom >= high - TOUCH_TOL:
                return None, "beside", beside
            solid, slack = slice_shape(solid, *thick, SLICE_SHARE * tolerance)
            excess += slack
    grow = max(shape.radius + clearance + margin, MIN_GROWTH)
    if isinstance(solid, HalfSpace):
        outer = _halfspace_obstacle(solid, shape, bounds, grow)
    else:
        sum_ = solid
        if shape.kind != "ball":
            sum_ = Difference(solid, shape.core, max(SUM_SHARE * tolerance, SUM_TOL))
        if _is_far(sum_, bounds, grow):
            return None, "outside", "outside the workspace"
        window = _window(sum_, bounds, body.radius + clearance + margin)
        if window is None:
            outer = outer_of_copy(sum_, grow, tolerance - excess)
        else:
            outer = outer_polytope(sum_, grow, tolerance - excess, window)
    if not _meets(outer, bounds):
        return None, "outside", "outside the workspace"
    return Outer(outer.polytope, outer.vertices, outer.error + excess), "obstacle", ""


def _halfspace_obstacle(plane: HalfSpace, shape: BodyShape, bounds: Bounds, grow: float) -> Outer:
    """The part of the grown half-space around the bounds, as a polytope."""
    low, high = bounds[0] - 1.0, bounds[1] + 1.0
    box = Polytope.from_box(low, high)
    offset = plane.offset + float(shape.core.support(-plane.normal[None, :])[0]) + grow
    if offset >= -least_over_box(-plane.normal, low, high):  # all of the box
        return Outer(box, box.vertices(), 0.0)
    A, b = np.vstack([box.A, plane.normal]), np.append(box.b, offset)
    polytope = Polytope.from_halfspaces(A, b)
    return Outer(polytope, polytope.vertices(), 0.0)


def _window(shape: Shape, bounds: Bounds, room: float) -> Bounds | None:
    """The box to cut a shape off at, `room` beyond the bounds: None unless it dwarfs them."""
    size = float((bounds[1] - bounds[0]).max())
    low, high = bounds[0] - CLIP_RATIO * size - room, bounds[1] + CLIP_RATIO * size + room
    axes = np.eye(low.size)
    fits = (shape.support(axes) <= high).all() and (-shape.support(-axes) >= low).all()
    return None if fits else (bounds[0] - room, bounds[1] + room)


def _is_far(shape: Shape, bounds: Bounds, grow: float) -> bool:
    """The box around the grown shape misses the bounds: a quick test before the exact one."""
    axes = np.eye(bounds[0].size)
    high, low = shape.support(axes) + grow, -shape.support(-axes) - grow
    return bool((high <= bounds[0]).any() or (low >= bounds[1]).any())


def _meets(outer: Outer, bounds: Bounds) -> bool:
    """The obstacle reaches into the interior of the bounds (no axis or facet separates them)."""
    low, high = bounds
    if outer.vertices.shape[0] == 0:
        return False
    if (outer.vertices.max(axis=0) <= low + 1e-9).any():
        return False
    if (outer.vertices.min(axis=0) >= high - 1e-9).any():
        return False
    A, b = outer.polytope.A, outer.polytope.b
    return bool((least_over_box(A, low, high) < b - 1e-9).all())


def least_over_box(normals: Floats, low: Floats, high: Floats) -> Floats:
    """Min of normals.x over the box, shape (m,) or ()."""
    return np.asarray(np.where(normals > 0.0, normals * low, normals * high).sum(axis=-1))
