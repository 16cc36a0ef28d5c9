"""Kinematic limits of a trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, as_floats, frozen
from hzmp_planners.errors import QueryError, ShapeError


@dataclass(frozen=True, eq=False)
class Limits:
    """Symmetric bounds on each axis; a scalar holds for every axis.

    Raises:
        ShapeError: neither a scalar nor an array (n,), or not finite.
        QueryError: a bound that is not positive.
    """

    velocity: ArrayLike = 2.0
    """[m/s], scalar or (n,)."""
    acceleration: ArrayLike = 4.0
    """[m/s^2], scalar or (n,)."""
    jerk: ArrayLike = 30.0
    """[m/s^3], scalar or (n,)."""

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration", "jerk"):
            value = np.asarray(getattr(self, name))
            checked = as_floats(value, f"limit {name}", min(value.ndim, 1))
            if (checked <= 0.0).any():
                raise QueryError(f"limit {name} must be positive, got {checked.tolist()}")
            object.__setattr__(self, name, float(checked) if checked.ndim == 0 else checked)

    def per_axis(self, n: int) -> tuple[Floats, Floats, Floats]:
        """Velocity, acceleration and jerk bounds as arrays (n,).

        Raises:
            ShapeError: a limit was given for another number of axes.
        """
        values = []
        for name in ("velocity", "acceleration", "jerk"):
            value = np.asarray(getattr(self, name), dtype=np.float64)
            if value.ndim == 1 and value.shape != (n,):
                raise ShapeError(f"limit {name} must be a scalar or have {n} entries, got {value}")
            values.append(frozen(np.broadcast_to(value, (n,)).copy()))
        return values[0], values[1], values[2]
