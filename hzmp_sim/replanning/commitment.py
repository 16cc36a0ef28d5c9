"""What the body has been told to fly: a trajectory that begins at some time and ends at rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_tracking import Trajectory


class State(NamedTuple):
    """Of the reference at one instant, each (n,)."""

    position: Floats
    """[m]"""
    velocity: Floats
    """[m/s]"""
    acceleration: Floats
    """[m/s^2]"""


@dataclass(frozen=True, eq=False)
class Commitment:
    """A trajectory that is flown from a time on. Where it ends, the body rests until told more."""

    trajectory: Trajectory
    begins: float
    """Simulated time of its first instant [s]."""
    remaining: float
    """Length of the way that is left from its end to the goal [m]; 0 if it ends there."""

    @property
    def ends(self) -> float:
        """Simulated time from which it rests [s]."""
        return self.begins + self.trajectory.duration

    @property
    def end(self) -> Floats:
        """Where it rests, shape (n,) [m]."""
        return np.asarray(self.trajectory.sample(self.trajectory.duration).position[0])

    def state(self, time: float) -> State:
        """The reference at a simulated time [s]."""
        sample = self.trajectory.sample(time - self.begins)
        return State(sample.position[0], sample.velocity[0], sample.acceleration[0])
