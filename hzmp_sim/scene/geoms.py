"""MuJoCo geoms as shapes in the world, read from the compiled model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.errors import SceneError
from hzmp_sim.scene.constants import MAX_COORDINATE
from hzmp_sim.scene.height_field import HeightField
from hzmp_sim.scene.shapes import Box, Capsule, Cylinder, Ellipsoid, Hull, Shape, farthest

_TYPE = mujoco.mjtGeom


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """{x : normal.x <= offset}: a MuJoCo plane is solid and infinite, its size is only drawn."""

    normal: Floats
    """Unit normal, shape (3,)."""
    offset: float


@dataclass(frozen=True, eq=False)
class Part:
    """A convex part of what MuJoCo collides for a geom."""

    shape: Shape | HalfSpace
    excess: float = 0.0
    """How far it reaches beyond the geom [m]."""


def geom_type(model: mujoco.MjModel, geom: int) -> str:
    """The MJCF name of a geom's type, such as "box"."""
    return _TYPE(int(model.geom_type[geom])).name.removeprefix("mjGEOM_").lower()


def geom_name(model: mujoco.MjModel, geom: int) -> str:
    """Name of a geom; an unnamed one is told by number, type and body."""
    name = model.geom(geom).name
    if name:
        return name
    body = model.body(int(model.geom_bodyid[geom])).name or f"#{int(model.geom_bodyid[geom])}"
    return f"geom#{geom} ({geom_type(model, geom)}) of body {body}"


def geom_parts(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    geom: int,
    near: tuple[Floats, Floats],
    tolerance: float = 0.0,
) -> tuple[Part, ...]:
    """What MuJoCo collides for a geom, at its pose in `data`, as convex parts.

    One part, but for height fields: these have as many as it takes, none too high by more than
    `tolerance` [m], and none beyond the box `near` (lo, hi), each (3,) [m]. A mesh is its convex
    hull, from the compiled vertices (the authored pose of a mesh geom is not its frame: MuJoCo
    re-centres meshes). So is an SDF: MuJoCo collides the surface inside that hull.
    Needs `mj_kinematics` to have run.

    Raises:
        SceneError: position or size are not finite, or too large.
    """
    if int(model.geom_type[geom]) != _TYPE.mjGEOM_HFIELD:
        return (Part(geom_shape(model, data, geom)),)
    centre, axes = _pose(model, data, geom)
    middle = axes.T @ (0.5 * (near[0] + near[1]) - centre)
    half = np.abs(axes.T) @ (0.5 * (near[1] - near[0]))
    field = HeightField.of_geom(model, geom).within(middle - half, middle + half)
    return tuple(
        Part(Hull.from_points(points @ axes.T + centre), excess)
        for points, excess in (field.bodies(tolerance) if field else ())
    )


