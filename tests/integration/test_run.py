"""The whole line: world, plan, trajectory, flight, audit, files."""

from __future__ import annotations

import dataclasses
import json
import math
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pyarrow.parquet as pq
import pytest

import hzmp_sim as hz
from hzmp_sim.simulation.metrics import EXIT_CODES
from hzmp_sim.simulation.slide_actuation import SlideActuation

DATA = Path(__file__).resolve().parents[1] / "data"
WORLDS = ("enclosure", "narrow_passage", "maze", str(DATA / "all_geoms.xml"))
CONTRACT_METRICS = {
    "status", "collision_steps", "min_clearance_m", "path_length_m", "path_lower_bound_m",
    "optimality_gap", "trajectory_duration_s", "containment_m", "tracking_error_max_m",
    "tracking_error_rms_m", "replans", "replan_latency_ms", "realtime_factor", "timings_s",
    "leaves", "faces", "obstacles", "seed", "versions",
}  # fmt: skip
STAGES = {"scene", "decompose", "graph", "plan", "time_parameterize", "simulate"}

CLOSED = """
<mujoco>
  <custom><numeric name="workspace" data="0 0 0  6 4 2"/></custom>
  <worldbody>
    <geom name="wall" type="box" pos="3 2 1" size="0.1 2.5 1.5"/>
    <site name="start" pos="1 2 1"/> <site name="goal" pos="5 2 1"/>
  </worldbody>
</mujoco>
"""


def command(*arguments: str, timeout: float = 300.0) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "hzmp_sim", *arguments],
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("closed") / "closed.xml"
    path.write_text(CLOSED)
    return str(path)


@pytest.mark.parametrize("body", ["point", "quadrotor"])
@pytest.mark.parametrize("world", WORLDS)
def test_flight_reaches_the_goal_as_proved(world: str, body: str) -> None:
    scene = hz.load_scene(world, body=body)
    run = hz.simulate(scene)
    m = run.metrics
    assert m["status"] == "goal_reached"
    assert m["collision_steps"] == 0
    assert m["containment_m"] <= 0.0
    assert 0.0 <= m["optimality_gap"] <= 1.1e-3
    assert m["path_lower_bound_m"] <= m["path_length_m"]
    assert m["tracking_error_max_m"] < (1e-3 if body == "point" else 2e-2)
    # What the planner calls free is free: clearance is short of what was planned by no more than
    # the body was off its reference.
    assert m["min_clearance_m"] >= scene.clearance - m["tracking_error_max_m"]
    assert hz.verify(run.plan).ok
    assert m.keys() >= CONTRACT_METRICS
    assert m["timings_s"].keys() >= STAGES


def test_the_flown_trajectory_is_the_planned_one() -> None:
    scene = hz.load_scene("enclosure", body="point")
    run = hz.simulate(scene)
    assert run.trajectory is not None
    assert run.log is not None
    flown = run.trajectory.sample(run.log.time).position
    assert np.allclose(run.log.reference[:, :2], flown)
    assert np.allclose(run.log.reference[0, :2], scene.start)
    assert math.dist(run.log.reference[-1, :2].tolist(), scene.goal.tolist()) < 1e-9
    ends = np.linalg.norm(np.diff(run.log.position, axis=0), axis=1)
    assert ends.sum() > run.plan.lower_bound - 0.5  # it really went all the way


def test_same_seed_same_flight() -> None:
    first, second = (hz.simulate(hz.load_scene("enclosure", body="quadrotor")) for _ in range(2))
    assert first.log is not None
    assert second.log is not None
    assert np.array_equal(first.log.qpos, second.log.qpos)
    assert np.array_equal(first.plan.waypoints, second.plan.waypoints)


def test_audit_sees_what_the_planner_was_not_told() -> None:
    """With its obstacles taken away the planner goes through the wall; the audit must say so."""
    scene = hz.load_scene("enclosure", body="point")
    blind = dataclasses.replace(scene, obstacles=(), obstacle_geoms=())
    run = hz.simulate(blind)
    assert run.metrics["status"] == "collision"
    assert run.metrics["collision_steps"] > 0
    assert EXIT_CODES[run.metrics["status"]] == 5


def test_clearance_of_the_audit_is_the_least_of_all_pairs() -> None:
    """The audit measures few pairs a step; a brute-force minimum must agree at every step."""
    scene = hz.load_scene(str(DATA / "all_geoms.xml"), body="quadrotor")
    run = hz.simulate(scene)
    assert run.log is not None
    data = mujoco.MjData(scene.model)
    for row in range(0, len(run.log.time), 97):
        data.qpos[:] = run.log.qpos[row]
        mujoco.mj_kinematics(scene.model, data)
        distances = [
            min(
                mujoco.mj_geomDistance(scene.model, data, mine, other, 100.0, None)
                for mine in scene.body_geoms
            )
            for other in scene.contact_geoms
        ]
        assert run.log.clearance[row] == pytest.approx(min(distances), abs=1e-6)
        nearest = scene.contact_geoms.index(int(run.log.nearest[row]))
        assert distances[nearest] == pytest.approx(min(distances), abs=1e-6)


