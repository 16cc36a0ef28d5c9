"""The audit of a whole motion: clearance to every obstacle, and whether the planner agrees."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Bools, Floats
from hzmp_planners.planning import Plan
from hzmp_sim.run import FlightLog
from hzmp_sim.scene import Scene
from hzmp_sim.simulation.distances import BodyDistances
from hzmp_sim.simulation.motion import SPACING, Motion, motion_of
from hzmp_tracking import Trajectory

DISTANCE_TOL = 1e-5
"""What a distance may be short of [m]: MuJoCo's iterations stop at 1e-6 unless told otherwise."""


@dataclass(frozen=True)
class ObstacleAudit:
    """One geom that the body could touch, over a whole motion."""

    geom: int
    name: str
    role: str
    """See `GeomReport`."""
    clearance: float
    """Least distance of the body to it by MuJoCo [m], to the convex parts of a height field or SDF;
    negative: overlap."""
    progress: float
    """Where that is along the motion, in its unit."""
    position: tuple[float, float, float]
    """Centre of the body there [m]."""
    shortfall: float
    """Largest lack of distance: of `required` clearance, less what the body was off its reference
    there [m]; at most 0 if clearance holds."""
    disagreement: float
    """Largest lack of clearance at a pose that the planner calls free of it [m]; at most 0, but
    for `DISTANCE_TOL`, if planner and MuJoCo agree."""
    blocked: int
    """Poses at which the planner calls the centre inside the grown obstacle."""


@dataclass(frozen=True)
class Audit:
    """What MuJoCo's distances say of a motion."""

    obstacles: tuple[ObstacleAudit, ...]
    """Nearest first."""
    required: float
    """Clearance planned for [m]. A geom that is no obstacle (beside the heights of a planar body,
    or outside the workspace) must only not be touched."""
    poses: int
    step: float
    """Largest way between two poses [m]: in between, clearance is less by at most half of it, and
    half the way that the body's farthest point turns."""
    length: float
    """Of the centre's way [m]."""
    unit: str
    """Of `ObstacleAudit.progress`: "s" or "m"."""

    @property
    def clearance(self) -> float:
        """Least distance to any obstacle [m]; inf without one."""
        return min((o.clearance for o in self.obstacles), default=math.inf)

    @property
    def holds(self) -> bool:
        """Clearance was kept from everything measured, but for what tracking used up."""
        return all(o.shortfall <= DISTANCE_TOL for o in self.obstacles)

    @property
    def agrees(self) -> bool:
        """Nothing that the planner calls free is nearer than the clearance for MuJoCo."""
        return all(o.disagreement <= DISTANCE_TOL for o in self.obstacles)


def audit(
    scene: Scene, what: Plan | Trajectory | FlightLog | ArrayLike, *, spacing: float = SPACING
) -> Audit:
    """Clearance to every obstacle along a motion by `mj_geomDistance`, and where it is least.

    At each pose the body is compared with each geom that MuJoCo could bring into contact with it;
    with geoms that move, on the way of a flight: where they were then.
    On a path or trajectory it keeps the orientation in which it starts. On the way of a flight, the
    tracking error at a pose may have used up as much of the clearance.

    Args:
        scene: the world and its body.
        what: waypoints (k, n), a plan, a trajectory, or the log of a flight.
        spacing: largest way between two poses on a path or trajectory [m].

    Raises:
        QueryError, ShapeError: nothing that could be moved along in this scene.
    """
    return audit_motion(scene, motion_of(scene, what, spacing))


