"""What the body is to follow: one trajectory, or whatever a planner says in flight."""

from __future__ import annotations

from typing import Protocol

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.scene import Scene
from hzmp_sim.settings import RunSettings
from hzmp_tracking import Trajectory
from hzmp_tracking.smoothing import smooth_sample

ReferenceRow = list[list[float]]
"""Position to snap, each (3,): lists, which controllers take fastest."""

AT_REST = 0.05
"""A body slower than this has settled [m/s]."""


class Guide(Protocol):
    """Gives the reference of every physics step; asked once a step, in order."""

    longest: float
    """The flight is over after this time at the latest [s]."""

    def reference(self, step: int, time: float, data: mujoco.MjData) -> ReferenceRow:
        """What to follow now; `data` holds the state of the world."""
        ...

    def over(self, time: float, position: Floats, speed: float) -> bool:
        """Whether the flight ends here, with the centre at a position (3,) [m], at a speed."""
        ...


class FixedGuide:
    """Follows one trajectory, until the body rests at its end.

    Args:
        scene: which lifts the reference to the world.
        trajectory: in the scene's dimension, from time 0.
        settings: when the body has arrived, and how long to wait for that.
        smoothing: window over which the reference is smoothed [s], see `smooth_sample`.
    """

    def __init__(
        self,
        scene: Scene,
        trajectory: Trajectory,
        settings: RunSettings,
        smoothing: float,
    ) -> None:
        self._scene, self._trajectory = scene, trajectory
        self._tolerance = settings.goal_tolerance
        self._smoothing = smoothing
        self.longest = trajectory.duration + settings.settle_time
        self._rows: list[ReferenceRow] = []
        end = trajectory.sample(trajectory.duration).position
        self._goal = scene.to_world(end)[0]

    def reference(self, step: int, time: float, data: mujoco.MjData) -> ReferenceRow:
        """See `Guide`."""
        del data
        if not self._rows:
            dt = self._scene.model.opt.timestep
            count = int(np.ceil(self.longest / dt)) + 1
            times = dt * np.arange(count, dtype=np.float64)
            self._rows = reference_rows(self._scene, self._trajectory, times, self._smoothing)
        return self._rows[step]

    def over(self, time: float, position: Floats, speed: float) -> bool:
        """See `Guide`."""
        arrived = np.linalg.norm(position - self._goal) <= self._tolerance
        return time >= self._trajectory.duration and bool(arrived) and speed <= AT_REST


def reference_rows(
    scene: Scene, trajectory: Trajectory, times: Floats, smoothing: float
) -> list[ReferenceRow]:
    """The trajectory at each of the times (k,) [s], lifted to the world; see `smooth_sample`."""
    position, *derivatives = smooth_sample(trajectory, times, smoothing)
    parts = np.zeros((len(times), 5, 3))
    parts[:, 0] = scene.to_world(position)
    for i, values in enumerate(derivatives, start=1):
        parts[:, i, : scene.n] = values
    rows: list[ReferenceRow] = parts.tolist()
    return rows
