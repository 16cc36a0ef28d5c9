"""The planner in the loop, in the bundled worlds that move and in small ones."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import exit_code

import hzmp_sim as hz
from hzmp_sim.replanning.pilot import Pilot

MOVING = ("crossing_traffic", "pendulum_gallery", "sliding_doors", "warehouse")

YARD = """
<mujoco><custom><numeric name="workspace" data="-4 -2 0 4 2 2"/></custom>
<worldbody>
  <geom name="north" type="box" size="4 .1 1" pos="0 2.1 1"/>
  <body name="gate" mocap="true" pos="0 0 1">
    <geom name="gate" type="box" size=".2 {half} 1"/>
  </body>
  <site name="start" pos="-3 0 1"/><site name="goal" pos="3 0 1"/>
</worldbody></mujoco>
"""


def yard(tmp_path: Path, *motions: hz.Motion, half: float = 0.5, **script: Any) -> hz.Scene:
    file = tmp_path / "yard.xml"
    file.write_text(YARD.format(half=half), encoding="utf-8")
    return hz.load_scene(
        file, body="point", motion=hz.MotionScript(motions=list(motions), **script)
    )


def fly(scene: hz.Scene, out: Path | None = None, **replanning: Any) -> hz.Run:
    settings = hz.RunSettings(video=False, replanning=hz.Replanning(**replanning))
    return hz.simulate(scene, out, settings)


def still(places: list[tuple[float, float, float]], times: list[float]) -> hz.Motion:
    return hz.Motion(body="gate", path=hz.Waypoints(times=times, positions=places))


@pytest.mark.parametrize("body", ["point", "quadrotor"])
@pytest.mark.parametrize("world", MOVING)
def test_worlds_that_move(world: str, body: str) -> None:
    run = fly(hz.load_scene(world, body=body), duration=60.0)
    m = run.metrics
    assert m["status"] == "goal_reached"
    assert m["collision_steps"] == 0
    assert m["min_clearance_m"] > 0.0
    assert m["containment_m"] <= 1e-9
    assert m["unproved_s"] == 0.0
    assert m["broken_predictions"] == []
    assert m["replans"] > 0
    assert run.trajectory is not None
    assert hz.audit(run.scene, run.log).holds  # type: ignore[arg-type]


def seeded(world: str, body: str, seed: int) -> hz.Scene:
    script = hz.load_scene(world, body=body).motion
    assert script is not None
    return hz.load_scene(world, body=body, motion=script.with_phases(seed))


def test_the_same_seed_gives_the_same_run_bit_for_bit() -> None:
    scene = seeded("crossing_traffic", "point", 4)
    one, two = fly(scene), fly(scene)
    assert one.log is not None
    assert two.log is not None
    for field in fields(one.log):
        mine, other = getattr(one.log, field.name), getattr(two.log, field.name)
        assert np.array_equal(mine, other, equal_nan=mine.dtype.kind == "f"), field.name
    assert one.flight_plan is not None
    assert two.flight_plan is not None
    for first, second in zip(one.flight_plan.records, two.flight_plan.records, strict=True):
        assert np.array_equal(first.waypoints, second.waypoints)
        assert (first.reason, first.taken, first.ends) == (second.reason, second.taken, second.ends)


@pytest.mark.parametrize("seed", [11, 12])
@pytest.mark.parametrize("world", MOVING)
def test_safe_in_worlds_of_other_phases(world: str, seed: int) -> None:
    m = fly(seeded(world, "point" if seed % 2 else "quadrotor", seed), duration=60.0).metrics
    assert m["status"] == "goal_reached"
    assert m["collision_steps"] == 0
    assert m["unproved_s"] == 0.0


def test_a_body_that_waits_on_a_wall_goes_on() -> None:
    """It waited at a corner of its leaf, 2 nm outside of the next cells."""
    m = fly(seeded("sliding_doors", "quadrotor", 4), duration=40.0).metrics
    assert m["status"] == "goal_reached"
    assert m["collision_steps"] == 0


@pytest.mark.parametrize("latency", [0.0, 0.02, 0.1, 0.3])
@pytest.mark.parametrize("world", ["crossing_traffic", "warehouse"])
def test_safe_at_any_latency(world: str, latency: float) -> None:
    m = fly(hz.load_scene(world, body="point"), latency=latency).metrics
    assert m["status"] == "goal_reached"
    assert m["collision_steps"] == 0
    assert m["unproved_s"] == 0.0


@pytest.mark.parametrize("failing", ["raises", "hangs"])
def test_a_planner_that_fails_in_flight(
    failing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    decide: Callable[..., Any] = Pilot.decide

    def fails(self: Pilot, effect: float, *rest: Any) -> Any:
        if effect < 1.0:
            return decide(self, effect, *rest)
        if failing == "hangs":
            time.sleep(5.0)
        raise RuntimeError("out of ideas")

    monkeypatch.setattr(Pilot, "decide", fails)
    scene = hz.load_scene("crossing_traffic", body="point")
    run = fly(scene, tmp_path / "run", patience=0.5)
    m = json.loads((tmp_path / "run" / "metrics.json").read_text(encoding="utf-8"))
    assert m["status"] == "goal_not_reached"
    assert m["collision_steps"] == 0
    told = "out of ideas" if failing == "raises" else "no answer within 0.5 s"
    assert told in m["planner_failure"]
    assert any("the planner failed" in warning for warning in m["warnings"])
    assert (tmp_path / "run" / "trajectory.parquet").is_file()
    assert run.log is not None
    assert np.linalg.norm(run.log.velocity[-1]) < 0.05


def test_a_door_that_stays_shut_is_waited_for(tmp_path: Path) -> None:
    scene = yard(tmp_path, still([(0.0, 0.0, 1.0)], [0.0]), half=2.0)
    run = fly(scene, duration=4.0)
    assert run.metrics["status"] == "goal_not_reached"
    assert run.metrics["collision_steps"] == 0
    assert run.metrics["waited_s"] > 0.5
    assert run.log is not None
    assert -1.5 < run.log.position[-1, 0] < -0.2  # near to the door


def test_a_door_that_opens_is_gone_through(tmp_path: Path) -> None:
    shut, gone = (0.0, 0.0, 1.0), (0.0, 0.0, 9.0)
    scene = yard(tmp_path, still([shut, shut, gone], [0.0, 4.0, 4.0]), half=2.0)
    m = fly(scene, duration=20.0).metrics
    assert m["status"] == "goal_reached"
    assert m["collision_steps"] == 0


def test_a_body_at_rest_gets_out_of_the_way(tmp_path: Path) -> None:
    far, near, gone = (3.5, 0.0, 1.0), (-3.5, 0.0, 1.0), (-3.5, 0.0, 9.0)
    ram = still([far, far, near, near, gone], [0.0, 1.0, 8.0, 8.5, 8.5])
    scene = yard(tmp_path, ram, half=1.4)
    run = fly(scene, duration=30.0)
    assert run.metrics["status"] == "goal_reached"
    assert run.metrics["collision_steps"] == 0


def test_a_contact_by_what_nobody_announced_is_explained(tmp_path: Path) -> None:
    """A gate as wide as the yard stands still, and then comes faster than the body can fly."""
    places = [(2.0, 0.0, 1.0), (2.0, 0.0, 1.0), (-3.5, 0.0, 1.0)]
    path = hz.Waypoints(times=[0.0, 1.5, 2.2], positions=places)
    scene = yard(tmp_path, hz.Motion(body="gate", path=path, announced=False), half=2.0)
    run = fly(scene, duration=4.0)
    m = run.metrics
    assert m["collision_steps"] > 0
    (contact,) = m["contacts"].values()
    assert not contact["predicted"]
    (broken,) = m["broken_predictions"]
    assert broken["geom"] == "gate"
    assert broken["held"] <= contact["first_s"]
    assert broken["time"] == pytest.approx(1.55, abs=0.051)
    assert any("gate was up to" in warning for warning in m["warnings"])


def test_what_goes_on_steadily_need_not_be_announced() -> None:
    script = hz.load_scene("crossing_traffic", body="point").motion
    assert script is not None
    motions = [replace(motion, announced=False) for motion in script.motions]
    scene = hz.load_scene("crossing_traffic", "point", motion=replace(script, motions=motions))
    m = fly(scene, duration=30.0).metrics
    assert m["status"] == "goal_reached"
    assert m["collision_steps"] == 0


def test_goals_in_a_row_and_a_change_in_flight(tmp_path: Path) -> None:
    goals = [hz.Goal(position=(3.0, 1.5), dwell=0.5), hz.Goal(position=(-3.0, 1.5), time=6.0)]
    run = fly(yard(tmp_path, goals=goals), duration=40.0)
    assert run.metrics["status"] == "goal_reached"
    assert run.log is not None
    assert np.linalg.norm(run.log.position[-1, :2] - [-3.0, 1.5]) < 0.05
    patrol = yard(tmp_path, goals=[hz.Goal(position=(-3.0, 1.5))], patrol=True, duration=20.0)
    m = fly(patrol).metrics
    assert m["goals_reached"] >= 3
    assert m["collision_steps"] == 0


def test_planning_from_rest_only_is_slower() -> None:
    times: dict[bool, list[float]] = {False: [], True: []}
    for world in MOVING:
        for from_rest, found in times.items():
            run = fly(seeded(world, "quadrotor", 3), from_rest=from_rest)
            assert run.log is not None
            assert run.metrics["status"] == "goal_reached"
            assert run.metrics["collision_steps"] == 0
            found.append(float(run.log.time[-1]))
    assert sum(times[False]) < 0.8 * sum(times[True])


def test_goals_of_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "yard.xml"
    file.write_text(YARD.format(half=0.5), encoding="utf-8")
    goals = ("--goal", "3", "1.5", "--goal", "-3", "-1.5")
    assert exit_code("run", str(file), *goals, "--no-video", "--out", str(tmp_path / "run")) == 0
    m = json.loads((tmp_path / "run" / "metrics.json").read_text(encoding="utf-8"))
    assert m["goals_reached"] == 2
    for last, told in (("9 9", "outside the workspace"), ("0 0", "inside an obstacle")):
        assert exit_code("run", str(file), "--goal", "3", "1.5", "--goal", *last.split()) == 2
        assert told in capsys.readouterr().err
    assert exit_code("run", str(file), "--goal") == 2
    assert exit_code("run", str(file), "--goal", "3", "here") == 2
    assert "--goal must be 2 or 3 numbers" in capsys.readouterr().err
