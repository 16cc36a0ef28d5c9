"""The contact audit: what MuJoCo says of the body at every physics step."""

from __future__ import annotations

import math

import mujoco

from hzmp_sim.scene import Scene
from hzmp_sim.simulation.distances import BodyDistances


class ContactAudit:
    """Contacts and exact clearance of the body, step by step.

    Clearance is the least distance over all pairs of a body geom and a geom that MuJoCo could
    bring into contact with it (except the ground that a planar body stands on): `mj_geomDistance`,
    for height fields and SDF geoms to their convex parts. Only pairs that could be the nearest are
    measured again; the minimum is that of all pairs.
    """

    def __init__(self, scene: Scene, data: mujoco.MjData) -> None:
        self._data = data
        self._mine = frozenset(scene.body_geoms)
        self._distances = BodyDistances(scene, data)

    def step(self) -> tuple[float, int, int]:
        """Clearance [m], geom at that distance, geom in penetrating contact; -1 where none.

        To be called with up-to-date positions and contacts, as after `mj_fwdPosition`.
        """
        self._distances.follow()
        return (*self._clearance(), self._contact())

    def _clearance(self) -> tuple[float, int]:
        if not self._distances.pairs:
            return math.inf, -1
        bounds = self._distances.bounds()
        least, nearest = math.inf, -1
        while True:
            pair = int(bounds.argmin())
            if bounds[pair] >= least:
                return least, nearest
            distance = self._distances.measure(pair)
            bounds[pair] = math.inf
            if distance < least:
                least, nearest = distance, self._distances.pairs[pair].other

    def _contact(self) -> int:
        """A geom that the body penetrates, other than its ground; -1 if there is none."""
        if not self._data.ncon:
            return -1
        contact = self._data.contact
        for (one, two), distance in zip(contact.geom.tolist(), contact.dist.tolist(), strict=True):
            mine = (one in self._mine) + (two in self._mine)
            other = two if one in self._mine else one
            if mine == 1 and distance < 0.0 and other not in self._distances.ground:
                return int(other)
        return -1
