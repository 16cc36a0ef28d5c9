"""The closed loop: reference, controller, physics, audit, log."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_sim.run import FlightLog
from hzmp_sim.scene import Scene
from hzmp_sim.settings import RunSettings
from hzmp_sim.simulation.actuation import Actuation
from hzmp_sim.simulation.contact_audit import ContactAudit
from hzmp_sim.simulation.disturbance import Sensors, disturbed_model, wind_at_steps
from hzmp_tracking import Trajectory
from hzmp_tracking.smoothing import smooth_sample

_MOST_STEPS = 20_000_000  # of a flight: what it logs of them takes some GB
_AT_REST = 0.05  # [m/s] a body slower than this has settled


@dataclass(frozen=True, eq=False)
class Flight:
    """The log of a flight and how long it took to simulate."""

    log: FlightLog
    wall_time: float
    """[s]"""


def fly(
    scene: Scene,
    trajectory: Trajectory,
    actuation: Actuation,
    settings: RunSettings,
    advance: Callable[[float], None],
) -> Flight:
    """Track the trajectory in MuJoCo, one control and one audit a physics step.

    The flight ends when the trajectory is over and the body rests at the goal, at the latest
    `settle_time` after the trajectory; earlier when the state is no longer finite.

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
    data = mujoco.MjData(model)
    data.qpos[:] = scene.initial_qpos
    mujoco.mj_forward(model, data)
    dt = float(model.opt.timestep)
    steps = int(np.ceil((trajectory.duration + settings.settle_time) / dt)) + 1
    if steps > _MOST_STEPS:
        raise SceneError(
            f"option timestep = {dt:g} s needs {steps:.3g} physics steps to fly this, more than "
            f"{_MOST_STEPS:,}; 0.002 s is usual"
        )
    times: Floats = dt * np.arange(steps, dtype=np.float64)
    reference = _Reference(scene, trajectory, times, actuation.smoothing)
    actuation.trim(data)
    mujoco.mj_forward(model, data)
    rng = np.random.default_rng(settings.seed)
    wind = model.opt.wind + wind_at_steps(disturbance, steps, dt, rng)
    sensors = Sensors(disturbance, steps, dt, rng)
    audit = ContactAudit(scene, data)
    body = int(model.body(scene.body).id)
    states = np.empty((steps, model.nq + 7 + model.nu))
    clearance, nearest = np.empty(steps), np.empty(steps, dtype=np.int64)
    contact = np.empty(steps, dtype=np.int64)
    goal = reference.positions[-1]
    rows, shown = 0, 0.0
    began = time.perf_counter()
    for k in range(steps):
        clearance[k], nearest[k], contact[k] = audit.step()
        actuation.apply(data, sensors.measure(actuation.state(data)), *reference.at(k))
        states[k] = np.concatenate([data.qpos, data.xpos[body], data.xquat[body], data.ctrl])
        rows = k + 1
        over = times[k] >= trajectory.duration
        if over and k and np.linalg.norm(data.xpos[body] - goal) <= settings.goal_tolerance:
            moved = np.linalg.norm(states[k, model.nq :][:3] - states[k - 1, model.nq :][:3])
            if moved <= _AT_REST * dt:
                break
        model.opt.wind = wind[k]
        mujoco.mj_step(model, data)
        # mj_step leaves contacts and poses of the state before it: bring them up to date.
        mujoco.mj_fwdPosition(model, data)
        if _diverged(data):
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
    return Flight(log, wall_time)


class _Reference:
    """The trajectory at every step, lifted to the world: lists, which controllers take fastest."""

    def __init__(
        self, scene: Scene, trajectory: Trajectory, times: Floats, smoothing: float
    ) -> None:
        positions, *derivatives = smooth_sample(trajectory, times, smoothing)
        self.positions = scene.to_world(positions)
        rates = [np.zeros((len(times), 3)) for _ in derivatives]
        for rate, values in zip(rates, derivatives, strict=True):
            rate[:, : scene.n] = values
        self._rows = [part.tolist() for part in (self.positions, *rates)]

    def at(self, k: int) -> list[list[float]]:
        """Position, velocity, acceleration, jerk and snap at step k."""
        return [part[k] for part in self._rows]


def _diverged(data: mujoco.MjData) -> bool:
    """Whether MuJoCo had to give up on the state (it resets the data when it does)."""
    bad = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL,
           mujoco.mjtWarning.mjWARN_BADQACC)  # fmt: skip
    return any(data.warning[int(kind)].number for kind in bad)


def _rate(position: Floats, dt: float) -> Floats:
    """Velocity from positions by central differences, shape (T, 3)."""
    if len(position) < 2:
        return np.zeros_like(position)
    return np.asarray(np.gradient(position, dt, axis=0))
