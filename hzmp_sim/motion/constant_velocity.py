"""Prediction from what is seen: each point of a geom goes on as it goes now, more or less.

A point seen at x with velocity v is at x + v s after s seconds, to within

    u(s) = a t^2 / 2 + w (s - t) + min(a o / 2, w) s,    t = min(s, w / a)

if its acceleration is at most a and its velocity changes by at most w: the first two for what it
does from now on, the third for a velocity that is the mean over the last o seconds. Turning takes
an acceleration of its own, w^2 r, for as long as it lasts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.motion.observation import Observation
from hzmp_sim.motion.template import Template, of_no_concern
from hzmp_sim.scene.scene import Scene


class ConstantVelocity:
    """A source for geoms of which only is known where they are and were.

    Args:
        scene: with the moving geoms.
        template: of all of them.
        seen: all of them.
        rows: which of them this is for.
        acceleration: of their points at most [m/s^2], other than by turning steadily.
        speed_change: by which their velocities change at most, in the same way [m/s].
        uncertainty: of what is seen [m].
    """

    def __init__(
        self,
        scene: Scene,
        template: Template,
        seen: Observation,
        rows: Sequence[int],
        acceleration: float,
        speed_change: float,
        uncertainty: float,
    ) -> None:
        self.rows = tuple(rows)
        index = np.array(self.rows, dtype=np.int64)
        self.time, self._age, self._uncertainty = seen.time, seen.age, uncertainty
        self.corners, self.velocity = seen.corners[index], seen.velocity[index]
        # From the first slope only: what leans is taken for its shadow.
        directions = template.lifted[index, 0].transpose(0, 2, 1)
        self._at, self._rate = self.corners @ directions, self.velocity @ directions
        self._offsets = template.offsets[index, 0] + template.growth[index]
        self._least = template.least[index]
        self._radius = np.array([scene.moving[row].radius for row in self.rows])
        self._turning = _centripetal(self.corners, self.velocity)
        self._acceleration, self._speed_change = acceleration, speed_change

    def uncertainty(self, time: Floats) -> Floats:
        """How far a point may be off at times (..., i) [s]; the same shape [m]."""
        s, a = np.maximum(time - self.time, 0.0), self._acceleration
        grows = np.minimum(s, self._speed_change / a if a > 0.0 else 0.0)
        own = a * grows * (s - 0.5 * grows)
        seen = min(0.5 * a * self._age, self._speed_change) * s
        turned = 0.5 * self._turning * s * (s + self._age)
        return np.asarray(self._uncertainty + own + seen + turned)

    # Each bound is convex in time, and so largest at one of the ends.

    def windows(self, start: Floats, end: Floats) -> Floats:
        found = np.maximum(self._bounds(start[None])[0], self._bounds(end[None])[0])
        found[of_no_concern(found, self._least)] = -np.inf
        return np.asarray(found)

    def slabs(self, step: float, first: int, count: int) -> Floats:
        times: Floats = step * np.arange(first, first + count + 1, dtype=np.float64)
        ends = self._bounds(np.repeat(times[:, None], len(self.rows), axis=1))
        found = np.maximum(ends[:-1], ends[1:])
        found[of_no_concern(found, self._least)] = -np.inf
        return np.asarray(found)

    def way(self, start: Floats, end: Floats) -> Floats:
        return np.asarray(self.velocity.mean(axis=1) * (end - start)[:, None])

    def across(self, start: Floats, end: Floats, normals: Floats) -> Floats:
        found = []
        for time in (start, end):
            corners = self.corners + self.velocity * self._since(time)[:, None, None]
            reach = (corners @ normals.transpose(0, 2, 1)).max(axis=1)
            found.append(reach + (self.uncertainty(time) + self._radius)[:, None])
        return np.asarray(np.maximum(*found))

    def _bounds(self, times: Floats) -> Floats:
        """Grown bounds (k, i, P) [m] at times (k, i) [s]."""
        moved = self._at + self._rate * self._since(times)[..., None, None]
        return np.asarray(moved.max(axis=2) + self._offsets + self.uncertainty(times)[..., None])

    def _since(self, times: Floats) -> Floats:
        return np.maximum(times - self.time, 0.0)


def _centripetal(corners: Floats, velocity: Floats) -> Floats:
    """Acceleration of the points of geoms by turning as they do, at most, (i,) [m/s^2].

    With w = |dv| / |dx| from the points farthest apart in velocity, it is w |dv|.
    """
    if corners.shape[1] < 2:
        return np.zeros(len(corners))
    apart = corners - corners.mean(axis=1, keepdims=True)
    faster = np.linalg.norm(velocity - velocity.mean(axis=1, keepdims=True), axis=2)
    distance = np.linalg.norm(apart, axis=2)
    rate = (faster / np.maximum(distance, 1e-9)).max(axis=1)
    return np.asarray(rate**2 * distance.max(axis=1))
