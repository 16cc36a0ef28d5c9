"""What pushes a body beside its actuators, from measured velocity and modelled thrust."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hzmp_planners.errors import QueryError


class DisturbanceObserver:
    """Luenberger observer of v' = u + d, d' = 0, with both poles at -w: it knows d after 4 / w.

    It sees what the actuators give, not what was asked of them, so that it does not wind up when
    they saturate.

    Args:
        frequency: w [rad/s]; 0: no disturbance is ever seen.
        time_step: between two updates [s].
        most: largest size of a disturbance that is believed [m/s^2].

    Raises:
        QueryError: a frequency below 0 or too high for the time step, or the others not positive.
    """

    def __init__(self, frequency: float, time_step: float, most: float) -> None:
        if not (time_step > 0.0 and most > 0.0 and 0.0 <= frequency * time_step < 1.0):
            raise QueryError(
                "time_step and most must be positive and frequency at least 0 and below "
                f"1 / time_step, got {time_step}, {most} and {frequency}"
            )
        # Both poles of the sampled observer at exp(-w dt).
        pole = math.exp(-frequency * time_step)
        self._fast, self._slow = 1.0 - pole**2, (1.0 - pole) ** 2 / time_step
        self._dt, self._most = time_step, most
        self.reset()

    def reset(self) -> None:
        """Forget what was measured."""
        self._velocity: list[float] = []
        self._disturbance = [0.0, 0.0, 0.0]

    def update(
        self, velocity: Sequence[float], acceleration: Sequence[float]
    ) -> tuple[list[float], list[float]]:
        """Velocity with less noise than measured [m/s], and disturbance [m/s^2], each (3,).

        Args:
            velocity: measured now, (3,) [m/s].
            acceleration: by actuators and gravity until the next update, (3,) [m/s^2].
        """
        if not self._velocity:
            self._velocity = list(velocity)
        errors = [v - seen for v, seen in zip(velocity, self._velocity, strict=True)]
        found = [d + self._slow * e for d, e in zip(self._disturbance, errors, strict=True)]
        size = math.sqrt(sum(d * d for d in found))
        share = min(1.0, self._most / size) if size > 0.0 else 1.0
        self._disturbance = [share * d for d in found]
        known = [seen + self._fast * e for seen, e in zip(self._velocity, errors, strict=True)]
        self._velocity = [
            v + self._dt * (u + d)
            for v, u, d in zip(known, acceleration, self._disturbance, strict=True)
        ]
        return known, self._disturbance
