"""A body under a controller of the user's own, whatever its joints and actuators."""

from __future__ import annotations

import mujoco
import numpy as np

from hzmp_planners.errors import QueryError, SceneError
from hzmp_sim.simulation.actuation import actuation_for
from hzmp_sim.simulation.actuation_base import Actuation
from hzmp_tracking import Limits
from hzmp_tracking.controllers import BodyState, Controller, Reference


class OwnActuation(Actuation):
    """Commands of the controller are MuJoCo's inputs: `data.ctrl`, in the order of the model.

    Args:
        model: compiled.
        body: what is steered.
        controller: the law.

    Raises:
        SceneError: the model has no actuator.
    """

    def __init__(self, model: mujoco.MjModel, body: str, controller: Controller) -> None:
        super().__init__(model, body)
        if not model.nu:
            raise SceneError(f"body {body!r} has no actuator that a controller could use")
        self.controller = controller
        self.actuators = tuple(range(model.nu))
        self._model = model
        try:
            self.default_limits = actuation_for(model, body).default_limits
        except SceneError:  # a body that only a law of its own can steer
            self.default_limits = Limits()

    def state(self, data: mujoco.MjData) -> BodyState:
        # By Jacobians: MuJoCo's own velocities of bodies are those before the step.
        linear, angular = np.zeros((3, self._model.nv)), np.zeros((3, self._model.nv))
        mujoco.mj_jacBody(self._model, data, linear, angular, self._id)
        turn = data.xmat[self._id].reshape(3, 3).T @ (angular @ data.qvel)
        return BodyState(
            data.xpos[self._id].tolist(),
            (linear @ data.qvel).tolist(),
            data.xquat[self._id].tolist(),
            turn.tolist(),
        )

    def trim(self, data: mujoco.MjData) -> None:
        state = self.state(data)
        self._write(data, self.controller.command(state, Reference(state.position)), state)

    def _write(self, data: mujoco.MjData, command: tuple[float, ...], state: BodyState) -> None:
        if len(command) != len(self.actuators):
            names = ", ".join(repr(self._model.actuator(k).name) for k in self.actuators)
            raise QueryError(
                f"the controller of body {self._body!r} gave {len(command)} commands; the model "
                f"has {len(self.actuators)} actuators: {names}"
            )
        data.ctrl[:] = command
