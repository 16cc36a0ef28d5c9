"""MuJoCo geoms as rerun shapes, and the world they make."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import mujoco
import numpy as np
import rerun as rr

from hzmp_sim.output import palette
from hzmp_sim.output.framing import workspace_box
from hzmp_sim.output.meshes import MESHED, geom_colour, mesh_triangles, plane_in_box
from hzmp_sim.output.poses import pose_at_start

if TYPE_CHECKING:
    from hzmp_planners._arrays import Floats, Ints
    from hzmp_sim.scene import Scene

_VISIBLE_GROUPS = 3
"""Geoms of groups 0 to 2 are what MuJoCo draws by default; the rest go under `collision`."""

_Kind = mujoco.mjtGeom


def log_world(recording: rr.RecordingStream, scene: Scene, *, moving: bool) -> None:
    """Log the workspace, what does not move below `world`, each body below `bodies/<name>`.

    Args:
        recording: where to.
        scene: in its initial state.
        moving: leave the poses of the bodies to whoever knows them over time.
    """
    model = scene.model
    data = mujoco.MjData(model)
    pose_at_start(scene, data)
    mujoco.mj_kinematics(model, data)
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    lo, hi = workspace_box(scene)
    box = rr.Boxes3D(
        mins=[lo], sizes=[hi - lo], colors=[palette.rgba8(palette.INK)], fill_mode="majorwireframe"
    )
    recording.log("world/workspace", box, static=True)
    geoms = range(model.ngeom)
    fixed = [geom for geom in geoms if model.body_weldid[model.geom_bodyid[geom]] == 0]
    log_geoms(recording, "world", scene, data, fixed)
    for body in sorted({int(model.geom_bodyid[geom]) for geom in geoms if geom not in fixed}):
        held = [geom for geom in geoms if model.geom_bodyid[geom] == body]
        log_geoms(recording, body_entity(model, body), scene, data, held, body=body)
        if not moving:
            still = rr.Transform3D(
                translation=data.xpos[body], quaternion=rr.Quaternion(xyzw=xyzw(data.xquat[body]))
            )
            recording.log(body_entity(model, body), still, static=True)


def body_entity(model: mujoco.MjModel, body: int) -> str:
    """Where a body that can move is logged."""
    name = model.body(body).name or f"body{body}"
    return f"bodies/{rr.escape_entity_path_part(name)}"


def xyzw(wxyz: Floats) -> Floats:
    """Quaternions (..., 4) as rerun wants them: the scalar last."""
    return np.roll(wxyz, -1, axis=-1)


def log_geoms(
    recording: rr.RecordingStream,
    root: str,
    scene: Scene,
    data: mujoco.MjData,
    geoms: Sequence[int],
    body: int = 0,
) -> None:
    """Log `geoms`, a batch a type, below the entity `root` in the frame of `body` (0: world)."""
    model = scene.model
    folders: dict[tuple[str, int], list[int]] = {}
    for geom in geoms:
        folder = root if model.geom_group[geom] < _VISIBLE_GROUPS else f"{root}/collision"
        folders.setdefault((folder, int(model.geom_type[geom])), []).append(geom)
    for (folder, kind), members in folders.items():
        poses = [_pose(data, geom, body) for geom in members]
        if kind in MESHED:
            for geom, pose in zip(members, poses, strict=True):
                _log_mesh(recording, folder, scene, geom, pose)
        elif kind == _Kind.mjGEOM_PLANE:
            for geom in members:
                _log_plane(recording, folder, scene, data, geom)
        else:
            _log_primitives(recording, folder, scene, kind, members, poses)


def _log_primitives(
    recording: rr.RecordingStream,
    folder: str,
    scene: Scene,
    kind: int,
    geoms: list[int],
    poses: list[tuple[Floats, Floats]],
) -> None:
    model = scene.model
    size = model.geom_size[geoms]
    centres = np.array([position for position, _ in poses])
    quaternions = np.array([_quaternion(matrix) for _, matrix in poses])
    colors = [_colour8(model, geom) for geom in geoms]
    labels = [scene.geom_name(geom) for geom in geoms]
    shape: rr.AsComponents
    if kind == _Kind.mjGEOM_BOX:
        name, shape = "boxes", rr.Boxes3D(
            centers=centres, half_sizes=size, quaternions=quaternions, colors=colors,
            labels=labels, show_labels=False, fill_mode="solid",
        )  # fmt: skip
    elif kind in (_Kind.mjGEOM_SPHERE, _Kind.mjGEOM_ELLIPSOID):
        sphere = kind == _Kind.mjGEOM_SPHERE
        name, shape = "spheres" if sphere else "ellipsoids", rr.Ellipsoids3D(
            centers=centres, half_sizes=np.repeat(size[:, :1], 3, axis=1) if sphere else size,
            quaternions=quaternions, colors=colors, labels=labels, show_labels=False,
            fill_mode="solid",
        )  # fmt: skip
    elif kind == _Kind.mjGEOM_CAPSULE:
        # rerun measures a capsule from one end of its axis, MuJoCo from the middle.
        ends = [p - m[:, 2] * size[i, 1] for i, (p, m) in enumerate(poses)]
        name, shape = "capsules", rr.Capsules3D(
            translations=ends, lengths=2 * size[:, 1], radii=size[:, 0], quaternions=quaternions,
            colors=colors, labels=labels, show_labels=False, fill_mode="solid",
        )  # fmt: skip
    else:
        name, shape = "cylinders", rr.Cylinders3D(
            centers=centres, lengths=2 * size[:, 1], radii=size[:, 0], quaternions=quaternions,
            colors=colors, labels=labels, show_labels=False, fill_mode="solid",
        )  # fmt: skip
    recording.log(f"{folder}/{name}", shape, static=True)


def _log_mesh(
    recording: rr.RecordingStream,
    folder: str,
    scene: Scene,
    geom: int,
    pose: tuple[Floats, Floats],
) -> None:
    vertices, triangles = mesh_triangles(scene.model, geom)
    position, matrix = pose
    _log_triangles(recording, folder, scene, geom, vertices @ matrix.T + position, triangles)


def _log_plane(
    recording: rr.RecordingStream, folder: str, scene: Scene, data: mujoco.MjData, geom: int
) -> None:
    """The part of an infinite plane that lies in the workspace (planar: below or above it too)."""
    lo, hi = workspace_box(scene)
    position, matrix = _pose(data, geom, 0)
    if scene.n == 2:
        lo, hi = (
            np.append(lo[:2], min(lo[2], position[2])),
            np.append(hi[:2], max(hi[2], position[2])),
        )
    polygon = plane_in_box(position, matrix[:, 2], lo, hi)
    if len(polygon) < 3:
        return
    second = np.arange(1, len(polygon) - 1)
    triangles = np.column_stack([np.zeros_like(second), second, second + 1])
    _log_triangles(recording, folder, scene, geom, polygon, triangles)


def _log_triangles(
    recording: rr.RecordingStream,
    folder: str,
    scene: Scene,
    geom: int,
    vertices: Floats,
    triangles: Ints,
) -> None:
    name = rr.escape_entity_path_part(scene.geom_name(geom))
    mesh = rr.Mesh3D(
        vertex_positions=vertices,
        triangle_indices=triangles,
        albedo_factor=_colour8(scene.model, geom),
    )
    recording.log(f"{folder}/{name}", mesh, static=True)


def _pose(data: mujoco.MjData, geom: int, body: int) -> tuple[Floats, Floats]:
    """Position (3,) and rotation (3, 3) of a geom in the frame of a body."""
    turn = data.xmat[body].reshape(3, 3)
    position = turn.T @ (data.geom_xpos[geom] - data.xpos[body])
    return position, turn.T @ data.geom_xmat[geom].reshape(3, 3)


def _quaternion(matrix: Floats) -> Floats:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(matrix).ravel())
    return xyzw(quaternion)


def _colour8(model: mujoco.MjModel, geom: int) -> tuple[int, ...]:
    return tuple(int(value) for value in np.round(255 * geom_colour(model, geom)))
