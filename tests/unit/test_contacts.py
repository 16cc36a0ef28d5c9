"""Contacts are explained by what had been believed, and time without a proof is counted."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import hzmp_sim as hz
from hzmp_sim.replanning.records import BrokenPrediction, FlightPlan, PlanRecord
from hzmp_sim.run import FlightLog
from hzmp_sim.simulation.assumptions import assumption
from hzmp_sim.simulation.contacts import GeomContact, geom_contacts

GOAL = np.array([1.0, 0.0])
RECORD = PlanRecord(
    time=0.0, effect=0.05, reason="onward", taken=True, proved=True, latency=0.01, goal=GOAL,
    cost=2.0, lower_bound=2.0, ends=1.0, conflict="", conflict_time=math.nan,
    waypoints=np.zeros((0, 2)),
)  # fmt: skip


def contact(world: str, name: str, first: float, planned: FlightPlan) -> GeomContact:
    """The contact with a geom from some time on, of a body that is 3 mm off its reference."""
    scene = hz.load_scene(world, body="point")
    time = np.arange(0.0, 6.0, 0.01)
    none, rows = np.zeros((len(time), 0)), np.zeros((len(time), 3))
    geom = scene.model.geom(name).id
    touched = time >= first - 1e-9
    log = FlightLog(
        time=time, qpos=none, mocap=np.zeros((len(time), 0, 7)), position=rows, quaternion=none,
        velocity=rows, reference=rows + np.array([0.003, 0.0, 0.0]), control=none,
        clearance=np.where(touched, -0.02, 0.1), nearest=np.full(len(time), geom),
        contact=np.where(touched, geom, -1),
    )  # fmt: skip
    (found,) = geom_contacts(scene, log, planned)
    assert found.geom == name
    assert found.first == pytest.approx(first)
    assert found.depth == pytest.approx(0.02)
    assert "3.0 mm off its reference" in found.explanation
    return found


def test_a_proof_ends_after_the_guard() -> None:
    planned = FlightPlan(records=(RECORD,), guard=2.0)
    held = contact("crossing_traffic", "car_1a", 2.0, planned)
    assert held.predicted
    assert "proved clear" in held.explanation
    late = contact("crossing_traffic", "car_1a", 4.0, planned)
    assert "proved until 3.00 s, and no plan came" in late.explanation
    failed = replace(planned, failure="at 2 s: out of ideas")
    assert "failed" in contact("crossing_traffic", "car_1a", 4.0, failed).explanation
    assert planned.metrics(4.0)["unproved_s"] == pytest.approx(1.0)
    assert planned.metrics(2.9)["unproved_s"] == 0.0
    # An answer that came too late proves nothing; one that comes later ends the gap.
    dropped = replace(RECORD, time=2.5, effect=2.6, reason="late", ends=9.0)
    again = replace(RECORD, time=3.5, effect=3.6, ends=3.7)
    more = replace(planned, records=(RECORD, dropped, again))
    assert more.metrics(5.0)["unproved_s"] == pytest.approx(0.6)
    assert more.in_effect(3.0) is RECORD
    assert more.in_effect(0.0) is None


def test_what_was_not_where_it_was_predicted() -> None:
    threat = replace(RECORD, effect=1.5, reason="threat", proved=False, conflict="car_1a")
    planned = FlightPlan(records=(RECORD, threat), guard=2.0)
    seen = BrokenPrediction("car_1a", time=1.4, error=0.5, held=1.35)
    before = contact("crossing_traffic", "car_1a", 2.0, replace(planned, broken=(seen,)))
    assert not before.predicted
    assert "since 1.40 s, by up to 0.5 m" in before.explanation
    assert "in conflict with car_1a" in before.explanation
    found = replace(seen, time=2.05, held=1.95)
    after = contact("crossing_traffic", "car_1a", 2.0, replace(planned, broken=(found,)))
    assert not after.predicted  # no contact pushes what a script moves
    later = replace(seen, time=3.0, held=2.5)
    assert contact("crossing_traffic", "car_1a", 2.0, replace(planned, broken=(later,))).predicted
    bob = BrokenPrediction("bob_2", time=2.05, error=0.5, held=1.95)
    pushed = contact("pendulum_gallery", "bob_2", 2.0, replace(planned, broken=(bob,)))
    assert pushed.predicted
    assert "perhaps since it was pushed" in pushed.explanation


def test_what_stands_still() -> None:
    found = contact("sliding_doors", "wall_a_left", 2.0, FlightPlan(records=(RECORD,)))
    assert found.predicted
    assert "stands still" in found.explanation


def test_what_is_assumed_of_each_thing_that_moves() -> None:
    loop = hz.Replanning()
    doors = hz.load_scene("sliding_doors", body="point")
    ids = {item.name: item.geom for item in doors.moving}
    assert assumption(doors, ids["door_a"], loop) == "body 'door_a' moves as announced"
    assert "gets the input" in assumption(doors, ids["door_c"], loop)
    assert doors.motion is not None
    secret = [replace(motion, announced=False) for motion in doors.motion.motions]
    unknown = replace(doors, motion=replace(doors.motion, motions=secret))
    assert "is not announced" in assumption(unknown, ids["door_b"], loop)
    gallery = hz.load_scene("pendulum_gallery", body="point")
    bob = next(item.geom for item in gallery.moving if item.name == "bob_2")
    assert "MuJoCo's dynamics" in assumption(gallery, bob, loop)