@pytest.mark.render
@pytest.mark.slow
def test_demo_command_writes_a_whole_run_directory(tmp_path: Path) -> None:
    out = tmp_path / "run"
    done = command("run", "enclosure", "--body", "quadrotor", "--out", str(out), "--seed", "3")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""  # quiet when piped
    for line in ("goal reached", "report.html", "run.rrd", "run.mp4"):
        assert line in done.stdout
    names = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    assert names >= {
        "metrics.json", "trajectory.parquet", "run.rrd", "run.mp4", "report.html", "scene.xml",
    }  # fmt: skip
    assert any(name.startswith("figures/") for name in names)
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics.keys() >= CONTRACT_METRICS
    assert metrics["timings_s"]["record"] > 0.0
    assert metrics["seed"] == 3
    log = pq.read_table(out / "trajectory.parquet")
    assert log.num_rows == metrics["steps"]
    flown, first = hz.load_scene(out / "scene.xml"), hz.load_scene("enclosure", body="quadrotor")
    assert flown.body == "quadrotor"  # the one in the file, not another one attached
    assert flown.model.ngeom == first.model.ngeom
    assert np.allclose(flown.start, first.start)


def test_closed_room_is_proved_infeasible(closed: str, tmp_path: Path) -> None:
    out = tmp_path / "run"
    done = command("run", closed, "--body", "quadrotor", "--out", str(out))
    assert done.returncode == 3
    assert "proved" in done.stdout
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["status"] == "infeasible"
    assert metrics["path_length_m"] is None
    assert not (out / "run.mp4").exists()
    assert command("plan", closed).returncode == 3


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (("--start", "3", "2", "1"), ("start", "wall")),
        (("--goal", "50", "2", "1"), ("goal", "outside the workspace")),
        (("--start", "nan", "2", "1"), ("start", "finite")),
        (("--body", "robot"), ("robot", "quadrotor")),
        (("--seed", "-1"), ("seed",)),
        (("--start", "1"), ("start", "coordinates")),
        (("--workspace", "0", "0", "0", "1", "1"), ("workspace",)),
        (("--velocity", "0"), ("velocity",)),
        (("--bogus",), ("--bogus",)),
        (("--seed", "x"), ("seed", "int")),
        (("--clearance", "-0.1"), ("clearance",)),
        (("--out", "pyproject.toml"), ("pyproject.toml", "file")),
    ],
)
def test_bad_input_is_one_clear_line(
    closed: str, tmp_path: Path, arguments: tuple[str, ...], names: tuple[str, ...]
) -> None:
    where = () if "--out" in arguments else ("--out", str(tmp_path / "run"))
    done = command("run", closed, *arguments, *where)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1, done.stderr
    for name in names:
        assert name in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", ["<mujoco><worldbody><geom", "not xml", "", "<worlds/>"])
def test_broken_file_is_one_clear_line(tmp_path: Path, content: str) -> None:
    path = tmp_path / "broken.xml"
    path.write_text(content)
    done = command("inspect", str(path))
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert "broken.xml" in done.stderr


