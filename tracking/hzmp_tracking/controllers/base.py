"""What a controller is told, and what it is.

Controllers run at every physics step. At three to four numbers an operation, Python floats are
several times faster than numpy arrays: states are sequences of floats (`array.tolist()`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol


class BodyState(NamedTuple):
    """Measured state of a rigid body; world frame unless stated otherwise."""

    position: Sequence[float]
    """(3,) [m]"""
    velocity: Sequence[float]
    """(3,) [m/s]"""
    quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0)
    """Body to world, wxyz, unit."""
    angular_velocity: Sequence[float] = (0.0, 0.0, 0.0)
    """(3,) in the body frame [rad/s]"""


class Reference(NamedTuple):
    """State to follow, each entry (3,)."""

    position: Sequence[float]
    """[m]"""
    velocity: Sequence[float] = (0.0, 0.0, 0.0)
    """[m/s]"""
    acceleration: Sequence[float] = (0.0, 0.0, 0.0)
    """[m/s^2]"""
    jerk: Sequence[float] = (0.0, 0.0, 0.0)
    """[m/s^3]"""
    snap: Sequence[float] = (0.0, 0.0, 0.0)
    """Derivative of the jerk [m/s^4]."""


class Controller(Protocol):
    """A feedback law, called once a time step."""

    def command(self, state: BodyState, reference: Reference) -> tuple[float, ...]:
        """Actuator commands; their meaning is the controller's (forces [N], thrusts [N])."""
        ...
