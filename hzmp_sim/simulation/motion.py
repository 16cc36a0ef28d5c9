"""Where the body's centre goes: a path, a trajectory or a flight, as poses close to each other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, as_points
from hzmp_planners.errors import QueryError
from hzmp_planners.planning import Plan
from hzmp_sim.run import FlightLog
from hzmp_sim.scene import Scene
from hzmp_tracking import Trajectory

SPACING = 0.01
"""How far apart the poses on a path are at most [m]."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses of the body, k of them, in order."""

    progress: Floats
    """Time [s] or length [m] at each pose, shape (k,)."""
    unit: str
    """ "s" or "m"."""
    position: Floats
    """Of the centre in the world [m], shape (k, 3)."""
    quaternion: Floats | None
    """Of the body, wxyz, shape (k, 4); None: as it starts."""
    error: Floats
    """How far the centre is off the planned reference [m], shape (k,); 0 on the reference."""
    world: tuple[Floats, Floats] | None = None
    """State of the whole world, as of a flight: qpos (k, nq), and position and quaternion of each
    mocap body (k, nmocap, 7). None: it is not known, so nothing is said of what moves."""

    @property
    def step(self) -> float:
        """Largest way of the centre between two poses [m]."""
        return float(np.linalg.norm(np.diff(self.position, axis=0), axis=1).max(initial=0.0))


def motion_of(
    scene: Scene, what: Plan | Trajectory | FlightLog | ArrayLike, spacing: float = SPACING
) -> Motion:
    """The poses of a path, trajectory or flight.

    Args:
        scene: the world and its body.
        what: waypoints (k, n) or a plan that has some: straight lines between them; a trajectory;
            or the log of a flight, each row a pose.
        spacing: largest way between two poses on a path or trajectory [m].

    Raises:
        QueryError: a plan without a path, a trajectory of another dimension, no waypoint.
        ShapeError: waypoints of another dimension, or not finite.
    """
    if not 0.0 < spacing < math.inf:
        raise QueryError(f"spacing must be positive and finite, got {spacing}")
    if isinstance(what, FlightLog):
        world = (what.qpos, what.mocap)
        return Motion(what.time, "s", what.position, what.quaternion, what.tracking_error, world)
    if isinstance(what, Trajectory):
        return _timed(scene, what, spacing)
    if isinstance(what, Plan):
        if not math.isfinite(what.cost):
            raise QueryError(f"the plan has no path to audit: {what.status.value}")
        return _path(scene, what.waypoints, spacing)
    points = as_points(what, "path", scene.n)
    if not len(points):
        raise QueryError("the path has no waypoints")
    return _path(scene, points, spacing)


def _path(scene: Scene, waypoints: Floats, spacing: float) -> Motion:
    corners = np.concatenate([[0.0], np.linalg.norm(np.diff(waypoints, axis=0), axis=1).cumsum()])
    count = math.ceil(corners[-1] / spacing) + 1
    length = np.union1d(np.linspace(0.0, corners[-1], count), corners)
    points = np.column_stack([np.interp(length, corners, column) for column in waypoints.T])
    return Motion(length, "m", scene.to_world(points), None, np.zeros(len(length)))


def _timed(scene: Scene, trajectory: Trajectory, spacing: float) -> Motion:
    count = 64
    while True:
        time = np.linspace(0.0, trajectory.duration, count)
        points = trajectory.sample(time).position
        if points.shape[1] != scene.n:
            raise QueryError(
                f"the trajectory is {points.shape[1]}-D, the scene {scene.n}-D: not of this scene"
            )
        motion = Motion(time, "s", scene.to_world(points), None, np.zeros(count))
        if motion.step <= spacing:
            return motion
        count = math.ceil(1.1 * count * motion.step / spacing)
