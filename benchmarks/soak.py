"""Millions of physics steps without a break: a patrol from start to goal and back, again and again.

One simulation that is never reset, under the same loop of control and audit as every flight. What
drifts shows as a tracking error that grows from window to window, or as an energy that is no longer
what it was at the same place of the first lap; what leaks shows as memory. A state that is not
finite ends the patrol.

    python benchmarks/soak.py --steps 10_000_000
"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import NamedTuple

import cyclopts
import mujoco
import numpy as np

import hzmp_sim as hz
from hzmp_sim.replanning.flown import resting
from hzmp_sim.simulation.actuation import actuation_for
from hzmp_sim.simulation.disturbance import Sensors
from hzmp_sim.simulation.guide import reference_rows
from hzmp_sim.simulation.loop import ClosedLoop

_PAUSE = 0.5  # [s] at either end, in which the body comes to rest


class Window(NamedTuple):
    """Some consecutive steps of a patrol."""

    error: float
    """Largest distance of the body to its reference [m]."""
    energy: float
    """Mechanical energy a quarter into a lap, in motion: largest difference to the first [J]."""
    clearance: float
    """Least [m]."""
    contacts: int
    """Steps in penetrating contact."""
    memory: float
    """Resident at the end [MB]."""
    spent: float
    """CPU time [s]."""


class Patrol(NamedTuple):
    """What came of it."""

    steps: int
    """Done: fewer than asked for when the state was no longer finite."""
    laps: int
    windows: tuple[Window, ...]


def patrol(world: str, body: str, steps: int, window: int) -> Patrol:
    """Fly from start to goal and back until so many physics steps are done.

    Args:
        world: MJCF file, or the name of a bundled world.
        body: that flies.
        steps: physics steps in all.
        window: physics steps of each window of the report.
    """
    scene = hz.load_scene(world, body=body)
    actuation = actuation_for(scene.model, scene.body)
    lap = _lap(scene, actuation.default_limits)
    model, dt = scene.model, float(scene.model.opt.timestep)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    times = dt * np.arange(round(lap.duration / dt) + 1, dtype=np.float64)
    reference = reference_rows(scene, lap, times, actuation.smoothing)
    turns = len(times) - 1
    sensors = Sensors(hz.Disturbance(), 0, dt, np.random.default_rng(0))
    loop = ClosedLoop(scene, actuation, model, sensors)
    centre, data = model.body(scene.body).id, loop.data
    windows: list[Window] = []
    usual: float | None = None
    done, finite = 0, True
    while done < steps and finite:
        largest, energy, clearance, contacts = 0.0, 0.0, np.inf, 0
        began, until = time.process_time(), min(done + window, steps)
        while done < until and finite:
            k = done % turns
            free, _, touched = loop.control(reference[k])
            off = data.xpos[centre] - reference[k][0]
            square = float(off @ off)
            largest, clearance = max(largest, square), min(clearance, free)
            contacts += touched >= 0
            finite = loop.advance() and math.isfinite(square)
            if k == turns // 4:
                now = float(data.energy.sum())
                usual = now if usual is None else usual
                energy = max(energy, abs(now - usual))
            done += finite
        spent = time.process_time() - began
        windows.append(Window(largest**0.5, energy, clearance, contacts, _resident(), spent))
    return Patrol(done, done // turns, tuple(windows))


def _lap(scene: hz.Scene, limits: hz.Limits) -> hz.Trajectory:
    """From start to goal and back, with a pause at either end."""
    space = scene.free_space()
    plan = hz.plan(space, scene.start, scene.goal)
    points, cells = plan.waypoints, plan.cells(space)
    there = hz.time_parameterize(points, cells, limits)
    back = hz.time_parameterize(points[::-1], cells[::-1], limits)
    return hz.Trajectory.join([there, _rest(there, _PAUSE), back, _rest(back, _PAUSE)])


def _rest(after: hz.Trajectory, pause: float) -> hz.Trajectory:
    """A stay at the end of a trajectory."""
    end = after.sample([after.duration]).position[0]
    return resting(end, after.cells[-1], after.limits, pause)


def _resident() -> float:
    """Memory of this process that is in RAM now [MB]; nan where Linux does not say."""
    status = Path("/proc/self/status")
    if not status.exists():
        return float("nan")
    line = next(line for line in status.read_text().splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024.0


def main(*, world: str = "maze", steps: int = 10_000_000, window: int = 1_000_000) -> None:
    """Print a Markdown table: the first and the last window of each body's patrol.

    Args:
        world: MJCF file, or the name of a bundled world.
        steps: physics steps of each body.
        window: physics steps of a window.
    """
    columns = (
        "body", "steps", "laps", "largest error, first [mm]", "last [mm]",
        "energy off by, first [uJ]", "last [uJ]", "least clearance [mm]", "contacts",
        "memory, first [MB]", "last [MB]", "steps a second of CPU",
    )  # fmt: skip
    print("| " + " | ".join(columns) + " |")
    print("|---" * len(columns) + "|")
    for body in ("point", "quadrotor"):
        done = patrol(world, body, steps, window)
        first, last = done.windows[0], done.windows[-1]
        rate = done.steps / sum(part.spent for part in done.windows)
        print(
            f"| {body} | {done.steps:,} | {done.laps:,} | {1e3 * first.error:.4f} | "
            f"{1e3 * last.error:.4f} | {1e6 * first.energy:.3g} | {1e6 * last.energy:.3g} | "
            f"{1e3 * min(part.clearance for part in done.windows):.1f} | "
            f"{sum(part.contacts for part in done.windows)} | {first.memory:.0f} | "
            f"{last.memory:.0f} | {rate:,.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    cyclopts.run(main)
