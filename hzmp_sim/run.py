"""What a closed-loop run leaves behind: the flight log and everything that led to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints

if TYPE_CHECKING:
    from hzmp_planners.free_space import FreeSpace
    from hzmp_planners.planning import Plan
    from hzmp_sim.replanning import FlightPlan
    from hzmp_sim.scene import Scene
    from hzmp_tracking import Trajectory


@dataclass(frozen=True, eq=False)
class FlightLog:
    """One row a physics step, T rows; row 0 is the state before the first step."""

    time: Floats
    """Simulated time [s], shape (T,)."""
    qpos: Floats
    """Generalised positions of the whole model, shape (T, nq)."""
    mocap: Floats
    """Position [m] and quaternion wxyz of each mocap body, shape (T, nmocap, 7)."""
    position: Floats
    """Centre of the body in the world [m], shape (T, 3)."""
    quaternion: Floats
    """Orientation of the body, wxyz, shape (T, 4)."""
    velocity: Floats
    """Velocity of the centre in the world [m/s], shape (T, 3)."""
    reference: Floats
    """Reference position [m], shape (T, 3)."""
    control: Floats
    """Actuator inputs, shape (T, nu)."""
    clearance: Floats
    """Smallest distance of the body to a geom that it could touch [m], shape (T,); inf without."""
    nearest: Ints
    """Id of the geom at that distance, shape (T,); -1 if there is none."""
    contact: Ints
    """Id of a geom that MuJoCo reports in penetrating contact with the body, (T,); -1 if none."""

    @property
    def collision(self) -> Bools:
        """Whether the body is in penetrating contact, shape (T,)."""
        return np.asarray(self.contact >= 0)

    @property
    def tilt(self) -> Floats:
        """Angle between the vertical and the body's z axis [rad], shape (T,)."""
        x, y = self.quaternion[:, 1], self.quaternion[:, 2]
        return np.asarray(2.0 * np.arcsin(np.minimum(1.0, np.hypot(x, y))))

    @property
    def tracking_error(self) -> Floats:
        """Distance of the centre to its reference [m], shape (T,)."""
        return np.asarray(np.linalg.norm(self.position - self.reference, axis=1))


@dataclass(frozen=True, eq=False)
class Run:
    """A finished closed-loop run.

    `trajectory` and `log` are None when there was nothing to fly (no path found). Where something
    moves, `plan` is among what does not, and `trajectory` is the reference as it was flown.
    """

    scene: Scene
    space: FreeSpace
    plan: Plan
    trajectory: Trajectory | None
    log: FlightLog | None
    metrics: dict[str, Any]
    """What metrics.json holds."""
    flight_plan: FlightPlan | None = None
    """What was planned in flight, where something moves."""
