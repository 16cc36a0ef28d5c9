"""How far the moving geoms of a tape reach in each direction of a template, at every instant.

Between two poses a point of a geom is off the chord by at most a h^2 / 8 if its acceleration is at
most a, and by dv h / 4 if its velocity jumps by dv once. With second differences D of the poses
(a h^2, or shared as dv h by two neighbours), a quarter of the sum of the two at the ends of the
chord bounds both, the former with a factor of four to spare.
"""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_sim.motion.slab_grid import SlabGrid
from hzmp_sim.motion.tape import Tape
from hzmp_sim.motion.template import Template, of_no_concern
from hzmp_sim.scene.scene import Scene

_JUMP = 0.02  # [m] a step shorter than this is no jump,
_LEAP = 5.0  # nor one that is less than so many times as long as the steps before and after


class Sweep:
    """Bounds of moving geoms over the intervals between the poses of a tape.

    Args:
        scene: with m moving geoms.

    Attributes:
        tape: their poses.
        template: the planes that bound them, P for each.
        points: of the geoms in their frames, shape (m, V, 3) [m].
    """

    def __init__(self, scene: Scene) -> None:
        self.tape = tape = Tape(scene)
        self.template = Template.of_scene(scene, tape.axes[0])
        most = max((len(item.points) for item in scene.moving), default=1)
        self.points: Floats = np.array(
            [
                item.points[np.minimum(np.arange(most), len(item.points) - 1)]
                for item in scene.moving
            ]
        ).reshape(len(scene.moving), most, 3)
        self._has_sides = self.points.any(axis=(1, 2))  # a ball that turns is the same ball
        m, planes = self.template.growth.shape
        self._bounds = np.empty((m, 64, planes))
        self._deviation = np.empty((m, 64))
        self._jumps = np.empty((m, 64), dtype=np.bool_)
        self._turns = np.empty((m, 64), dtype=np.int64)
        self._count = 0
        self._grids: dict[float, SlabGrid] = {}

    @property
    def bounds(self) -> Floats:
        """Supports of the geoms over the intervals, (m, K, P) [m]: that after pose k at [:, k].

        Where a geom jumps in an interval, this is where it comes from. Where it goes to is within
        the bounds of the next one.
        """
        return self._bounds[:, : self._count]

    @property
    def deviation(self) -> Floats:
        """How far a point is off the chord between its two poses at most, (m, K) [m]."""
        return self._deviation[:, : self._count]

    @property
    def jumps(self) -> Bools:
        """Whether a geom jumps in an interval, (m, K)."""
        return self._jumps[:, : self._count]

    @property
    def turns(self) -> Ints:
        """In how many intervals a geom has turned up to each, (m, K)."""
        return self._turns[:, : self._count]

    def intervals(self, start: Floats, end: Floats) -> tuple[Ints, Ints]:
        """First interval and the one after the last that hold times `start` to `end` [s].

        One more than needed at the end, for what has jumped. They are computed if need be.
        """
        first = np.maximum(np.floor(start / self.tape.step).astype(np.int64), 0)
        last = np.maximum(np.ceil(end / self.tape.step).astype(np.int64) + 1, first + 1)
        self._extend(int(last.max(initial=0)))
        return first, last

    def slab_grid(self, step: float) -> SlabGrid:
        """Bounds over slabs of time of that length [s]."""
        if step not in self._grids:
            self._grids[step] = SlabGrid(self, step)
        return self._grids[step]

    def bounds_of_jumper(self, row: int, first: int, last: int) -> Floats:
        """Grown bounds (P,) [m] of a geom that jumps in some of these intervals.

        Of what is before and after, as far as that is of concern; -inf if nothing is.
        """
        bounds, template = self.bounds[row, first:last], self.template
        ends = np.flatnonzero(self.jumps[row, first : last - 1]) + 1
        pieces = np.array([piece.max(axis=0) for piece in np.split(bounds, ends)])
        pieces += template.growth[row]
        near = ~of_no_concern(pieces, template.least[row])
        return np.asarray(np.max(pieces[near], axis=0, initial=-np.inf))

    def corners(self, first: int, last: int) -> Floats:
        """The geoms' points in the world at poses first to last - 1, (last - first, m, V, 3)."""
        turned = np.einsum("kmij,mvj->kmvi", self.tape.axes[first:last], self.points)
        return np.asarray(turned + self.tape.positions[first:last, :, None, :])

    def _extend(self, count: int) -> None:
        """Have `count` intervals."""
        if count <= self._count:
            return
        self.tape.until((count + 2) * self.tape.step)
        done, count = self._count, len(self.tape) - 2
        first = max(0, done - 1)
        corners = self.corners(first, count + 2)
        # One pose more at the beginning of time: nothing moved before.
        steps = np.diff(corners, axis=0)
        if first == done:
            steps = np.concatenate([steps[:1], steps])
        turned = np.diff(self.tape.axes[done : count + 2], axis=0)
        turned = (np.abs(turned).max(axis=(2, 3)) > 0.0) & self._has_sides
        supports = self._supports(done, count + 2, turned.any(axis=0))
        turned = turned[:-1]
        self._reserve(count)
        deviation, jumps = _deviations(steps, at_start=first == done)
        new = slice(done, count)
        landed = np.where(jumps[..., None, None], -np.inf, supports[1:-1])
        lengths = np.linalg.norm(self.template.lifted, axis=3)
        reach = np.maximum(supports[:-2], landed) + deviation[..., None, None] * lengths
        self._bounds[:, new] = reach.min(axis=2).transpose(1, 0, 2)
        self._deviation[:, new], self._jumps[:, new] = deviation.T, jumps.T
        before = self._turns[:, done - 1] if done else 0
        self._turns[:, new] = (before + turned.cumsum(axis=0)).T
        self._count = count

    def _supports(self, first: int, last: int, turn: Bools) -> Floats:
        """Supports (k, m, T, P) [m] of the geoms at poses first to last - 1; some (m,) turn."""
        m, slopes, planes, _ = self.template.lifted.shape
        directions = self.template.lifted.reshape(m, slopes * planes, 3).transpose(0, 2, 1)
        positions, axes = self.tape.positions[first:last], self.tape.axes[first:last]
        found = (positions.transpose(1, 0, 2) @ directions).transpose(1, 0, 2)
        # What does not turn has the same sides at each pose.
        for items, poses in ((~turn, slice(1)), (turn, slice(None))):
            corners = np.einsum("kmij,mvj->kmvi", axes[poses, items], self.points[items])
            found[:, items] += (corners @ directions[items]).max(axis=2)
        return np.asarray(found.reshape(-1, m, slopes, planes) + self.template.offsets)

    def _reserve(self, count: int) -> None:
        while self._bounds.shape[1] < count:
            for name in ("_bounds", "_deviation", "_jumps", "_turns"):
                array = getattr(self, name)
                setattr(self, name, np.concatenate([array, np.empty_like(array)], axis=1))


