"""Where moving geoms will be in the way of the body: what a planner asks, from now on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import mujoco
import numpy as np

from hzmp_planners._arrays import Bools, Floats
from hzmp_planners.errors import QueryError
from hzmp_sim.motion.constant_velocity import ConstantVelocity
from hzmp_sim.motion.hulls import Hulls
from hzmp_sim.motion.observation import Observation, Observer
from hzmp_sim.motion.resolve import driven_bodies
from hzmp_sim.motion.scripted import Scripted
from hzmp_sim.motion.source import Slabs, Source
from hzmp_sim.motion.sweep import Sweep
from hzmp_sim.motion.template import growth
from hzmp_sim.scene.bodies import carriers
from hzmp_sim.scene.scene import Scene

_CHORDS = 0.05  # a plane along the way is left out when its normal is so near one of the box (sine)
_Ask = Callable[[Source, list[int]], Floats]
_MOST_CUTS = {2: 4, 3: 6}
"""Planes of a hull beyond those of its box: each may cut the free space into one more leaf."""
_LOOK_AHEAD = 8.0  # [s]
_GRID_TOL = 1e-9  # of a slab: a time so near before its beginning counts as that
_SHORT = 1e-3  # [m] a way shorter than this has no direction


@dataclass(frozen=True)
class Broken:
    """A geom that is not where it was predicted."""

    geom: int
    """Geom id."""
    name: str
    time: float
    """When it was seen [s]."""
    distance: float
    """How far beyond what was predicted [m]."""


class Predictor:
    """Makes predictions for a scene, again and again.

    Announced motions and MuJoCo's own dynamics are known ahead, by a tape. Geoms that an
    unannounced motion drives, and those that were seen where the tape does not have them, are
    predicted from what is seen of them.

    Args:
        scene: with moving geoms.
        acceleration: of the points of what is not known ahead, at most [m/s^2].
        speed_change: by which their velocities change at most, while it is looked ahead [m/s].
        tolerance: how far a geom may be from where it was predicted [m].
    """

    def __init__(
        self,
        scene: Scene,
        acceleration: float = 2.0,
        speed_change: float = math.inf,
        tolerance: float = 1e-3,
    ) -> None:
        for name, value in (("acceleration", acceleration), ("tolerance", tolerance)):
            if not 0.0 <= value < np.inf:
                raise QueryError(f"{name} must be finite and at least 0, got {value}")
        if not speed_change >= 0.0:
            raise QueryError(f"speed_change must be at least 0, got {speed_change}")
        self.scene, self.tolerance = scene, tolerance
        self.acceleration, self.speed_change = acceleration, speed_change
        self.sweep = Sweep(scene)
        self.observer = Observer(scene, self.sweep.points)
        self._unknown = _unannounced(scene)
        self._look_ahead(0.0)

    def ready(self, data: mujoco.MjData, time: float) -> bool:
        """Whether the velocities are known of what is predicted from what is seen.

        They are differences: what was seen once has none.
        """
        return not self._unknown.any() or self.observe(data, time).age > 0.0

    def predict(self, data: mujoco.MjData, time: float) -> Prediction:
        """The prediction at a time [s], from what is seen in `data` (kinematics up to date)."""
        seen = self.observe(data, time)
        self._look_ahead(time)
        return Prediction(self, seen, self._unknown)

    def _look_ahead(self, time: float) -> None:
        """Have the tape ready that predictions made at a time [s] usually ask for.

        So that its cost is spread over all of them.
        """
        end = np.array([time + _LOOK_AHEAD])
        self.sweep.intervals(end, end)

    def observe(self, data: mujoco.MjData, time: float) -> Observation:
        """See the geoms at a time [s]: the velocities are means since they were last seen."""
        seen = self.observer.see(data, time)
        self._unknown = self._unknown | (self.tape_error(seen) > self.tolerance)
        return seen

    def tape_error(self, seen: Observation) -> Floats:
        """How far each geom is from where the tape has it, (m,) [m]."""
        first, _ = self.sweep.intervals(np.array([seen.time]), np.array([seen.time]))
        k = int(first[0])
        share = seen.time / self.sweep.tape.step - k
        before, after = self.sweep.corners(k, k + 2)
        jumps, off = self.sweep.jumps[:, k], self.sweep.deviation[:, k]
        there = before + np.where(jumps[:, None, None], round(share), share) * (after - before)
        error = np.linalg.norm(seen.corners - there, axis=2).max(axis=1) - off
        # Around a jump, which of its two sides it is on hangs on a round-off of the time.
        other = np.linalg.norm(seen.corners - after, axis=2).max(axis=1) - off
        return np.asarray(np.where(jumps, np.minimum(error, other), error))


class Prediction:
    """What is predicted at one time for the g moving geoms of a scene.

    Attributes:
        time: when it was made [s].
        geoms: ids of the geoms.
        known: which of them are known ahead, shape (g,); the others are as they were seen.
    """

    def __init__(self, predictor: Predictor, seen: Observation, unknown: Bools) -> None:
        scene, sweep = predictor.scene, predictor.sweep
        self.time = seen.time
        self.geoms = tuple(item.geom for item in scene.moving)
        self.known: Bools = ~unknown
        self._predictor, self._template, self._scene = predictor, sweep.template, scene
        self._sources: list[Source] = []
        if self.known.any():
            self._sources.append(Scripted(scene, sweep, np.flatnonzero(self.known).tolist()))
        self._seen: ConstantVelocity | None = None
        if unknown.any():
            rows = np.flatnonzero(unknown).tolist()
            self._seen = ConstantVelocity(
                scene,
                sweep.template,
                seen,
                rows,
                predictor.acceleration,
                predictor.speed_change,
                predictor.tolerance,
            )
            self._sources.append(self._seen)

    def hulls(self, start: Floats, end: Floats) -> Hulls:
        """Where the body's centre could touch each geom at any time in a window of its own.

        Args:
            start: beginnings of the windows in simulated time, shape (g,) [s].
            end: their ends, (g,) [s].

        Returns:
            Convex sets of few facets that hold all positions (n,) of the centre at which the body,
            with the clearance, could touch the geom between its start and end. None for a geom that
            stays out of the bounds of the centre, or out of a planar body's heights.
        """
        begin, finish = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
        if begin.shape != (len(self.geoms),) or finish.shape != begin.shape:
            raise QueryError(f"start and end must have shape ({len(self.geoms)},)")
        if (finish < begin).any():
            raise QueryError("a window ends before it starts")
        if not self.geoms:
            return Hulls.none(self._scene.n)
        offsets = self._gather(lambda source, rows: source.windows(begin[rows], finish[rows]))
        normals = self._template.normals
        count = normals.shape[1]
        along, reach = self._along(begin, finish)
        normals = np.concatenate([normals, along], axis=1)
        offsets = np.concatenate([offsets[:, :count], reach], axis=1)
        # Planes along its way suit what goes straight on, directions all around what turns.
        turns: Bools = np.asarray(np.isinf(reach).all(axis=1))
        allowed = np.ones(offsets.shape, dtype=np.bool_)
        allowed[:, :count] = self._template.own | turns[:, None]
        kept = self._cutting(normals, offsets, allowed)
        there = offsets[:, :1] > -np.inf
        return Hulls(normals, np.where(there, np.where(kept, offsets, np.inf), -np.inf))

    def boxes(self, start: Floats, end: Floats) -> Hulls:
        """The same as boxes along the sides of the geoms: larger, but quickly cut out."""
        n = self._scene.n
        begin, finish = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
        if not self.geoms:
            return Hulls.none(n)
        offsets = self._gather(lambda source, rows: source.windows(begin[rows], finish[rows]))
        frames, offsets = self._template.normals[:, : 2 * n], offsets[:, : 2 * n]
        signs = np.array(list(product((0, 1), repeat=n))) + 2 * np.arange(n)
        sides = np.where(offsets > -np.inf, offsets, 0.0)
        vertices = (sides[:, signs] * np.where(signs % 2, -1.0, 1.0)) @ frames[:, ::2]
        return Hulls(frames, offsets, vertices)

    def slabs(self, start: float, step: float, count: int) -> Slabs:
        """The same for each slab of time, with more facets.

        Slabs lie on a grid: the first begins at the last multiple of `step` until `start`.

        Args:
            start: simulated time [s].
            step: how long each is [s], positive.
            count: how many there are.
        """
        if not step > 0.0 or count < 1:
            raise QueryError(f"slabs need a positive step and count, got {step} s and {count}")
        normals = self._template.normals
        planes = self._template.growth.shape[1]
        first = math.floor(start / step + _GRID_TOL)
        b = np.full((count, len(self.geoms), planes), -np.inf)
        for source in self._sources:
            b[:, list(source.rows)] = source.slabs(step, first, count)
        return Slabs(normals, b[:, :, : normals.shape[1]], first * step, step)

    def broken(self, data: mujoco.MjData, time: float) -> list[Broken]:
        """The geoms that at a time [s] are not where this prediction had them."""
        seen = self._predictor.observer.see(data, time)
        error = self._predictor.tape_error(seen)
        if self._seen is not None:
            rows = list(self._seen.rows)
            there = self._seen.corners + self._seen.velocity * (time - self._seen.time)
            off = np.linalg.norm(seen.corners[rows] - there, axis=2).max(axis=1)
            error[rows] = off - self._seen.uncertainty(np.full(len(rows), time))
        allowed = np.where(self.known, self._predictor.tolerance, 0.0)
        return [
            Broken(self.geoms[i], self._scene.geom_name(self.geoms[i]), time, float(error[i]))
            for i in np.flatnonzero(error > allowed + 1e-9).tolist()
        ]

    def _gather(self, ask: _Ask) -> Floats:
        """What the sources say, put together: shape (g, ...)."""
        found: Floats | None = None
        for source in self._sources:
            rows = list(source.rows)
            part = ask(source, rows)
            if found is None:
                found = np.empty((len(self.geoms), *part.shape[1:]))
            found[rows] = part
        assert found is not None, "asked for no geom"
        return found

    def _along(self, start: Floats, end: Floats) -> tuple[Floats, Floats]:
        """Planes along the way of each geom, (g, M, n), and how far the body puts them, (g, M)."""
        n, frame = self._scene.n, self._template.normals[:, : 2 * self._scene.n : 2]
        way = self._gather(lambda source, rows: source.way(start[rows], end[rows]))[:, :n]
        length = np.linalg.norm(way, axis=1, keepdims=True)
        unit = way / np.maximum(length, _SHORT)
        if n == 2:
            across = np.stack([-unit[:, 1], unit[:, 0]], axis=1)[:, None, :]
        else:
            across = np.cross(frame, unit[:, None, :])
        size = np.linalg.norm(across, axis=2, keepdims=True)
        idle = (size < _CHORDS) | (length[:, None] < _SHORT)
        # What has no direction repeats a plane of the box, infinitely far out: it cuts nothing off.
        across = np.where(idle, frame[:, : across.shape[1]], across / np.maximum(size, 1e-9))
        normals = np.concatenate([across, -across], axis=1)
        world = np.zeros((*normals.shape[:2], 3))
        world[:, :, :n] = normals
        reach = self._gather(
            lambda source, rows: source.across(start[rows], end[rows], world[rows])
        )
        reach[np.concatenate([idle, idle], axis=1)[:, :, 0]] = np.inf
        return normals, reach + growth(self._scene, normals)

    def _cutting(self, normals: Floats, offsets: Floats, allowed: Bools) -> Bools:
        """Which allowed planes to keep, (g, F): the box's, and those that cut most off it."""
        n = self._scene.n
        box = normals[:, : 2 * n : 2]
        shares = normals @ box.transpose(0, 2, 1)
        high, low = offsets[:, None, : 2 * n : 2], offsets[:, None, 1 : 2 * n : 2]
        with np.errstate(invalid="ignore"):
            corner = (np.maximum(shares, 0.0) * high + np.maximum(-shares, 0.0) * low).sum(axis=2)
            cut = np.where(allowed, corner - offsets, -np.inf)
        cut[:, : 2 * n] = -np.inf
        least = np.partition(cut, -_MOST_CUTS[n], axis=1)[:, -_MOST_CUTS[n], None]
        kept = cut > np.maximum(self._scene.tolerance, least - 1e-12)
        kept[:, : 2 * n] = True
        return np.asarray(kept)


def _unannounced(scene: Scene) -> Bools:
    """Which moving geoms hang from a body that an unannounced motion drives, (m,)."""
    model, script = scene.model, scene.motion
    driven = driven_bodies(script, model) if script is not None else {}
    secret = {body for body, motion in driven.items() if not motion.announced}
    found = [
        not secret.isdisjoint(carriers(model, int(model.geom_bodyid[item.geom])))
        for item in scene.moving
    ]
    return np.array(found, dtype=np.bool_)
