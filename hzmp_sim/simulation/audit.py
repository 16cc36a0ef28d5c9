"""The contact audit: what MuJoCo says of the body at every physics step."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.scene import Scene


class ContactAudit:
    """Contacts and exact clearance of the body, step by step.

    Clearance is the least `mj_geomDistance` over all pairs of a body geom and an obstacle geom.
    Between steps a pair's distance falls at most by the way that the body's farthest point has
    moved, so only pairs that could be the nearest are measured again; the minimum stays exact.
    """

    def __init__(self, scene: Scene, data: mujoco.MjData) -> None:
        self._model, self._data = scene.model, data
        self._body_id = scene.model.body(scene.body).id
        self._mine = frozenset(scene.body_geoms)
        self._harmless = frozenset(scene.ground_geoms)
        self._pairs = [
            (mine, other, index)
            for index, other in enumerate(scene.obstacle_geoms)
            for mine in scene.body_geoms
        ]
        lo, hi = scene.to_world(np.array(scene.workspace))
        self._far = max(100.0, 2.0 * float(np.linalg.norm(hi - lo)))
        self._radius = scene.radius
        # Lower bound of each pair's distance, plus the way moved when it was measured.
        self._floor = np.full(len(self._pairs), -math.inf)
        self._moved = 0.0
        self._pose = self._read_pose()

    def step(self) -> tuple[float, int, bool]:
        """Clearance [m], index of the nearest obstacle (-1 without any), and whether in collision.

        To be called after each `mj_step` (or `mj_forward`).
        """
        pose = self._read_pose()
        turned = 2.0 * math.acos(min(1.0, abs(float(pose[3:] @ self._pose[3:]))))
        travelled = math.dist(pose[:3].tolist(), self._pose[:3].tolist())
        self._moved += travelled + self._radius * turned
        self._pose = pose
        clearance, nearest = self._clearance()
        return clearance, nearest, self._collides()

    def _read_pose(self) -> Floats:
        return np.concatenate([self._data.xpos[self._body_id], self._data.xquat[self._body_id]])

    def _clearance(self) -> tuple[float, int]:
        if not self._pairs:
            return math.inf, -1
        bounds = self._floor - self._moved
        least, nearest = math.inf, -1
        while True:
            pair = int(bounds.argmin())
            if bounds[pair] >= least:
                return least, nearest
            mine, other, index = self._pairs[pair]
            distance = mujoco.mj_geomDistance(self._model, self._data, mine, other, self._far, None)
            self._floor[pair] = distance + self._moved
            bounds[pair] = math.inf
            if distance < least:
                least, nearest = distance, index

    def _collides(self) -> bool:
        """Whether a penetrating contact of the body exists, other than with its ground."""
        if not self._data.ncon:
            return False
        contact = self._data.contact
        for (one, two), distance in zip(contact.geom.tolist(), contact.dist.tolist(), strict=True):
            mine = (one in self._mine) + (two in self._mine)
            other = two if one in self._mine else one
            if mine == 1 and distance < 0.0 and other not in self._harmless:
                return True
        return False
