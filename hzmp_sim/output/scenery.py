"""What stands between camera and workspace, such as the painted walls of a room, is not drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from hzmp_sim.output.framing import OVERVIEW, eye, workspace_box

if TYPE_CHECKING:
    from hzmp_planners._arrays import Floats
    from hzmp_sim.scene import Scene

_DRAWN = np.array([1, 1, 1, 0, 0, 0], np.uint8)  # geom groups that MuJoCo draws unless told to
_STEP = 1e-6  # [m] by which a ray goes on behind what it met


def hide_scenery(
    model: mujoco.MjModel, data: mujoco.MjData, scene: Scene, aspect: float, points: Floats
) -> list[int]:
    """Make invisible what hides the workspace from the overview, obstacles and body apart.

    Only geoms that a line of sight to a point or to a corner of the workspace meets before it
    enters the workspace: inside nothing is hidden.

    Args:
        model: of the scene; its colours are changed.
        data: with poses.
        scene: says what the workspace is, and which geoms are never hidden.
        aspect: width of the picture by its height.
        points: what has to be seen, shape (k, 3) [m].

    Returns:
        Ids of the geoms hidden.
    """
    lo, hi = workspace_box(scene)
    corners = np.array(np.meshgrid(*zip(lo, hi, strict=True))).reshape(3, -1).T
    origin = _eye(model, data, scene, aspect)
    kept = {*scene.obstacle_geoms, *scene.body_geoms}
    hidden: set[int] = set()
    for target in np.vstack([points, corners]):
        sight = target - origin
        enters = _enters(origin, sight, lo, hi)
        hidden.update(_met(model, data, origin, sight, enters))
    hidden -= kept
    for geom in hidden:
        model.geom_matid[geom] = -1  # else the material's colour would show
        model.geom_rgba[geom] = 0.0
    return sorted(hidden)


def _eye(model: mujoco.MjModel, data: mujoco.MjData, scene: Scene, aspect: float) -> Floats:
    camera = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA.value, OVERVIEW)
    return eye(scene, aspect)[0] if camera < 0 else np.array(data.cam_xpos[camera])


def _enters(origin: Floats, sight: Floats, lo: Floats, hi: Floats) -> float:
    """How far along a line of sight (1: at its end) it enters a box that holds its end."""
    with np.errstate(divide="ignore", invalid="ignore"):
        first = np.minimum((lo - origin) / sight, (hi - origin) / sight)
    return float(np.clip(np.nan_to_num(first, nan=0.0, neginf=0.0).max(), 0.0, 1.0))


def _met(
    model: mujoco.MjModel, data: mujoco.MjData, origin: Floats, sight: Floats, until: float
) -> list[int]:
    """Geoms on a line of sight up to a share of its length."""
    length = float(np.linalg.norm(sight))
    direction, end = sight / length, until * length - _STEP
    geom, gone, met = np.array([-1], np.int32), 0.0, []
    while gone < end:
        ahead = mujoco.mj_ray(
            model, data, origin + gone * direction, direction, _DRAWN, True, -1, geom
        )
        if ahead < 0.0 or gone + ahead >= end:
            break
        met.append(int(geom[0]))
        gone += ahead + _STEP
    return met
