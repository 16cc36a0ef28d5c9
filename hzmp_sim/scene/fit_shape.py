"""The shape that stands for a body: read from its geoms, chosen so that most free space is left."""

from __future__ import annotations

import copy
import math

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_sim.scene.bodies import Body
from hzmp_sim.scene.body_shape import BodyShape, ShapeChoice
from hzmp_sim.scene.constants import (
    BALL_SHARE,
    BODY_SHARE,
    BODY_TOL_SHARE,
    MAX_TILT,
    MIN_TOLERANCE,
)
from hzmp_sim.scene.geoms import HalfSpace, corners, geom_shape
from hzmp_sim.scene.outer import outer_polytope
from hzmp_sim.scene.planar import slice_shape, vertical_range
from hzmp_sim.scene.shapes import Box, Capsule, Cylinder, Hull, Shape
from hzmp_sim.scene.upright import upright_cylinder

_ROUND_OFF = 1e-9  # [m] between heights of one point, found in two ways


def fit_shape(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    body: Body,
    choice: ShapeChoice,
    max_tilt: float | None,
    tolerance: float | None,
) -> BodyShape:
    """The shape of a body that stands in `data`.

    Args:
        model: compiled, with the body.
        data: its state, kinematics done.
        body: which one.
        choice: of the shape.
        max_tilt: of a free body [rad], > 0; None: `MAX_TILT`.
        tolerance: how much larger than exact an obstacle may be [m]; None: the default.

    Raises:
        SceneError: the body turns in ways that the chosen shape does not hold it for.
    """
    if max_tilt is not None and body.orientation != "tilts":
        raise SceneError(f"max_tilt is for free bodies; body {body.name!r} has no free joint")
    n = 2 if body.planar else 3
    ball = BodyShape("ball", Capsule(np.zeros((2, n)), 0.0), body.radius)
    limit = MAX_TILT if max_tilt is None else max_tilt
    upright = float(np.clip(data.xmat[body.id][8], -1.0, 1.0))
    stands = math.acos(upright)  # its z axis off the vertical
    fitting, why = {
        "fixed": ("hull", "keeps its orientation"),
        "tilts": ("cylinder", "tilts as it flies"),
        "turns": ("ball", "may turn any way that its joints let it"),
    }[body.orientation]
    if fitting == "cylinder" and stands > limit:
        fitting, why = "ball", f"stands tilted by {stands:.3g} rad, beyond {limit:.3g}"
    if choice not in ("auto", "ball", fitting):
        valid = ", ".join(dict.fromkeys(["auto", "ball", fitting]))
        raise SceneError(f"shape {choice!r} does not suit body {body.name!r}: it {why}; {valid} do")
    if choice == "ball" or fitting == "ball":
        return ball
    # The same whether the default tolerance is given or not: a run is read again with it given.
    least = MIN_TOLERANCE if tolerance is None else min(tolerance, MIN_TOLERANCE)
    fine = min(BODY_SHARE * body.radius, BODY_TOL_SHARE * least)
    if fitting == "hull":
        shape = _hull(_geom_shapes(model, data, body, np.eye(3)), n, fine)
    else:
        turn = np.array(data.xmat[body.id]).reshape(3, 3)
        shape = _cylinder(_geom_shapes(model, data, body, turn), limit, fine)
    small = shape.volume <= BALL_SHARE * ball.volume
    return shape if small or choice != "auto" else ball


def _geom_shapes(
    model: mujoco.MjModel, data: mujoco.MjData, body: Body, turn: Floats
) -> list[Shape]:
    """Its geoms about its centre, in a frame with axes `turn` (3, 3) as columns."""
    about, geoms = copy.copy(data), list(body.geoms)
    about.geom_xpos[geoms] = (data.geom_xpos[geoms] - data.xpos[body.id]) @ turn
    axes = turn.T @ data.geom_xmat[geoms].reshape(-1, 3, 3)
    about.geom_xmat[geoms] = axes.reshape(-1, 9)
    shapes = (geom_shape(model, about, geom) for geom in geoms)
    return [shape for shape in shapes if not isinstance(shape, HalfSpace)]


def _hull(geoms: list[Shape], n: int, tolerance: float) -> BodyShape:
    """The convex hull of geoms; of one geom the exact one, of several to within the tolerance.

    conv of K_i ⊕ B(r_i) is conv of K_i ⊕ B(r_i - r), ⊕ B(r) with r the least of the r_i.
    """
    flat = [(geom, 0.0) if n == 3 else _from_above(geom, tolerance) for geom in geoms]
    parts = [(*_without_ball(shape), excess) for shape, excess in flat]
    if len(parts) == 1:
        return BodyShape("hull", *parts[0])
    radius = min(ball for _, ball, _ in parts)
    points, worst = [], 0.0
    for core, ball, excess in parts:
        found, more = _vertices(core, ball - radius, tolerance)
        points.append(found)
        worst = max(worst, excess + more)
    return BodyShape("hull", Hull.from_points(np.vstack(points)), radius, worst)


def _cylinder(geoms: list[Shape], max_tilt: float, tolerance: float) -> BodyShape:
    """The upright cylinder around geoms given in the body's frame."""
    points, radii = [], []
    for geom in geoms:
        core, ball = _without_ball(geom)
        found = (
            _rims(core)
            if isinstance(core, Cylinder) and abs(core.axis[2]) > 1.0 - 1e-12
            else (_vertices(core, 0.0, tolerance)[0])
        )
        points.append(found)
        radii.append(np.full(len(found), ball))
    core, rounding = upright_cylinder(np.vstack(points), np.concatenate(radii), max_tilt)
    return BodyShape("cylinder", core, rounding, max_tilt=max_tilt)


def _rims(cylinder: Cylinder) -> Floats:
    """The points of a cylinder along the body's z axis that are farthest from that axis, (2, 3)."""
    out = float(np.linalg.norm(cylinder.centre[:2])) + cylinder.radius
    heights = cylinder.centre[2] + cylinder.half * np.array([-1.0, 1.0])
    return np.column_stack([np.full(2, out), np.zeros(2), heights])


def _from_above(shape: Shape, tolerance: float) -> tuple[Shape, float]:
    """The projection of a shape to the plane, and how far at most it is too large [m]."""
    if isinstance(shape, Capsule):
        return Capsule(shape.ends[:, :2], shape.radius), 0.0
    low, high = vertical_range(shape)
    return slice_shape(shape, low - _ROUND_OFF, high + _ROUND_OFF, tolerance)


def _without_ball(shape: Shape) -> tuple[Shape, float]:
    """A shape as a core and the radius of the ball that it is grown by [m]."""
    if isinstance(shape, Capsule):
        return Capsule(shape.ends, 0.0), shape.radius
    return shape, 0.0


def _vertices(core: Shape, ball: float, tolerance: float) -> tuple[Floats, float]:
    """Points (k, n) whose hull holds core ⊕ ball, and how far at most it is too large [m]."""
    if ball == 0.0 and isinstance(core, Capsule):
        return core.ends, 0.0
    if ball == 0.0 and isinstance(core, Box | Hull):
        return corners(core), 0.0
    outer = outer_polytope(core, ball, tolerance)
    return outer.vertices, outer.error
