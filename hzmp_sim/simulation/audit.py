"""The contact audit: what MuJoCo says of the body at every physics step."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.scene import Scene
from hzmp_sim.simulation.distances import Distances

_STANDING = 1e-3
"""A geom beside a planar body that is nearer than this at the start is the ground it stands on [m]:
contact with it is no collision, and no measure of clearance."""


class ContactAudit:
    """Contacts and exact clearance of the body, step by step.

    Clearance is the least distance over all pairs of a body geom and a geom that MuJoCo could
    bring into contact with it (except the ground that a planar body stands on): `mj_geomDistance`,
    for height fields and SDF geoms to their convex parts. Between steps
    a pair's distance falls at most by the way that the body's farthest point has moved, so only
    pairs that could be the nearest are measured again; the minimum is that of all pairs.
    """

    def __init__(self, scene: Scene, data: mujoco.MjData) -> None:
        self._model, self._data = scene.model, data
        self._body_id = scene.model.body(scene.body).id
        self._mine = frozenset(scene.body_geoms)
        self._distances = Distances(scene, data)
        beside = frozenset(scene.beside_geoms)
        self._ground = frozenset(
            pair.other
            for pair in self._distances.pairs
            if pair.other in beside and self._distances.distance(pair) < _STANDING
        )
        self._pairs = [pair for pair in self._distances.pairs if pair.other not in self._ground]
        self._radius = scene.radius
        # Lower bound of each pair's distance, plus the way moved when it was measured.
        self._floor = np.full(len(self._pairs), -math.inf)
        self._moved = 0.0
        self._pose = self._read_pose()

    def step(self) -> tuple[float, int, int]:
        """Clearance [m], geom at that distance, geom in penetrating contact; -1 where none.

        To be called with up-to-date positions and contacts, as after `mj_fwdPosition`.
        """
        pose = self._read_pose()
        # Quaternions q and -q are one orientation; the chord keeps small turns exact.
        chord = min(
            np.linalg.norm(pose[3:] - self._pose[3:]), np.linalg.norm(pose[3:] + self._pose[3:])
        )
        turned = 4.0 * math.asin(min(1.0, float(chord) / 2.0))
        travelled = math.dist(pose[:3].tolist(), self._pose[:3].tolist())
        self._moved += travelled + self._radius * turned
        self._pose = pose
        return (*self._clearance(), self._contact())

    def _read_pose(self) -> Floats:
        return np.concatenate([self._data.xpos[self._body_id], self._data.xquat[self._body_id]])

    def _clearance(self) -> tuple[float, int]:
        if not self._pairs:
            return math.inf, -1
        self._distances.update()
        bounds = self._floor - self._moved
        least, nearest = math.inf, -1
        while True:
            pair = int(bounds.argmin())
            if bounds[pair] >= least:
                return least, nearest
            distance = self._distances.distance(self._pairs[pair])
            self._floor[pair] = distance + self._moved
            bounds[pair] = math.inf
            if distance < least:
                least, nearest = distance, self._pairs[pair].other

    def _contact(self) -> int:
        """A geom that the body penetrates, other than its ground; -1 if there is none."""
        if not self._data.ncon:
            return -1
        contact = self._data.contact
        for (one, two), distance in zip(contact.geom.tolist(), contact.dist.tolist(), strict=True):
            mine = (one in self._mine) + (two in self._mine)
            other = two if one in self._mine else one
            if mine == 1 and distance < 0.0 and other not in self._ground:
                return int(other)
        return -1
