"""metrics.json: what a script reads of a run."""

from __future__ import annotations

import math
import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Plan, PlanStatus, Verification
from hzmp_sim.replanning.records import FlightPlan
from hzmp_sim.run import FlightLog
from hzmp_sim.scene import Scene
from hzmp_sim.settings import RunSettings
from hzmp_sim.simulation.assumptions import assumption
from hzmp_sim.simulation.contacts import geom_contacts
from hzmp_tracking import RotorLimits, Trajectory
from hzmp_tracking.flatness import RotorUsage

EXIT_CODES = {
    "goal_reached": 0,
    "infeasible": 3,
    "time_limit": 4,
    "collision": 5,
    "goal_not_reached": 5,
}
"""Exit code of `hzmp-sim run` for each status; 2 is bad input."""

_UNPLANNED = FlightPlan()
_PACKAGES = ("mujoco", "numpy", "scipy", "clarabel", "ruckig", "rerun-sdk")


def collect_metrics(
    scene: Scene,
    space: FreeSpace,
    plan: Plan,
    verification: Verification,
    trajectory: Trajectory | None,
    log: FlightLog | None,
    flight_plan: FlightPlan | None = None,
    *,
    settings: RunSettings,
    simulated_per_wall: float | None,
    timings: dict[str, float],
    notes: Sequence[str],
    rotors: RotorLimits | None = None,
) -> dict[str, Any]:
    """The metrics of a run; what a run without flight does not have is None.

    `notes` are what MuJoCo warned of in flight, such as an unstable simulation, or what may be
    done about a way that is blocked. `rotors` is all that the rotors of the body have.
    """
    planned = flight_plan or _UNPLANNED
    error = None if log is None else log.tracking_error
    found = math.isfinite(plan.cost)
    usage = None if trajectory is None or rotors is None else rotors.usage(trajectory)
    return {
        "status": _status(scene, plan, log, flight_plan, settings.goal_tolerance),
        "collision_steps": 0 if log is None else int(log.collision.sum()),
        "contacts": {}
        if log is None
        else {contact.geom: contact.as_dict() for contact in geom_contacts(scene, log, planned)},
        "steps": 0 if log is None else len(log.time),
        "min_clearance_m": None if log is None else float(log.clearance.min()),
        "path_length_m": plan.cost if found else None,
        "path_lower_bound_m": plan.lower_bound if math.isfinite(plan.lower_bound) else None,
        "optimality_gap": plan.gap if found else None,
        "trajectory_duration_s": None if trajectory is None else trajectory.duration,
        "containment_m": None if trajectory is None else trajectory.containment,
        "tracking_error_max_m": None if error is None else float(error.max()),
        "tracking_error_rms_m": None if error is None else float(np.sqrt(np.mean(error**2))),
        "beyond_clearance_s": None if log is None else _longest_beyond(scene, log),
        "tilt_max_rad": None if log is None else float(log.tilt.max()),
        "tilt_reference_max_rad": None if usage is None else usage.demand.tilt,
        "thrust_usage": None if usage is None else usage.thrust,
        "body_rate_reference_max_rad_s": None if usage is None else usage.demand.body_rate,
        "body_rate_usage": None if usage is None else usage.body_rate,
        "goal_distance_m": None if log is None else _goal_distance(scene, log, flight_plan),
        **planned.metrics(0.0 if log is None else float(log.time[-1])),
        "broken_predictions": _broken(scene, planned, settings),
        "realtime_factor": simulated_per_wall,
        "timings_s": timings,
        "leaves": len(space),
        "faces": len(space.graph),
        "obstacles": len(scene.obstacles),
        "decomposed_meshes": [asdict(report) for report in scene.pieces],
        "dimension": scene.n,
        "query": {
            "start": scene.start.tolist(),
            "goal": scene.goal.tolist(),
            "workspace": [corner.tolist() for corner in scene.workspace],
            "clearance": scene.clearance,
            "tolerance": scene.tolerance,
            "shape": scene.shape.kind,
            "max_tilt": scene.shape.max_tilt,
        },
        "plan_status": plan.status.name.lower(),
        "plan_verified": verification.ok,
        "plan_residual_m": max(verification.residuals.values()),
        "body": scene.body,
        "body_shape": scene.shape.as_dict(),
        "seed": settings.seed,
        "disturbance": asdict(settings.disturbance),
        "disturbed_by": settings.disturbance.describe(),
        "warnings": [
            *scene.warnings,
            *notes,
            *_rotor_warnings(usage),
            *_flight_warnings(scene, log),
            *planned.warnings(),
        ],
        "versions": _versions(),
    }


