"""Force control of a body that translates along fixed axes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hzmp_planners.errors import QueryError
from hzmp_tracking.controllers.base import BodyState, Reference


class PointController:
    """PD with feed-forward on each axis: F = m (a_ref + 2 w (v_ref - v) + w^2 (p_ref - p)) + load.

    Critically damped with natural frequency w. The force is clipped to the actuator's limits.

    Args:
        masses: moving mass on each of the three axes [kg]; inf for an axis that cannot move,
            whose force is always zero.
        force_limits: (low, high) on each axis [N].
        loads: constant force needed to stand still on each axis [N], e.g. the weight.
        natural_frequency: w [rad/s].

    Raises:
        QueryError: a mass or the frequency is not positive.
    """

    def __init__(
        self,
        masses: Sequence[float],
        force_limits: Sequence[tuple[float, float]],
        loads: Sequence[float] = (0.0, 0.0, 0.0),
        natural_frequency: float = 15.0,
    ) -> None:
        if not all(mass > 0.0 for mass in masses):
            raise QueryError(f"masses must be positive, got {list(masses)}")
        if not 0.0 < natural_frequency < math.inf:
            raise QueryError(f"natural_frequency must be positive, got {natural_frequency}")
        self._axes = tuple(zip((0, 1, 2), masses, force_limits, loads, strict=True))
        self._stiffness = natural_frequency**2
        self._damping = 2.0 * natural_frequency

    def reset(self) -> None:
        """Nothing is remembered."""

    def command(self, state: BodyState, reference: Reference) -> tuple[float, ...]:
        """Force on each of the three axes [N]."""
        forces = [0.0, 0.0, 0.0]
        for axis, mass, (low, high), load in self._axes:
            if mass == math.inf:
                continue
            acceleration = (
                reference.acceleration[axis]
                + self._damping * (reference.velocity[axis] - state.velocity[axis])
                + self._stiffness * (reference.position[axis] - state.position[axis])
            )
            forces[axis] = min(max(mass * acceleration + load, low), high)
        return tuple(forces)