def geom_shape(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Shape | HalfSpace:
    """The convex hull of what MuJoCo collides for a geom, at its pose in `data`.

    Raises:
        SceneError: position or size are not finite, or too large.
    """
    kind, size = int(model.geom_type[geom]), np.array(model.geom_size[geom])
    centre, axes = _pose(model, data, geom)
    if kind == _TYPE.mjGEOM_BOX:
        return Box(centre, axes, size)
    if kind == _TYPE.mjGEOM_SPHERE:
        return Capsule(np.vstack([centre, centre]), float(size[0]))
    if kind == _TYPE.mjGEOM_CAPSULE:
        reach = size[1] * axes[:, 2]
        return Capsule(np.vstack([centre - reach, centre + reach]), float(size[0]))
    if kind == _TYPE.mjGEOM_CYLINDER:
        return Cylinder(centre, axes[:, 2], float(size[0]), float(size[1]))
    if kind == _TYPE.mjGEOM_ELLIPSOID:
        return Ellipsoid(centre, axes, size)
    if kind == _TYPE.mjGEOM_PLANE:
        return HalfSpace(axes[:, 2], float(axes[:, 2] @ centre))
    if kind == _TYPE.mjGEOM_HFIELD:
        points = HeightField.of_geom(model, geom).hull_points()
    else:  # mesh or SDF: whatever else MuJoCo calls a geom is drawn only, and in no model
        points = mesh_points(model, geom)
    return _hull(points.tobytes()).moved(axes, centre)


@lru_cache(64)  # of a mesh that many geoms show
def _hull(points: bytes) -> Hull:
    """Hull of points (k, 3), each coordinate a double."""
    return Hull.from_points(np.frombuffer(points).reshape(-1, 3))


def _pose(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> tuple[Floats, Floats]:
    """Position (3,) [m] and axes as columns (3, 3) of a geom.

    Raises:
        SceneError: not finite or too large.
    """
    centre = np.array(data.geom_xpos[geom])
    axes = np.array(data.geom_xmat[geom]).reshape(3, 3)
    axes[np.abs(axes) < 1e-15] = 0.0  # round-off of cos(90 deg)
    plane = int(model.geom_type[geom]) == _TYPE.mjGEOM_PLANE  # its size is only drawn
    size = np.zeros(3) if plane else np.array(model.geom_size[geom])
    extent = np.abs(np.concatenate([centre, size])).max()
    if not (np.isfinite(axes).all() and extent <= MAX_COORDINATE):
        raise SceneError(
            f"{geom_name(model, geom)} has position {centre.tolist()} and size {size.tolist()}; "
            f"both must be finite and below {MAX_COORDINATE:g} m"
        )
    return centre, axes


def mesh_arrays(model: mujoco.MjModel, mesh: int) -> tuple[Floats, Ints]:
    """Vertices (k, 3) [m] and triangles (m, 3) of a compiled mesh, in the frame of its geoms."""
    start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    first, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    vertices = np.array(model.mesh_vert[start : start + count], dtype=np.float64)
    return vertices, np.array(model.mesh_face[first : first + faces], dtype=np.int64)


def mesh_points(model: mujoco.MjModel, geom: int) -> Floats:
    """Vertices of the convex hull that MuJoCo collides for a mesh geom, in its frame, (k, 3)."""
    mesh = int(model.geom_dataid[geom])
    points, _ = mesh_arrays(model, mesh)
    address = int(model.mesh_graphadr[mesh])
    if address < 0:
        return points
    graph = model.mesh_graph[address:]  # numvert, numface, edge addresses, vertex ids, ...
    hull = int(graph[0])
    return np.asarray(points[graph[2 + hull : 2 + 2 * hull]])


def reach(shape: Shape | HalfSpace, origin: Floats) -> float:
    """Largest distance of a point of the shape to `origin` [m].

    Only the first `origin.size` coordinates count: two for the reach across the vertical.
    """
    n = origin.size
    if isinstance(shape, HalfSpace):
        return float("inf")
    if isinstance(shape, Capsule):
        return float(np.linalg.norm(shape.ends[:, :n] - origin, axis=1).max()) + shape.radius
    if isinstance(shape, Ellipsoid):
        return farthest(shape.centre[:n] - origin, (shape.axes * shape.half)[:n])
    if isinstance(shape, Cylinder):
        across = np.linalg.svd(shape.axis[None, :])[2][1:].T * shape.radius
        caps = (shape.centre + s * shape.half * shape.axis for s in (-1.0, 1.0))
        return max(farthest(cap[:n] - origin, across[:n]) for cap in caps)
    return float(np.linalg.norm(corners(shape)[:, :n] - origin, axis=1).max())


def corners(shape: Shape) -> Floats:
    """Vertices of a box or hull, shape (k, n) [m]."""
    if isinstance(shape, Hull):
        return shape.points
    if isinstance(shape, Box):
        return shape.corners
    raise TypeError(f"{type(shape).__name__} has no vertices")