def test_ctrl_c_leaves_nothing(tmp_path: Path) -> None:
    out = tmp_path / "run"
    process = subprocess.Popen(
        [sys.executable, "-m", "hzmp_sim", "run", "maze", "--body", "quadrotor", "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Shells start background jobs with the signal ignored, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and not list(tmp_path.iterdir()):
        time.sleep(0.05)  # until the hidden folder shows that recording has begun
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60.0)
    assert process.returncode == 130
    assert len(said.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_output_that_nobody_reads_is_no_error() -> None:
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", "hzmp_sim", "inspect", "maze"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    process.stdout.close()
    process.stdout = None
    _, said = process.communicate(timeout=60.0)
    assert process.returncode == 141
    assert said == ""


def load(tmp_path: Path, world: str, body: str | None = None) -> hz.Scene:
    path = tmp_path / "world.xml"
    path.write_text(world)
    return hz.load_scene(path, body=body)


OPEN = """
<mujoco>
  {options}
  <custom><numeric name="workspace" data="-3 -3 0  3 3 2.5"/></custom>
  <worldbody>
    {geoms}
    <geom name="pillar" type="cylinder" pos="0 2 1" size="0.2 1"/>
    <site name="start" pos="-2 {y} 1"/> <site name="goal" pos="2 {y} 1"/>
  </worldbody>
</mujoco>
"""


def test_clearance_counts_what_lies_outside_the_workspace(tmp_path: Path) -> None:
    wall = '<geom name="wall" type="box" size="4 0.1 1" pos="0 -3.16 1"/>'
    scene = load(tmp_path, OPEN.format(options="", geoms=wall, y=-2.9), "point")
    assert "wall" not in {scene.geom_name(geom) for geom in scene.obstacle_geoms}
    run = hz.simulate(scene)
    assert run.log is not None
    assert run.metrics["min_clearance_m"] == pytest.approx(0.06, abs=1e-3)
    assert {scene.geom_name(int(geom)) for geom in run.log.nearest} == {"wall"}


def test_ground_is_no_obstacle_but_a_lintel_counts_as_clearance(tmp_path: Path) -> None:
    world = """
    <mujoco>
      <custom><numeric name="workspace" data="-3 -3 0  3 3 2"/></custom>
      <worldbody>
        <geom name="floor" type="plane" size="9 9 0.1"/>
        <geom name="lintel" type="box" pos="0 0 0.75" size="0.3 3 0.05"/>
        <body name="cart" pos="-2 0 0.25">
          <joint name="x" type="slide" axis="1 0 0" limited="true" range="-0.5 3.9"/>
          <joint name="y" type="slide" axis="0 1 0"/>
          <geom type="box" size="0.2 0.2 0.25" mass="2"/>
        </body>
        <site name="goal" pos="1.8 0 0.25"/>
      </worldbody>
      <actuator>
        <motor joint="x" ctrlrange="-20 20" gear="2"/> <motor joint="y" ctrlrange="-20 20"/>
      </actuator>
    </mujoco>
    """
    run = hz.simulate(load(tmp_path, world))
    assert run.metrics["status"] == "goal_reached"
    assert run.metrics["min_clearance_m"] == pytest.approx(0.2, abs=1e-3)
    with pytest.raises(hz.QueryError, match=r"goal \(2, 0\) is outside .* slide joints"):
        load(tmp_path, world.replace("1.8 0 0.25", "2.0 0 0.25"))


@pytest.mark.parametrize(
    "options", ['<option gravity="0 0 -3.7"/>', '<option gravity="0 0 -15"/>', ""]
)
def test_quadrotor_flies_in_the_gravity_of_the_world(tmp_path: Path, options: str) -> None:
    run = hz.simulate(load(tmp_path, OPEN.format(options=options, geoms="", y=0), "quadrotor"))
    assert run.metrics["status"] == "goal_reached"
    assert run.metrics["tracking_error_max_m"] < 0.02


@pytest.mark.parametrize(
    "options", ['<option><flag gravity="disable"/></option>', '<option gravity="0 0 0"/>']
)
def test_quadrotor_without_gravity_is_refused(tmp_path: Path, options: str) -> None:
    with pytest.raises(hz.SceneError, match="needs gravity"):
        hz.simulate(load(tmp_path, OPEN.format(options=options, geoms="", y=0), "quadrotor"))


def test_a_flight_beyond_its_clearance_is_warned_of(tmp_path: Path) -> None:
    scene = dataclasses.replace(
        load(tmp_path, OPEN.format(options="", geoms="", y=0), "quadrotor"), clearance=1e-3
    )
    run = hz.simulate(scene, settings=hz.RunSettings(velocity=2.0, acceleration=4.0, jerk=15.0))
    assert run.metrics["tracking_error_max_m"] > 1e-3
    assert any("off its reference" in text for text in run.metrics["warnings"])


def test_contacts_are_named(tmp_path: Path) -> None:
    scene = load(tmp_path, OPEN.format(options="", geoms="", y=2), "point")
    run = hz.simulate(dataclasses.replace(scene, obstacles=(), obstacle_geoms=()))
    assert run.metrics["status"] == "collision"
    assert run.metrics["contacts"].keys() == {"pillar"}
    hit = run.metrics["contacts"]["pillar"]
    assert hit["steps"] == run.metrics["collision_steps"]
    assert 0.0 < hit["first_s"] < run.metrics["trajectory_duration_s"]


def test_staying_where_it_is_is_a_flight_too(tmp_path: Path) -> None:
    arguments = ("--start", "1", "1", "--goal", "1", "1", "--no-video")
    done = command("run", "maze", *arguments, "--out", str(tmp_path / "run"))
    assert (done.returncode, done.stderr) == (0, "")


def test_inspect_and_plan_as_json() -> None:
    scene = json.loads(command("inspect", "maze", "--body", "point", "--json").stdout)
    assert scene["leaves"] > 0
    assert {geom["role"] for geom in scene["geoms"]} >= {"obstacle", "body", "beside"}
    done = command("plan", "narrow_passage", "--body", "quadrotor", "--json")
    assert done.returncode == 0
    plan = json.loads(done.stdout)
    assert plan["verified"]
    assert plan["lower_bound_m"] <= plan["cost_m"]
    assert plan["waypoints"][0] == plan["start"]
    wrong = command("plan", "maze", "--seed", "-1")
    assert wrong.returncode == 2
    assert len(wrong.stderr.splitlines()) == 1


def test_a_flight_that_blows_up_ends_with_data_and_a_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gentle = SlideActuation.apply

    def push(self: SlideActuation, data: mujoco.MjData, *told: Any) -> None:
        gentle(self, data, *told)
        if data.time > 0.5:
            data.qfrc_applied[:] = 1e12

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(SlideActuation, "apply", push)
    run = hz.simulate(hz.load_scene("enclosure", body="point"))
    assert run.log is not None
    assert 0.4 < run.log.time[-1] < 0.6
    assert np.isfinite(run.log.qpos).all()
    assert run.metrics["status"] in ("goal_not_reached", "collision")
    assert any("unstable" in text for text in run.metrics["warnings"])
    assert not list(tmp_path.iterdir())  # MuJoCo's own log file would be here
