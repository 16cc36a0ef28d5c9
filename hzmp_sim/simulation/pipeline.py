"""One run: decompose, plan, time, fly, audit, record."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hzmp_planners.planning import PlanStatus, plan, verify
from hzmp_sim.mujoco_warnings import mujoco_warnings
from hzmp_sim.output.artifacts import check_directory
from hzmp_sim.progress import busy, progress
from hzmp_sim.replanning import FlightPlan, replanning_guide
from hzmp_sim.run import Run
from hzmp_sim.scene import Scene
from hzmp_sim.scene.blame import blocking_hulls
from hzmp_sim.settings import RunSettings
from hzmp_sim.simulation.actuation import actuation_for
from hzmp_sim.simulation.actuation_base import Actuation
from hzmp_sim.simulation.guide import FixedGuide, Guide
from hzmp_sim.simulation.loop import Drives, Flight, fly
from hzmp_sim.simulation.metrics import collect_metrics
from hzmp_sim.simulation.own_controller import OwnActuation
from hzmp_tracking import Controller, Trajectory, time_parameterize

_DEFAULTS = RunSettings()


def simulate(
    scene: Scene,
    out: str | Path | None = None,
    settings: RunSettings = _DEFAULTS,
    *,
    controller: Controller | None = None,
    command: str = "",
) -> Run:
    """Plan through a scene, fly the plan in closed loop in MuJoCo, and write the run directory.

    Args:
        scene: from `load_scene`.
        out: run directory; nothing is written when None.
        settings: how to plan, fly and record.
        controller: flies instead of the law that comes with the body; its commands are the inputs
            (`data.ctrl`) of the model's actuators in their order. With it any body can be flown
            that can be planned for, also on an upright hinge.
        command: for the report: how to make this run again.

    Returns:
        The run. `run.metrics["status"]` says how it ended; `trajectory` and `log` are None when no
        path was found.

    Raises:
        QueryError: start or goal is not in the free space.
        SceneError: the body has joints or actuators that no controller here can use.
        QueryError: `controller` gives another number of commands than there are actuators.
        OutputError: the run directory cannot be written.
    """
    if out is not None:
        check_directory(out)  # before the work, not after it
    timings = {"scene": scene.reading_time}
    actuation = (
        actuation_for(scene.model, scene.body, scene.shape.max_tilt)
        if controller is None
        else OwnActuation(scene.model, scene.body, controller)
    )
    with _timed(timings, "decompose"), busy("Decomposing the free space"):
        space = scene.free_space()
    with _timed(timings, "graph"), busy("Finding shared faces"):
        _ = space.graph
    with _timed(timings, "plan"), busy("Planning"):
        path = plan(
            space,
            scene.start,
            scene.goal,
            time_limit=settings.time_limit,
            gap=settings.gap,
            seed=settings.seed,
        )
    with _timed(timings, "verify"), busy("Verifying the plan"):
        verification = verify(path)
    trajectory: Trajectory | None = None
    flight: Flight | None = None
    planned: FlightPlan | None = None
    notes: list[str] = []
    if path.status is PlanStatus.INFEASIBLE:
        notes = [reason for reason in [blocking_hulls(scene, space)] if reason]
    if math.isfinite(path.cost):
        limits = settings.limits(actuation.default_limits)
        if scene.replans:
            with _timed(timings, "simulate"), mujoco_warnings() as notes:
                replanner, drives = replanning_guide(scene, space, actuation, settings)
                duration = settings.replanning.duration
                flight = _fly(scene, replanner, actuation, settings, duration, drives)
            trajectory, planned = replanner.flown(), replanner.result()
        else:
            with _timed(timings, "time_parameterize"), busy("Timing the path"):
                trajectory = time_parameterize(path.waypoints, path.cells(space), limits)
            guide = FixedGuide(scene, trajectory, settings, actuation.smoothing)
            with _timed(timings, "simulate"), mujoco_warnings() as notes:
                flight = _fly(scene, guide, actuation, settings, trajectory.duration)
        if flight.diverged:
            notes.insert(
                0,
                f"the flight ended after {flight.log.time[-1]:.3f} s: a state or an input was no "
                "longer finite, as when a controller is unstable",
            )
    run = Run(
        scene=scene,
        space=space,
        plan=path,
        trajectory=trajectory,
        log=flight.log if flight else None,
        metrics=collect_metrics(
            scene,
            space,
            path,
            verification,
            trajectory,
            flight.log if flight else None,
            planned,
            settings=settings,
            simulated_per_wall=_speed(flight),
            timings=timings,
            notes=notes,
            rotors=actuation.rotors,
        ),
        flight_plan=planned,
    )
    if out is not None:
        # Imported here: a run without files needs neither rerun nor matplotlib.
        from hzmp_sim.output.write import write_run

        write_run(run, out, video=settings.video, command=command)
    return run


def _fly(
    scene: Scene,
    guide: Guide,
    actuation: Actuation,
    settings: RunSettings,
    duration: float,
    drives: Drives | None = None,
) -> Flight:
    with progress("Flying", duration) as advance:
        return fly(scene, guide, actuation, settings, advance, drives)


def _speed(flight: Flight | None) -> float | None:
    """Simulated seconds a second of computing."""
    if flight is None:
        return None
    simulated = float(flight.log.time[-1])
    return simulated / flight.wall_time


@contextmanager
def _timed(timings: dict[str, float], stage: str) -> Iterator[None]:
    began = time.perf_counter()
    yield
    timings[stage] = time.perf_counter() - began