def audit_motion(scene: Scene, motion: Motion) -> Audit:
    """The same for poses that are known; see `audit`."""
    data = mujoco.MjData(scene.model)
    data.qpos[:] = scene.initial_qpos
    mujoco.mj_forward(scene.model, data)
    body = _Posed(scene, data)
    distances = BodyDistances(scene, data)
    pairs: dict[int, list[int]] = {}
    moving = {item.geom for item in scene.moving}
    for number, pair in enumerate(distances.pairs):
        if motion.world is not None or pair.other not in moving:
            pairs.setdefault(pair.other, []).append(number)
    watched = [_Watch(scene, motion, geom) for geom in pairs]
    for k in range(len(motion.progress)):
        if moving and motion.world is not None:
            data.qpos[:], mocap = motion.world[0][k], motion.world[1][k]
            data.mocap_pos[:], data.mocap_quat[:] = mocap[:, :3], mocap[:, 3:]
            mujoco.mj_kinematics(scene.model, data)
        body.move(motion.position[k], None if motion.quaternion is None else motion.quaternion[k])
        distances.follow()
        bounds = distances.bounds()
        for watch in watched:
            near = watch.interest
            found = [distances.measure(i) for i in pairs[watch.geom] if bounds[i] < near]
            if found and min(found) < near:
                watch.take(k, min(found))
    rows = sorted((watch.result() for watch in watched), key=lambda row: row.clearance)
    return Audit(
        obstacles=tuple(rows),
        required=scene.clearance,
        poses=len(motion.progress),
        step=motion.step,
        length=float(np.linalg.norm(np.diff(motion.position, axis=0), axis=1).sum()),
        unit=motion.unit,
    )


class _Watch:
    """The least distance to one geom so far, and the worst against what was promised."""

    def __init__(self, scene: Scene, motion: Motion, geom: int) -> None:
        self.geom = geom
        self._motion, self._name = motion, scene.geom_name(geom)
        self._role = next(report.role for report in scene.geoms if report.geom == geom)
        self._required = scene.clearance if self._role in ("obstacle", "moving") else 0.0
        self._free = self._planner_free(scene)
        self._least, self._at = math.inf, 0
        self._shortfall = self._disagreement = -math.inf

    @property
    def interest(self) -> float:
        """Distances from here on tell nothing new [m]."""
        return max(self._least, self._required)

    def take(self, k: int, distance: float) -> None:
        """Take notice of the distance at pose k [m]."""
        if distance < self._least:
            self._least, self._at = distance, k
        wanted = max(0.0, self._required - float(self._motion.error[k]))
        self._shortfall = max(self._shortfall, wanted - distance)
        if self._free[k]:
            self._disagreement = max(self._disagreement, self._required - distance)

    def result(self) -> ObstacleAudit:
        x, y, z = self._motion.position[self._at].tolist()
        return ObstacleAudit(
            geom=self.geom,
            name=self._name,
            role=self._role,
            clearance=self._least,
            progress=float(self._motion.progress[self._at]),
            position=(x, y, z),
            shortfall=self._shortfall,
            disagreement=self._disagreement,
            blocked=int((~self._free).sum()) if self._role == "obstacle" else 0,
        )

    def _planner_free(self, scene: Scene) -> Bools:
        """Where the planner calls the centre free of this geom; nowhere for what it never saw."""
        if self._role != "obstacle":
            return np.zeros(len(self._motion.progress), dtype=np.bool_)
        centres: Floats = self._motion.position[:, : scene.n]
        depths = [
            polytope.violation(centres)
            for polytope, geom in zip(scene.obstacles, scene.obstacle_geoms, strict=True)
            if geom == self.geom
        ]
        return np.asarray(np.min(depths, axis=0) >= 0.0)


class _Posed:
    """Puts the rigid body anywhere, whatever its joints are: MuJoCo measures by geom poses."""

    def __init__(self, scene: Scene, data: mujoco.MjData) -> None:
        self._data, self._body = data, scene.model.body(scene.body).id
        self._geoms = list(scene.body_geoms)
        self._start = np.array(data.xquat[self._body])
        turn = data.xmat[self._body].reshape(3, 3)
        self._offsets = (data.geom_xpos[self._geoms] - data.xpos[self._body]) @ turn
        self._turns = turn.T @ data.geom_xmat[self._geoms].reshape(-1, 3, 3)

    def move(self, position: Floats, quaternion: Floats | None) -> None:
        """Centre (3,) [m] and orientation wxyz (4,); None: that of the start."""
        turn = np.empty(9)
        quaternion = self._start if quaternion is None else quaternion
        mujoco.mju_quat2Mat(turn, quaternion)
        matrix = turn.reshape(3, 3)
        self._data.xpos[self._body], self._data.xquat[self._body] = position, quaternion
        self._data.geom_xpos[self._geoms] = position + self._offsets @ matrix.T
        self._data.geom_xmat[self._geoms] = (matrix @ self._turns).reshape(-1, 9)
