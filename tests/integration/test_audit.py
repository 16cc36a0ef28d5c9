"""The audit of paths, trajectories and runs: MuJoCo's distances against what was promised."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from command_line import exit_code

import hzmp_sim as hz
from hzmp_sim.output.artifacts import to_json
from hzmp_sim.output.parquet import write_log

WORLD = str(Path(__file__).resolve().parents[1] / "data" / "all_geoms.xml")


@pytest.fixture(scope="module")
def flown() -> hz.Run:
    """A quadrotor among every geom type, tilting as it goes."""
    return hz.simulate(hz.load_scene(WORLD, body="quadrotor"))


@pytest.fixture
def run_dir(flown: hz.Run, tmp_path: Path) -> Path:
    """What the audit reads of a run directory."""
    assert flown.log is not None
    (tmp_path / "scene.xml").write_text(flown.scene.xml)
    (tmp_path / "metrics.json").write_text(to_json(flown.metrics))
    write_log(flown.log, flown.scene, tmp_path / "trajectory.parquet")
    return tmp_path


def audit_command(
    directory: Path, capsys: pytest.CaptureFixture[str], *more: str
) -> tuple[int, str, str]:
    code = exit_code("audit", str(directory), *more)
    said = capsys.readouterr()
    return code, said.out, said.err


def brute_force(scene: hz.Scene, qpos: Any, other: int) -> float:
    data = mujoco.MjData(scene.model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(scene.model, data)
    return min(
        mujoco.mj_geomDistance(scene.model, data, mine, other, 100.0, None)
        for mine in scene.body_geoms
    )


def test_flight_is_measured_as_in_the_loop(flown: hz.Run) -> None:
    assert flown.log is not None
    found = hz.audit(flown.scene, flown.log)
    assert found.clearance == pytest.approx(flown.metrics["min_clearance_m"], abs=1e-9)
    assert (found.unit, found.poses) == ("s", len(flown.log.time))
    assert found.holds
    assert found.agrees
    assert {row.geom for row in found.obstacles} == set(flown.scene.contact_geoms)
    assert [row.clearance for row in found.obstacles] == sorted(
        row.clearance for row in found.obstacles
    )
    for row in found.obstacles:  # where it is said to be least, it is that
        k = int(np.flatnonzero(flown.log.time == row.progress)[0])
        assert row.position == tuple(flown.log.position[k])
        assert brute_force(flown.scene, flown.log.qpos[k], row.geom) == pytest.approx(
            row.clearance, abs=1e-6
        )


def test_least_clearance_is_that_of_every_pose(flown: hz.Run) -> None:
    """Few pairs are measured at a pose; the least of all of them must come out all the same."""
    scene = flown.scene
    points = flown.plan.waypoints
    found = hz.audit(scene, points, spacing=0.05)
    assert found.unit == "m"
    assert found.length == pytest.approx(flown.plan.cost)
    assert found.step <= 0.05
    corners = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    count = math.ceil(corners[-1] / 0.05) + 1
    at = np.union1d(np.linspace(0.0, corners[-1], count), corners)
    centres = np.column_stack([np.interp(at, corners, column) for column in points.T])
    assert found.poses == len(centres)
    for row in found.obstacles:
        distances = []
        for centre in centres:
            qpos = scene.initial_qpos.copy()
            qpos[:3] = centre
            distances.append(brute_force(scene, qpos, row.geom))
        assert min(distances) == pytest.approx(row.clearance, abs=1e-6)


def test_plan_and_trajectory_keep_what_was_planned(flown: hz.Run) -> None:
    assert flown.trajectory is not None
    for motion in (flown.plan, flown.trajectory):
        found = hz.audit(flown.scene, motion)
        assert found.holds
        assert found.agrees
        assert found.clearance >= flown.scene.clearance - 1e-6
        assert found.step <= 0.01


def test_path_through_a_wall_does_not_hold(flown: hz.Run) -> None:
    scene = flown.scene
    found = hz.audit(scene, [scene.start, scene.goal])
    nearest = found.obstacles[0]
    assert nearest.clearance < 0.0
    assert not found.holds
    assert found.agrees  # the planner knew
    assert nearest.blocked > 0


def test_planner_that_misses_part_of_an_obstacle_disagrees(flown: hz.Run) -> None:
    scene = flown.scene
    shrunk = [
        hz.Polytope.from_halfspaces(one.A, one.b - scene.radius - scene.clearance)
        for one in scene.obstacles
    ]
    found = hz.audit(dataclasses.replace(scene, obstacles=tuple(shrunk)), [scene.start, scene.goal])
    assert not found.agrees
    assert max(row.disagreement for row in found.obstacles) > 0.5 * scene.clearance


def test_tracking_may_use_up_the_clearance_but_no_more(flown: hz.Run) -> None:
    log, scene = flown.log, flown.scene
    assert log is not None
    nearest = hz.audit(scene, log).obstacles[0]
    wide = dataclasses.replace(scene, clearance=nearest.clearance + 0.02)
    assert not hz.audit(wide, log).holds
    late = dataclasses.replace(log, reference=log.reference + np.array([0.0, 0.0, 0.03]))
    assert hz.audit(wide, late).holds


def test_height_fields_are_measured_to_their_prisms(tmp_path: Path) -> None:
    """`mj_geomDistance` sees 50 prisms of a field at most, and says too much."""
    rows = 24
    ridge = " ".join("1" if row == 11 else "0" for row in range(rows) for _ in range(rows))
    world = tmp_path / "ridge.xml"
    world.write_text(
        f"""<mujoco><asset><hfield name="hills" nrow="{rows}" ncol="{rows}" size="2 2 1 .1"
        elevation="{ridge}"/></asset><worldbody><geom type="hfield" hfield="hills"/>
        <site name="goal" pos="0 1.5 1.6"/></worldbody></mujoco>"""
    )
    scene = hz.load_scene(
        world, body="point", start=(0, -1.5, 1.6), workspace=((-2, -2, 0), (2, 2, 2.5))
    )
    found = hz.audit(scene, [scene.start, scene.goal])
    assert len(found.obstacles) == 1
    assert found.obstacles[0].clearance == pytest.approx(1.6 - 1.0 - scene.radius, abs=1e-3)
    assert found.holds
    assert found.agrees


def test_planar_body_does_not_count_its_ground() -> None:
    scene = hz.load_scene("maze", body="point")
    found = hz.audit(scene, [scene.start, scene.start + np.array([0.1, 0.0])])
    assert found.holds
    assert {row.role for row in found.obstacles if row.name != "floor"} == {"obstacle"}


@pytest.mark.parametrize(
    ("motion", "says"),
    [
        ([[0.0, 0.0]], "3"),
        (np.zeros((0, 3)), "waypoint"),
        ([[0.0, float("nan"), 0.0]], "finite"),
    ],
)
def test_what_is_no_path_is_refused(flown: hz.Run, motion: Any, says: str) -> None:
    with pytest.raises(hz.HzmpError, match=says):
        hz.audit(flown.scene, motion)
    with pytest.raises(hz.QueryError, match="spacing"):
        hz.audit(flown.scene, flown.plan, spacing=0.0)


def test_run_directory_is_audited_by_command(
    flown: hz.Run, run_dir: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, err = audit_command(run_dir, capsys)
    assert (code, err) == (0, "")
    assert "clearance holds" in out
    for geom in flown.scene.obstacle_geoms:
        assert flown.scene.geom_name(geom) in out
    code, out, _ = audit_command(run_dir, capsys, "--json")
    found = json.loads(out)
    assert code == 0
    assert found["clearance_holds"]
    assert found["planner_agrees"]
    assert found["min_clearance_m"] == pytest.approx(flown.metrics["min_clearance_m"], abs=1e-6)
    assert len(found["obstacles"]) == len(flown.scene.contact_geoms)


def test_run_that_was_too_near_gives_exit_code_5(
    run_dir: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = run_dir / "trajectory.parquet"
    table = pq.read_table(file)
    columns = {name: table.column(name).to_numpy() for name in table.column_names
               if name.endswith(("_m", "_s")) or name[:2] in ("qw", "qx", "qy", "qz")}  # fmt: skip
    columns["z_m"] = columns["z_m"] - 0.9
    pq.write_table(pa.table(columns), file)
    code, out, _ = audit_command(run_dir, capsys)
    assert code == 5
    assert "DOES NOT HOLD" in out


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        ("missing", "does not exist"),
        ("file", "is a file"),
        ("no metrics", "no finished run"),
        ("broken metrics", "cannot be read"),
        ("other metrics", "does not say 'query'"),
        ("list", "metrics of a run"),
        ("no flight", "nothing was flown (goal_reached)"),
        ("broken flight", "not the log of a flight"),
        ("no scene", "no such file"),
    ],
)
def test_bad_directory_is_one_clear_line(
    run_dir: Path, capsys: pytest.CaptureFixture[str], damage: str, says: str
) -> None:
    metrics = run_dir / "metrics.json"
    texts = {"broken metrics": "{", "other metrics": "{}", "list": "[]"}
    if damage in texts:
        metrics.write_text(texts[damage])
    elif damage == "no metrics":
        metrics.unlink()
    elif damage == "no flight":
        (run_dir / "trajectory.parquet").unlink()
    elif damage == "broken flight":
        (run_dir / "trajectory.parquet").write_bytes(b"PAR1")
    elif damage == "no scene":
        (run_dir / "scene.xml").unlink()
    where = {"missing": run_dir / "nowhere", "file": metrics}.get(damage, run_dir)
    code, out, err = audit_command(where, capsys)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert says in err
