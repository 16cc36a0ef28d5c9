"""The closed loop: guide, controller, physics, audit, log, each at its own rate."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np

from hzmp_planners.errors import SceneError
from hzmp_sim.run import FlightLog
from hzmp_sim.scene import Scene
from hzmp_sim.settings import RunSettings
from hzmp_sim.simulation.actuation_base import Actuation
from hzmp_sim.simulation.contact_audit import ContactAudit
from hzmp_sim.simulation.disturbance import Sensors, disturbed_model, wind_at_steps
from hzmp_sim.simulation.guide import Guide
from hzmp_sim.simulation.recorder import Recorder

_MOST_STEPS = 20_000_000  # of a flight: what it logs of them takes some GB


class Drives(Protocol):
    """Moves what the world moves by itself."""

    def apply(self, data: mujoco.MjData, t: float) -> None:
        """Put mocap bodies, joints and actuators where they are at simulated time t [s]."""
        ...


class ClosedLoop:
    """A body under control in MuJoCo, in a world that moves, with one audit a physics step.

    Args:
        scene: the world and the body.
        actuation: from reference and state to actuator inputs.
        model: the scene's, or a disturbed copy of it.
        sensors: what is measured of the body.
        drives: what moves in the world.
        every: physics steps between two controls.
    """

    def __init__(
        self,
        scene: Scene,
        actuation: Actuation,
        model: mujoco.MjModel,
        sensors: Sensors,
        drives: Drives | None = None,
        every: int = 1,
    ) -> None:
        self.data = mujoco.MjData(model)
        self.data.qpos[:] = scene.initial_qpos
        self._model, self._actuation, self._sensors = model, actuation, sensors
        self._drives, self._every, self._step = drives, every, 0
        self._drive()
        mujoco.mj_forward(model, self.data)
        actuation.trim(self.data)
        mujoco.mj_forward(model, self.data)
        self._audit = ContactAudit(scene, self.data)

    def control(self, reference: Sequence[Sequence[float]]) -> tuple[float, int, int]:
        """Set the inputs for a reference (position to snap, each (3,)), and audit the state.

        Returns:
            Clearance [m], geom at that distance, geom in penetrating contact; -1 where none.
        """
        found = self._audit.step()
        measured = self._sensors.measure(self._actuation.state(self.data))
        if self._step % self._every == 0:
            self._actuation.apply(self.data, measured, *reference)
        return found

    def advance(self) -> bool:
        """One physics step; False when state or inputs are no longer finite."""
        self._step += 1
        mujoco.mj_step(self._model, self.data)
        self._drive()
        # mj_step leaves contacts and poses of the state before it: bring them up to date.
        mujoco.mj_fwdPosition(self._model, self.data)
        return not _diverged(self.data)

    def _drive(self) -> None:
        if self._drives is not None:
            self._drives.apply(self.data, self._step * float(self._model.opt.timestep))


@dataclass(frozen=True, eq=False)
class Flight:
    """The log of a flight, how long it took to simulate, and how it ended."""

    log: FlightLog
    wall_time: float
    """[s]"""
    diverged: bool
    """Whether it ended because state or inputs were no longer finite."""


def fly(
    scene: Scene,
    guide: Guide,
    actuation: Actuation,
    settings: RunSettings,
    advance: Callable[[float], None],
    drives: Drives | None = None,
) -> Flight:
    """Follow a guide in MuJoCo, with one audit a physics step.

    The flight ends when the guide says so, or when the state is no longer finite.

    Args:
        scene: the world and the body.
        guide: says what to follow.
        actuation: from reference and state to actuator inputs.
        settings: what disturbs it, the rate of control, and the seed.
        advance: told the simulated time that has passed [s].
        drives: what moves in the world.

    Raises:
        SceneError: the world's time step is too short for the flight to be recorded.
    """
    disturbance = settings.disturbance
    model = disturbed_model(scene.model, actuation.actuators, disturbance)
    dt = float(model.opt.timestep)
    steps = int(np.ceil(guide.longest / dt)) + 1
    if steps > _MOST_STEPS:
        raise SceneError(
            f"option timestep = {dt:g} s needs {steps:.3g} physics steps to fly this, more than "
            f"{_MOST_STEPS:,}; 0.002 s is usual"
        )
    rng = np.random.default_rng(settings.seed)
    wind = model.opt.wind + wind_at_steps(disturbance, steps, dt, rng)
    sensors = Sensors(disturbance, steps, dt, rng)
    every = settings.steps_between(dt)
    loop = ClosedLoop(scene, actuation, model, sensors, drives, every)
    data, body = loop.data, int(model.body(scene.body).id)
    recorder = Recorder(model, body)
    before = np.array(data.xpos[body])
    shown, diverged = 0.0, False
    began = time.perf_counter()
    for k in range(steps):
        now = k * dt
        reference = guide.reference(k, now, data)
        found = loop.control(reference)
        recorder.add(data, reference[0], *found)
        position = np.array(data.xpos[body])
        if k and guide.over(now, position, float(np.linalg.norm(position - before)) / dt):
            break
        before = position
        model.opt.wind = wind[k]
        diverged = not loop.advance()
        if diverged:
            break
        if now - shown > 0.1:
            advance(now - shown)
            shown = now
        if settings.real_time:
            time.sleep(max(0.0, began + now - time.perf_counter()))
    return Flight(recorder.log(), time.perf_counter() - began, diverged)


def _diverged(data: mujoco.MjData) -> bool:
    """Whether MuJoCo had to give up on the state (and reset the data) or on the inputs."""
    bad = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL,
           mujoco.mjtWarning.mjWARN_BADQACC, mujoco.mjtWarning.mjWARN_BADCTRL)  # fmt: skip
    return any(data.warning[int(kind)].number for kind in bad)
