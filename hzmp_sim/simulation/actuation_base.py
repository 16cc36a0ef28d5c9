"""What every body that can be steered offers the closed loop."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import mujoco

from hzmp_tracking import Limits, RotorLimits
from hzmp_tracking.controllers import BodyState, Controller, Reference


class Actuation(ABC):
    """Reads the state of one body from `MjData` and writes its actuator inputs."""

    controller: Controller
    """The feedback law."""
    default_limits: Limits
    """Limits of a reference that this body follows closely."""
    actuators: tuple[int, ...]
    """That move the body."""
    rotors: RotorLimits | None = None
    """All that its rotors have, if it has some."""
    smoothing = 0.0
    """Window over which the reference of this body is smoothed [s], see `smooth_sample`."""

    def __init__(self, model: mujoco.MjModel, body: str) -> None:
        self._body = body
        self._id = model.body(body).id

    @abstractmethod
    def state(self, data: mujoco.MjData) -> BodyState:
        """State of the body; `data` must hold up-to-date kinematics (as after `mj_forward`)."""

    @abstractmethod
    def trim(self, data: mujoco.MjData) -> None:
        """Set inputs and actuator states to those of standing still where the body is."""

    @abstractmethod
    def _write(self, data: mujoco.MjData, command: tuple[float, ...], state: BodyState) -> None: ...

    def apply(
        self,
        data: mujoco.MjData,
        state: BodyState,
        position: Sequence[float],
        velocity: Sequence[float],
        acceleration: Sequence[float],
        jerk: Sequence[float],
        snap: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Write `data.ctrl` so that a body follows the reference, each (3,) in the world.

        To be called once a time step, after `trim` at the beginning.

        `state` is what is measured of it. Lists are faster than arrays.
        """
        reference = Reference(position, velocity, acceleration, jerk, snap)
        self._write(data, self.controller.command(state, reference), state)
