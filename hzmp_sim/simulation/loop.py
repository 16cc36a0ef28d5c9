"""The closed loop: reference, controller, physics, audit, log."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_sim.run import FlightLog
from hzmp_sim.scene import Scene
from hzmp_sim.settings import RunSettings
from hzmp_sim.simulation.actuation_base import Actuation
from hzmp_sim.simulation.contact_audit import ContactAudit
from hzmp_sim.simulation.disturbance import Sensors, disturbed_model, wind_at_steps
from hzmp_tracking import Trajectory

_MOST_STEPS = 20_000_000  # of a flight: what it logs of them takes some GB
_AT_REST = 0.05  # [m/s] a body slower than this has settled


class ClosedLoop:
    """A body under control in MuJoCo, one control and one audit a physics step.

    Args:
        scene: the world and the body.
        actuation: from reference and state to actuator inputs.
        model: the scene's, or a disturbed copy of it.
        sensors: what is measured of the body.
    """

    def __init__(
        self, scene: Scene, actuation: Actuation, model: mujoco.MjModel, sensors: Sensors
    ) -> None:
        self.data = mujoco.MjData(model)
        self.data.qpos[:] = scene.initial_qpos
        mujoco.mj_forward(model, self.data)
        actuation.trim(self.data)
        mujoco.mj_forward(model, self.data)
        self._model, self._actuation, self._sensors = model, actuation, sensors
        self._audit = ContactAudit(scene, self.data)

    def control(self, reference: Sequence[Sequence[float]]) -> tuple[float, int, int]:
        """Set the inputs for a reference (position to jerk, each (3,)), and audit the state.

        Returns:
            Clearance [m], geom at that distance, geom in penetrating contact; -1 where none.
        """
        found = self._audit.step()
        measured = self._sensors.measure(self._actuation.state(self.data))
        self._actuation.apply(self.data, measured, *reference)
        return found

    def advance(self) -> bool:
        """One physics step; False when state or inputs are no longer finite."""
        mujoco.mj_step(self._model, self.data)
        # mj_step leaves contacts and poses of the state before it: bring them up to date.
        mujoco.mj_fwdPosition(self._model, self.data)
        return not _diverged(self.data)


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
    trajectory: Trajectory,
    actuation: Actuation,
    settings: RunSettings,
    advance: Callable[[float], None],
) -> Flight:
    """Track the trajectory in MuJoCo and log every physics step.

    The flight ends when the trajectory is over and the body rests at the goal, at the latest
    `settle_time` after the trajectory; earlier when state or inputs are no longer finite.

    Args:
        scene: the world and the body.
        trajectory: reference of the body's centre, in the scene's dimension.
        actuation: from reference and state to actuator inputs.
        settings: when it has arrived, what disturbs it, and the seed.
        advance: told the simulated time that has passed [s].

    Raises:
        SceneError: the world's time step is too short for the flight to be recorded.
    """
    disturbance = settings.disturbance
    model = disturbed_model(scene.model, actuation.actuators, disturbance)
    dt = float(model.opt.timestep)
    steps = int(np.ceil((trajectory.duration + settings.settle_time) / dt)) + 1
    if steps > _MOST_STEPS:
        raise SceneError(
            f"option timestep = {dt:g} s needs {steps:.3g} physics steps to fly this, more than "
            f"{_MOST_STEPS:,}; 0.002 s is usual"
        )
    times: Floats = dt * np.arange(steps, dtype=np.float64)
    reference = WorldReference(scene, trajectory, times)
    rng = np.random.default_rng(settings.seed)
    wind = model.opt.wind + wind_at_steps(disturbance, steps, dt, rng)
    loop = ClosedLoop(scene, actuation, model, Sensors(disturbance, steps, dt, rng))
    data, body = loop.data, int(model.body(scene.body).id)
    states = np.empty((steps, model.nq + 7 + model.nu))
    clearance, nearest = np.empty(steps), np.empty(steps, dtype=np.int64)
    contact = np.empty(steps, dtype=np.int64)
    goal = reference.positions[-1]
    rows, shown, diverged = 0, 0.0, False
    began = time.perf_counter()
    for k in range(steps):
        clearance[k], nearest[k], contact[k] = loop.control(reference.at(k))
        states[k] = np.concatenate([data.qpos, data.xpos[body], data.xquat[body], data.ctrl])
        rows = k + 1
        over = times[k] >= trajectory.duration
        if over and k and np.linalg.norm(data.xpos[body] - goal) <= settings.goal_tolerance:
            moved = np.linalg.norm(states[k, model.nq :][:3] - states[k - 1, model.nq :][:3])
            if moved <= _AT_REST * dt:
                break
        model.opt.wind = wind[k]
        diverged = not loop.advance()
        if diverged:
            break
        if times[k] - shown > 0.1:
            advance(float(times[k]) - shown)
            shown = float(times[k])
    wall_time = time.perf_counter() - began
    columns = np.split(states[:rows], np.cumsum([model.nq, 3, 4]), axis=1)
    qpos, position, quaternion, control = columns
    log = FlightLog(
        time=times[:rows],
        qpos=qpos,
        position=position,
        quaternion=quaternion,
        velocity=_rate(position, dt),
        reference=reference.positions[:rows],
        control=control,
        clearance=clearance[:rows],
        nearest=nearest[:rows],
        contact=contact[:rows],
    )
    return Flight(log, wall_time, diverged)


class WorldReference:
    """The trajectory at every step, lifted to the world: lists, which controllers take fastest."""

    def __init__(self, scene: Scene, trajectory: Trajectory, times: Floats) -> None:
        sample = trajectory.sample(times)
        self.positions = scene.to_world(sample.position)
        rates = [np.zeros((len(times), 3)) for _ in range(3)]
        for rate, values in zip(
            rates, (sample.velocity, sample.acceleration, sample.jerk), strict=True
        ):
            rate[:, : scene.n] = values
        self._rows = [part.tolist() for part in (self.positions, *rates)]

    def at(self, k: int) -> list[list[float]]:
        """Position, velocity, acceleration and jerk at step k."""
        return [part[k] for part in self._rows]


def _diverged(data: mujoco.MjData) -> bool:
    """Whether MuJoCo had to give up on the state (and reset the data) or on the inputs."""
    bad = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL,
           mujoco.mjtWarning.mjWARN_BADQACC, mujoco.mjtWarning.mjWARN_BADCTRL)  # fmt: skip
    return any(data.warning[int(kind)].number for kind in bad)


def _rate(position: Floats, dt: float) -> Floats:
    """Velocity from positions by central differences, shape (T, 3)."""
    if len(position) < 2:
        return np.zeros_like(position)
    return np.asarray(np.gradient(position, dt, axis=0))
