"""Contacts of a flight: counted, and explained by what the planner had believed of each geom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hzmp_sim.replanning.records import BrokenPrediction, FlightPlan
from hzmp_sim.run import FlightLog
from hzmp_sim.scene import Scene
from hzmp_sim.scene.bodies import carriers


@dataclass(frozen=True)
class GeomContact:
    """A geom that the body penetrated."""

    geom: str
    steps: int
    """Physics steps in contact."""
    first: float
    """When first [s]."""
    depth: float
    """How deep at most [m]."""
    predicted: bool
    """Whether it was where the planner believed it to be, until then."""
    explanation: str
    """What the planner had believed, and what of it did not hold."""

    def as_dict(self) -> dict[str, Any]:
        """What metrics.json says of it, under the name of the geom."""
        return {
            "steps": self.steps,
            "first_s": self.first,
            "depth_m": self.depth,
            "predicted": self.predicted,
            "explanation": self.explanation,
        }


def geom_contacts(scene: Scene, log: FlightLog, planned: FlightPlan) -> list[GeomContact]:
    """The contacts of a flight, a geom each, in order.

    Args:
        scene: the world.
        log: of the flight.
        planned: what was planned in flight; nothing, where nothing moves.
    """
    return [
        _contact(scene, log, planned, geom)
        for geom in dict.fromkeys(log.contact[log.collision].tolist())
    ]


def _contact(scene: Scene, log: FlightLog, planned: FlightPlan, geom: int) -> GeomContact:
    rows = np.flatnonzero(log.contact == geom)
    name, first = scene.geom_name(geom), float(log.time[rows[0]])
    report = next(report for report in scene.geoms if report.geom == geom)
    seen = next((one for one in planned.broken if one.geom == name), None)
    broken = seen if seen is not None and seen.held < first else None
    # A script moves mocap bodies, whatever they meet: no contact pushes them.
    pushed = broken is not None and broken.time > first and _gives_way(scene, geom)
    if report.role == "moving":
        belief = f"{_place(broken, first, pushed=pushed)}; {_flown(planned, first)}"
    elif report.role == "obstacle":
        belief = "it stands still, and the reference is proved clear of it"
    else:
        belief = f"it was not planned for: {report.reason}"
    off, covered = 1e3 * float(log.tracking_error[rows[0]]), 1e3 * scene.clearance
    return GeomContact(
        geom=name,
        steps=len(rows),
        first=first,
        depth=max(0.0, -float(log.clearance[rows].min())),
        predicted=broken is None or pushed,
        explanation=f"{belief}; the body was {off:.1f} mm off its reference, and the clearance "
        f"covers {covered:.0f} mm",
    )


def _place(broken: BrokenPrediction | None, first: float, *, pushed: bool) -> str:
    """Whether a geom was where it was predicted when it was first touched [s]."""
    if broken is None:
        return "it was where it had been predicted"
    error = f"by up to {broken.error:.3g} m"
    if broken.time <= first:
        return f"it had not been where it was predicted since {broken.time:.2f} s, {error}"
    found = f"when next looked at, at {broken.time:.2f} s, it was not where it was predicted"
    return f"{found}, {error}" + (", perhaps since it was pushed" if pushed else "")


def _flown(planned: FlightPlan, time: float) -> str:
    """What is known of the trajectory flown at a time [s]."""
    last = planned.in_effect(time)
    if last is None:
        return "nothing was planned yet"
    if last.proved and time <= planned.proved_until(last):
        return "the trajectory flown was proved clear of it, as predicted"
    if last.proved:
        until = f"the trajectory flown was proved until {planned.proved_until(last):.2f} s"
        return f"{until}, and {'the planner had failed' if planned.failure else 'no plan came'}"
    found = f", but in conflict with {last.conflict}" if last.conflict else ""
    return f"the trajectory flown was not proved clear{found}"


def _gives_way(scene: Scene, geom: int) -> bool:
    """Whether a geom hangs from joints."""
    model = scene.model
    bodies = carriers(model, int(model.geom_bodyid[geom]))
    return any(int(model.body_dofnum[body]) for body in bodies)
