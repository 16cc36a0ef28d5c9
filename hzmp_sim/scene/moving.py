"""Geoms that move: what MuJoCo collides for them, as few points and a ball."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats, frozen
from hzmp_planners.errors import SceneError
from hzmp_planners.sets import Polytope
from hzmp_sim.scene.directions import round_normals
from hzmp_sim.scene.geoms import geom_name, geom_type, mesh_points
from hzmp_sim.scene.outer import outer_polytope
from hzmp_sim.scene.shapes import Box, Hull

_SIDES = 16  # of the prism around a cylinder: its corners stand out by 2 % of the radius
_MOST_POINTS = 64  # of a mesh; what has more is held by a polytope of few
_COARSER = 0.02  # by how much of its size that polytope may be larger
_CONVEX = ("box", "sphere", "capsule", "cylinder", "ellipsoid", "mesh")


@dataclass(frozen=True, eq=False)
class MovingGeom:
    """The convex hull of points, grown by a ball, holds what MuJoCo collides for a moving geom.

    Exactly so for boxes, spheres, capsules and meshes of few corners; others are a little smaller.
    """

    geom: int
    """Geom id in the compiled model."""
    name: str
    points: Floats
    """In the geom's frame, shape (k, 3) [m]."""
    radius: float
    """Of the ball that they are grown by [m]."""
    normals: Floats
    """Unit normals of its flat sides in the geom's frame, (m, 3); none for round ones."""
    margin: float
    """Contact margin with the flown body [m]."""


def moving_geom(model: mujoco.MjModel, geom: int, margin: float) -> MovingGeom:
    """A geom of a body that moves.

    Raises:
        SceneError: it is not convex, or infinite.
    """
    name, kind = geom_name(model, geom), geom_type(model, geom)
    if kind not in _CONVEX:
        raise SceneError(
            f"{name} is a {kind} geom on a body that moves; valid there are {', '.join(_CONVEX)}"
        )
    points, radius, normals = _solid(model, geom, kind, np.array(model.geom_size[geom]))
    return MovingGeom(geom, name, frozen(points), radius, frozen(normals), margin)


def _solid(
    model: mujoco.MjModel, geom: int, kind: str, size: Floats
) -> tuple[Floats, float, Floats]:
    """Points, radius and normals of a geom in its frame."""
    none, axes = np.zeros((0, 3)), np.vstack([np.eye(3), -np.eye(3)])
    if kind == "box":
        return Box(np.zeros(3), np.eye(3), size).corners, 0.0, axes
    if kind == "sphere":
        return np.zeros((1, 3)), float(size[0]), none
    if kind == "capsule":
        return np.array([[0.0, 0.0, -size[1]], [0.0, 0.0, size[1]]]), float(size[0]), none
    if kind == "cylinder":
        angle = 2.0 * math.pi * (np.arange(_SIDES) + 0.5) / _SIDES
        ring = (
            size[0] / math.cos(math.pi / _SIDES) * np.column_stack([np.cos(angle), np.sin(angle)])
        )
        caps = [np.column_stack([ring, np.full(_SIDES, z)]) for z in (-size[1], size[1])]
        return np.vstack(caps), 0.0, axes[[2, 5]]
    if kind == "ellipsoid":
        normals = round_normals(3)
        ball = Polytope.from_halfspaces(normals, np.ones(len(normals)))
        return ball.vertices() * size, 0.0, none
    hull = Hull.from_points(mesh_points(model, geom))
    if len(hull.points) > _MOST_POINTS:
        span = float(np.linalg.norm(np.ptp(hull.points, axis=0)))
        return outer_polytope(hull, 0.0, _COARSER * span).vertices, 0.0, none
    return hull.points, 0.0, hull.equations[:, :3]
