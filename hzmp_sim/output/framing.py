"""Where to look from: the box of the workspace and a camera that shows all of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import mujoco
import numpy as np

if TYPE_CHECKING:
    from hzmp_planners._arrays import Floats, Ints
    from hzmp_sim.run import FlightLog
    from hzmp_sim.scene import Scene

_CHASE_DISTANCE = 2.2  # [m] between the following camera and the body
_CHASE_ELEVATION = -32.0  # [deg]
_CHASE_WINDOW = 1.0  # [s] over which the direction of travel is averaged

OVERVIEW = "overview"
"""Name of the camera that a world may bring for its pictures."""


def workspace_box(scene: Scene) -> tuple[Floats, Floats]:
    """Corners (lo, hi) of the workspace in the world, each (3,) [m].

    A planar workspace gets the height of the body.
    """
    lo, hi = scene.workspace
    if scene.height is None:
        return lo, hi
    return (
        np.append(lo, scene.height - scene.radius),
        np.append(hi, scene.height + scene.radius),
    )


def eye(scene: Scene, aspect: float = 4 / 3) -> tuple[Floats, Floats]:
    """Position of an eye and the point it looks at, each (3,) [m], with the workspace in view.

    Planar worlds are seen steeply from the south; others from a corner, a little above.
    """
    lo, hi = workspace_box(scene)
    target = (lo + hi) / 2
    azimuth, elevation = (-90.0, 65.0) if scene.n == 2 else (-58.0, 24.0)
    a, e = math.radians(azimuth), math.radians(elevation)
    forward = -np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    half = math.tan(math.radians(scene.model.vis.global_.fovy / 2))
    corners = np.array(np.meshgrid(*zip(lo, hi, strict=True))).reshape(3, -1).T - target
    reach = np.maximum(np.abs(corners @ up) / half, np.abs(corners @ right) / (half * aspect))
    distance = float((reach - corners @ forward).max())
    return target - 1.05 * distance * forward, target


def camera(scene: Scene, aspect: float) -> mujoco.MjvCamera:
    """The model's `overview` camera, or a free one that frames the workspace."""
    view = mujoco.MjvCamera()
    index = mujoco.mj_name2id(scene.model, mujoco.mjtObj.mjOBJ_CAMERA.value, OVERVIEW)
    if index >= 0:
        view.type = mujoco.mjtCamera.mjCAMERA_FIXED.value
        view.fixedcamid = index
        return view
    position, target = eye(scene, aspect)
    forward = target - position
    view.type = mujoco.mjtCamera.mjCAMERA_FREE.value
    view.lookat[:] = target
    view.distance = float(np.linalg.norm(forward))
    view.azimuth = math.degrees(math.atan2(forward[1], forward[0]))
    view.elevation = math.degrees(math.asin(forward[2] / view.distance))
    return view


def chase_cameras(log: FlightLog, rows: Ints) -> list[mujoco.MjvCamera]:
    """Free cameras that follow the body from behind and above, one for each row of the log.

    They look along the direction of travel, averaged so that the picture turns smoothly; where the
    body hardly moves sideways the direction stays what it was.
    """
    steps = max(1, round(_CHASE_WINDOW / max(float(log.time[1] - log.time[0]), 1e-9)))
    last = len(log.time) - 1
    way = log.position[np.minimum(rows + steps, last)] - log.position[np.maximum(rows - steps, 0)]
    whole = log.position[-1] - log.position[0]
    azimuth = math.degrees(math.atan2(whole[1], whole[0]))
    cameras = []
    for row, (x, y, _) in zip(rows.tolist(), way.tolist(), strict=True):
        if math.hypot(x, y) > 0.1:
            turn = (math.degrees(math.atan2(y, x)) - azimuth + 180.0) % 360.0 - 180.0
            azimuth += 0.1 * turn
        view = mujoco.MjvCamera()
        view.type = mujoco.mjtCamera.mjCAMERA_FREE.value
        view.lookat[:] = log.position[row]
        view.distance, view.elevation, view.azimuth = _CHASE_DISTANCE, _CHASE_ELEVATION, azimuth
        cameras.append(view)
    return cameras
