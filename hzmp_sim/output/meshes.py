"""Triangles of geoms and polytopes, for drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from hzmp_planners._polygons import clip_polygon, counter_clockwise_rows
from hzmp_planners.sets import Polytope
from hzmp_sim.scene.geoms import mesh_arrays
from hzmp_sim.scene.height_field import HeightField

if TYPE_CHECKING:
    from hzmp_planners._arrays import Floats, Ints

MESHED = (
    mujoco.mjtGeom.mjGEOM_MESH,
    mujoco.mjtGeom.mjGEOM_SDF,
    mujoco.mjtGeom.mjGEOM_HFIELD,
)
"""Types of geoms that `mesh_triangles` draws."""

_DEFAULT_RGBA = (0.5, 0.5, 0.5, 1.0)  # what MuJoCo gives a geom without a colour


def geom_colour(model: mujoco.MjModel, geom: int) -> Floats:
    """Colour (4,) in [0, 1] as MuJoCo draws it: the geom's own, else its material's."""
    own = np.asarray(model.geom_rgba[geom], dtype=np.float64)
    material = int(model.geom_matid[geom])
    if material >= 0 and np.allclose(own, _DEFAULT_RGBA):
        return np.asarray(model.mat_rgba[material], dtype=np.float64)
    return own


def mesh_triangles(model: mujoco.MjModel, geom: int) -> tuple[Floats, Ints]:
    """Vertices (k, 3) [m] in the geom's frame and triangles (m, 3) of a mesh, SDF or height field.

    A mesh geom that can collide is given as its convex hull, which is what MuJoCo collides; of a
    height field it is the surface.
    """
    kind = int(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_HFIELD:
        field = HeightField.of_geom(model, geom)
        return field.surface(), grid_triangles(*field.z.shape)
    mesh = int(model.geom_dataid[geom])
    vertices, triangles = mesh_arrays(model, mesh)
    collides = model.geom_contype[geom] or model.geom_conaffinity[geom]
    if collides and kind == mujoco.mjtGeom.mjGEOM_MESH:
        return hull_triangles(vertices)
    return vertices, triangles


def grid_triangles(rows: int, columns: int) -> Ints:
    """Triangles (m, 3) of a grid of points in row order, cut as MuJoCo cuts height fields."""
    point = np.arange(rows * columns).reshape(rows, columns)
    first, right = point[:-1, :-1].ravel(), point[:-1, 1:].ravel()
    below, last = point[1:, :-1].ravel(), point[1:, 1:].ravel()
    return np.vstack([np.column_stack([first, right, last]), np.column_stack([first, last, below])])


def hull_triangles(points: Floats) -> tuple[Floats, Ints]:
    """Vertices (k, 3) and triangles (m, 3) of the convex hull of points (j, 3), seen from outside.

    A flat set has no triangles.
    """
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):  # ValueError: no points at all
        return points, np.zeros((0, 3), np.int64)
    used, triangles = np.unique(hull.simplices, return_inverse=True)
    triangles = triangles.reshape(-1, 3).astype(np.int64)
    vertices = np.asarray(points[used])
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return vertices, triangles


def outline_rows(polytope: Polytope) -> list[Ints]:
    """Vertex numbers along what to draw of a polytope: see `polytope_outline`."""
    vertices = polytope.vertices()
    if polytope.n == 2:
        ring = counter_clockwise_rows(vertices)
        return [np.append(ring, ring[:1])]
    held = polytope.incidence.astype(np.int64)
    # Two vertices with n - 1 = 2 facets in common span an edge.
    return list(np.argwhere(np.triu(held @ held.T >= 2, 1)))


def polytope_outline(polytope: Polytope) -> list[Floats]:
    """What to draw of a polytope: its closed outline in 2-D, its edges (2, 3) in 3-D."""
    vertices = polytope.vertices()
    return [vertices[rows] for rows in outline_rows(polytope)]


def plane_in_box(point: Floats, normal: Floats, lo: Floats, hi: Floats) -> Floats:
    """Polygon (k, 3) in which the plane through `point` meets the box [lo, hi]; k = 0 if nowhere.

    A plane on a side of the box gives that side.
    """
    _, _, axes = np.linalg.svd(normal[None, :])
    u, v = axes[1], axes[2]
    centre = (lo + hi) / 2
    middle = centre - normal * float(normal @ (centre - point))
    size = float(np.linalg.norm(hi - lo))
    turns = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    corners: Floats = middle + size * (turns @ np.array([u, v]))
    for axis in range(3):
        for sign, limit in ((1.0, hi[axis]), (-1.0, -lo[axis])):
            corners = clip_polygon(corners, sign * corners[:, axis] - limit - 1e-9 * size)
    return corners


def geom_points(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Floats | None:
    """World points (k, 3) whose convex hull is the geom, up to a few percent of a rounding.

    None for what has no bounded hull: planes.
    """
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(24)])
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        local = size * np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        local = np.vstack([circle * size[0] + [0, 0, h] for h in (-size[1], size[1])])
    elif kind in MESHED:
        local, _ = mesh_triangles(model, geom)
    elif kind in _ROUND:
        rings = np.linspace(-np.pi / 2, np.pi / 2, 13)
        ball = np.vstack([circle * np.cos(a) + [0.0, 0.0, np.sin(a)] for a in rings])
        if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            local = ball * size
        else:
            half = size[1] if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0
            local = ball * size[0] + np.sign(ball[:, 2:]) * [0.0, 0.0, half]
    else:
        return None
    return np.asarray(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])


_ROUND = (
    mujoco.mjtGeom.mjGEOM_SPHERE,
    mujoco.mjtGeom.mjGEOM_CAPSULE,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID,
)
