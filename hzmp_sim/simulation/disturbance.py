"""What a flight has to put up with: wind, weak actuators, sensors that err and lag."""

from __future__ import annotations

import copy
import math
from collections import deque
from collections.abc import Sequence

import mujoco
import numpy as np
from scipy.signal import lfilter

from hzmp_planners._arrays import Floats
from hzmp_sim.settings import Disturbance
from hzmp_tracking.controllers import BodyState

_AIR = 1.2, 1.8e-5  # density [kg/m^3] and viscosity [Pa s] at sea level
_GUST_TIME = 0.5  # [s] over which a gust forgets itself
_SIGMAS = 3.0  # a gust's largest size is that many standard deviations of an axis


def disturbed_model(
    model: mujoco.MjModel, actuators: Sequence[int], disturbance: Disturbance
) -> mujoco.MjModel:
    """A copy of the model with air, where it blows, and weaker actuators."""
    disturbed = copy.copy(model)
    if disturbance.blows and model.opt.density == 0.0:
        disturbed.opt.density, disturbed.opt.viscosity = _AIR
    # Constant, per length and per velocity: servos lose of all the force that they give.
    for parameters in (disturbed.actuator_gainprm, disturbed.actuator_biasprm):
        parameters[list(actuators), :3] *= 1.0 - disturbance.thrust_loss
    return disturbed


def wind_at_steps(
    disturbance: Disturbance, steps: int, dt: float, rng: np.random.Generator
) -> Floats:
    """Velocity of the air at each physics step beside the world's, shape (steps, 3) [m/s].

    Gusts are a first-order Gauss-Markov process on each axis, cut off at their largest size.
    """
    wind = np.tile(np.array(disturbance.wind, dtype=np.float64), (steps, 1))
    if disturbance.gust == 0.0:
        return wind
    sigma, memory = disturbance.gust / _SIGMAS, math.exp(-dt / _GUST_TIME)
    drawn = sigma * rng.standard_normal((steps, 3))
    drawn[1:] *= math.sqrt(1.0 - memory**2)
    gusts = np.asarray(lfilter([1.0], [1.0, -memory], drawn, axis=0))
    size = np.linalg.norm(gusts, axis=1, keepdims=True)
    share = np.minimum(1.0, disturbance.gust / np.maximum(size, 1e-300))
    return np.asarray(wind + gusts * share)


class Sensors:
    """What is measured of a body: late by whole physics steps, and with white noise."""

    def __init__(
        self, disturbance: Disturbance, steps: int, dt: float, rng: np.random.Generator
    ) -> None:
        late = round(disturbance.delay / dt)
        self._states: deque[BodyState] = deque(maxlen=late + 1)
        scale = np.repeat([disturbance.position_noise, disturbance.velocity_noise], 3)
        self._noise = (scale * rng.standard_normal((steps, 6))).tolist() if scale.any() else None
        self._step = 0

    def measure(self, state: BodyState) -> BodyState:
        """What is measured when this is the state; to be called once a step."""
        self._states.append(state)
        seen = self._states[0]
        if self._noise is None:
            return seen
        noise = self._noise[self._step]
        self._step += 1
        return seen._replace(
            position=[x + e for x, e in zip(seen.position, noise[:3], strict=True)],
            velocity=[v + e for v, e in zip(seen.velocity, noise[3:], strict=True)],
        )
