"""Distances of the body to what it could touch, measured no more often than need be."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.scene import Scene
from hzmp_sim.simulation.parts import PairDistances

_STANDING = 1e-3
"""A geom beside a planar body that is nearer than this at the start is the ground it stands on [m]:
contact with it is no collision, and no measure of clearance."""


class BodyDistances:
    """Distances of all pairs of a body geom and a geom that MuJoCo lets it touch.

    Between two poses a pair's distance falls at most by the way that the farthest points of the
    body and of the geom have moved, so a measured distance bounds later ones from below.

    Args:
        scene: the world and its body.
        data: its state, with the body where it starts.
    """

    def __init__(self, scene: Scene, data: mujoco.MjData) -> None:
        self._data = data
        self._body = scene.model.body(scene.body).id
        self._radius = scene.radius
        self._measures = PairDistances(scene, data)
        pairs, beside = self._measures.pairs, frozenset(scene.beside_geoms)
        self.ground = frozenset(
            pair.other
            for pair in pairs
            if pair.other in beside and self._measures.distance(pair) < _STANDING
        )
        """Geoms that a planar body stands on: left out of the pairs."""
        self.pairs = [pair for pair in pairs if pair.other not in self.ground]
        # Lower bound of each pair's distance, plus the ways moved when it was measured.
        self._floor = np.full(len(self.pairs), -math.inf)
        self._moved = np.zeros(len(self.pairs))
        self._pose = self._read_pose()
        others = [pair.other for pair in self.pairs]
        movable = scene.model.body_weldid[scene.model.geom_bodyid[others]] != 0
        self._movers = np.flatnonzero(movable)
        self._geoms = np.array(others, dtype=np.int64)[self._movers]
        self._reach = scene.model.geom_rbound[self._geoms]  # of a ball about the geom's frame
        self._places, self._turns = self._read_geoms()

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
        if self._movers.size:
            places, turns = self._read_geoms()
            # Of a turn by an angle w the largest |R x - x| is 2 sin(w/2) |x|: |R - 1| / sqrt 2.
            chords = np.linalg.norm(turns - self._turns, axis=1) / math.sqrt(2.0)
            ways = np.linalg.norm(places - self._places, axis=1) + self._reach * chords
            self._moved[self._movers] += ways
            self._places, self._turns = places, turns
        self._measures.update()

    def bounds(self) -> Floats:
        """What the distance of each pair is at least, shape (pairs,) [m]."""
        return np.asarray(self._floor - self._moved)

    def measure(self, pair: int) -> float:
        """Distance of a pair now [m]; negative when it overlaps."""
        distance = self._measures.distance(self.pairs[pair])
        self._floor[pair] = distance + self._moved[pair]
        return distance

    def _read_pose(self) -> Floats:
        return np.concatenate([self._data.xpos[self._body], self._data.xquat[self._body]])

    def _read_geoms(self) -> tuple[Floats, Floats]:
        return np.array(self._data.geom_xpos[self._geoms]), self._data.geom_xmat[self._geoms]
