"""Distances of the body to what it could touch, measured no more often than need be."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.scene import Scene

_STANDING = 1e-3
"""A geom beside a planar body that is nearer than this at the start is the ground it stands on [m]:
contact with it is no collision, and no measure of clearance."""


class BodyDistances:
    """`mj_geomDistance` of all pairs of a body geom and a geom that MuJoCo lets it touch.

    Between two poses a pair's distance falls at most by the way that the body's farthest point has
    moved, so a measured distance bounds later ones from below.

    Args:
        scene: the world and its body.
        data: its state, with the body where it starts.
    """

    def __init__(self, scene: Scene, data: mujoco.MjData) -> None:
        self._model, self._data = scene.model, data
        self._body = scene.model.body(scene.body).id
        self._radius = scene.radius
        lo, hi = scene.to_world(np.array(scene.workspace))
        self._far = max(100.0, 2.0 * float(np.linalg.norm(hi - lo)))
        self.ground = frozenset(
            other
            for other in scene.beside_geoms
            if min(self._distance(mine, other) for mine in scene.body_geoms) < _STANDING
        )
        """Geoms that a planar body stands on: left out of the pairs."""
        self.pairs = [
            (mine, other)
            for other in scene.contact_geoms
            if other not in self.ground
            for mine in scene.body_geoms
        ]
        """(body geom, other geom), those of one other geom side by side."""
        # Lower bound of each pair's distance, plus the way moved when it was measured.
        self._floor = np.full(len(self.pairs), -math.inf)
        self._moved = 0.0
        self._pose = self._read_pose()

    def follow(self) -> None:
        """Take notice that the body has moved; to be called at each pose."""
        pose = self._read_pose()
        # Quaternions q and -q are one orientation; the chord keeps small turns exact.
        chord = min(
            np.linalg.norm(pose[3:] - self._pose[3:]), np.linalg.norm(pose[3:] + self._pose[3:])
        )
        turned = 4.0 * math.asin(min(1.0, float(chord) / 2.0))
        travelled = math.dist(pose[:3].tolist(), self._pose[:3].tolist())
        self._moved += travelled + self._radius * turned
        self._pose = pose

    def bounds(self) -> Floats:
        """What the distance of each pair is at least, shape (pairs,) [m]."""
        return np.asarray(self._floor - self._moved)

    def measure(self, pair: int) -> float:
        """Distance of a pair now [m]; negative when it overlaps."""
        distance = self._distance(*self.pairs[pair])
        self._floor[pair] = distance + self._moved
        return distance

    def _distance(self, one: int, two: int) -> float:
        return mujoco.mj_geomDistance(self._model, self._data, one, two, self._far, None)

    def _read_pose(self) -> Floats:
        return np.concatenate([self._data.xpos[self._body], self._data.xquat[self._body]])
