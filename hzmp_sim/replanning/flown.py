"""The reference that was flown: parts of many trajectories, and the rests between them."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from hzmp_sim.replanning.commitment import Commitment
from hzmp_tracking import Limits, Trajectory

_SHORTEST = 1e-9  # [s] of a part that is worth keeping


class FlownReference:
    """What is flown now, and what was before.

    Args:
        first: commitment from time 0 on.
    """

    def __init__(self, first: Commitment) -> None:
        self.current = first
        """What is flown now."""
        self._parts: list[Trajectory] = []

    def switch(self, commitment: Commitment) -> None:
        """Fly another commitment from its beginning on, where the old one is at that time."""
        self._close(commitment.begins)
        self.current = commitment

    def around(self, width: float) -> tuple[Trajectory, float]:
        """What is flown now with some time [s] before it, and the time at which that begins [s]."""
        before: list[Trajectory] = []
        for part in reversed(self._parts):
            if width <= 0.0:
                break
            before.insert(0, part)
            width -= part.duration
        parts = [*before, self.current.trajectory]
        return Trajectory.join(parts), self.current.begins - sum(one.duration for one in before)

    def whole(self, time: float) -> Trajectory:
        """All of it until now [s], as one trajectory, each piece with its cell."""
        self._close(time)
        return Trajectory.join(self._parts)

    def _close(self, time: float) -> None:
        """Keep what has been flown of the current commitment, its rest included."""
        trajectory, begins = self.current.trajectory, self.current.begins
        moved = min(time - begins, trajectory.duration)
        if moved > _SHORTEST:
            self._parts.append(trajectory.part(0.0, moved))
        rested = time - begins - trajectory.duration
        if rested > _SHORTEST:
            cell = trajectory.cells[int(trajectory.piece_cells[-1])]
            self._parts.append(resting(self.current.end, cell, trajectory.limits, rested))


def resting(position: Floats, cell: Polytope, limits: Limits, duration: float) -> Trajectory:
    """A trajectory that stays where it is, shape (n,) [m], for a time [s]."""
    coefficients = np.zeros((1, 4, position.size))
    coefficients[0, 0] = position
    return Trajectory(
        breakpoints=np.array([0.0, duration]),
        coefficients=coefficients,
        piece_cells=np.zeros(1, dtype=np.int64),
        cells=(cell,),
        waypoints=np.array([position, position]),
        limits=limits,
    )


def rest_at(space: FreeSpace, position: Floats, limits: Limits, duration: float) -> Commitment:
    """Stay at a free position from time 0 on."""
    leaf = int(space.leaves_at(position)[0])
    return Commitment(resting(position, space.leaf(leaf), limits, duration), 0.0, np.inf)