def _deviations(steps: Floats, *, at_start: bool) -> tuple[Floats, Bools]:
    """How far points are off their chords (k, m) [m], and which of these are jumps.

    `steps` (k + 2, m, V, 3) are the chords, with one before and one after those that are asked for.
    """
    length = np.linalg.norm(steps, axis=3).max(axis=2)
    beside = np.maximum(length[:-2], length[2:])
    jumps = (length[1:-1] > _JUMP) & (length[1:-1] > _LEAP * beside)
    change = np.linalg.norm(np.diff(steps, axis=0), axis=3).max(axis=2)
    before, after = change[:-1].copy(), change[1:].copy()
    leaps = np.zeros(length.shape, dtype=np.bool_)
    leaps[1:-1] = jumps
    leaps[0] = (length[0] > _JUMP) & (length[0] > _LEAP * length[1])
    leaps[-1] = (length[-1] > _JUMP) & (length[-1] > _LEAP * length[-2])
    lost_before, lost_after = leaps[:-2], leaps[2:]
    if at_start:
        lost_before = lost_before.copy()
        lost_before[0] = True
    # What a jump hides of the acceleration is taken from the other side, a kink's share with it.
    before, after = (
        np.where(lost_before, 3.0 * after, before),
        np.where(lost_after, 3.0 * before, after),
    )
    deviation = np.where(lost_before & lost_after, length[1:-1], 0.25 * (before + after))
    # Before and after a jump it moves on as it did.
    deviation = np.where(jumps, 2.0 * beside, deviation)
    follows = np.where(lost_before & leaps[:-2], 2.0 * length[1:-1], 0.0)
    return np.maximum(deviation, follows), jumps