def _broken(scene: Scene, flight_plan: FlightPlan, settings: RunSettings) -> list[dict[str, Any]]:
    """Each prediction that did not hold, with what had been assumed."""
    ids = {item.name: item.geom for item in scene.moving}
    return [
        vars(one) | {"assumed": assumption(scene, ids[one.geom], settings.replanning)}
        for one in flight_plan.broken
    ]


def _longest_beyond(scene: Scene, log: FlightLog) -> float:
    """Longest time in which the body was further off its reference than the clearance [s]."""
    off = np.concatenate([[False], log.tracking_error > scene.clearance, [False]])
    begins, ends = np.flatnonzero(off[1:] > off[:-1]), np.flatnonzero(off[1:] < off[:-1])
    step = float(log.time[1] - log.time[0]) if len(log.time) > 1 else 0.0
    return step * int((ends - begins).max(initial=0))


def _rotor_warnings(usage: RotorUsage | None) -> list[str]:
    """What the reference asks for that the rotors, or the body's shape, do not have."""
    if usage is None:
        return []
    shares = (("thrust", usage.thrust), ("tilt", usage.tilt), ("body rate", usage.body_rate))
    asked = [f"{100.0 * share:.1f} % of the {name}" for name, share in shares if share > 1.0]
    if not asked:
        return []
    return [f"the reference asks for {' and '.join(asked)} that the body has: lower the limits"]


def _flight_warnings(scene: Scene, log: FlightLog | None) -> list[str]:
    """What a flight that went well may still have got wrong."""
    if log is None:
        return []
    warnings = []
    error, limit = float(log.tracking_error.max()), scene.shape.max_tilt
    if error > scene.clearance:
        warnings.append(
            f"the body was up to {1e3 * error:.0f} mm off its reference, more than the clearance "
            f"of {1e3 * scene.clearance:.0f} mm covers: lower the limits or raise the clearance"
        )
    low, high = scene.workspace
    inside = log.position[:, : scene.n]
    outside = ((inside < low) | (inside > high)).any(axis=1)
    if outside.any():
        warnings.append(
            f"the body left the workspace after {log.time[outside.argmax()]:.3f} s: a controller "
            "that diverges does so, and so does a world that pushes too hard"
        )
    if limit is not None and log.tilt.max() > limit:
        warnings.append(
            f"the body tilted by up to {log.tilt.max():.3g} rad, beyond the {limit:.3g} that its "
            "shape is for: the proofs do not cover it there; lower the limits or raise --max-tilt"
        )
    return warnings


def _status(
    scene: Scene,
    plan: Plan,
    log: FlightLog | None,
    flight_plan: FlightPlan | None,
    goal_tolerance: float,
) -> str:
    if plan.status is PlanStatus.INFEASIBLE:
        return "infeasible"
    if log is None:
        return "time_limit"
    if log.collision.any():
        return "collision"
    if flight_plan is not None:
        return "goal_reached" if flight_plan.arrived else "goal_not_reached"
    return (
        "goal_reached" if _goal_distance(scene, log, None) <= goal_tolerance else "goal_not_reached"
    )


def _goal_distance(scene: Scene, log: FlightLog, flight_plan: FlightPlan | None) -> float:
    """To the goal, or to the last of several [m]."""
    goal = scene.goal if not (flight_plan and flight_plan.records) else flight_plan.records[-1].goal
    goal = scene.to_world(goal[None])[0]
    return float(np.linalg.norm(log.position[-1] - goal))


def _versions() -> dict[str, str]:
    versions = {"python": platform.python_version()}
    for name in ("hzmp-sim", *_PACKAGES):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions
