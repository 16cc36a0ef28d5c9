"""What a run says of the plans made in flight, and where it shows what moves."""

from __future__ import annotations

import dataclasses
import json
import subprocess
from pathlib import Path

import imageio_ffmpeg
import mujoco
import numpy as np
import pytest
from rerun.chunk import RrdReader

import hzmp_sim as hz
from hzmp_sim.output.figures import write_figures
from hzmp_sim.output.plans import plan_rows, reason_rows, write_plans
from hzmp_sim.output.poses import pose_at, pose_at_start
from hzmp_sim.output.recording import write_recording
from hzmp_sim.output.report import write_report
from hzmp_sim.output.video import write_video
from hzmp_sim.run import Run
from hzmp_sim.simulation.recorded import read_run
from recordings import recorded, verify_recording


@pytest.fixture(scope="module")
def run() -> Run:
    return hz.simulate(hz.load_scene("crossing_traffic", body="point"))


def test_moving_bodies_are_shown_where_they_were(run: Run) -> None:
    assert run.log is not None
    data = mujoco.MjData(run.scene.model)
    pose_at(run.log, len(run.log.time) - 1, data)
    end = data.mocap_pos.copy()
    np.testing.assert_array_equal(end, run.log.mocap[-1, :, :3])
    pose_at_start(run.scene, data)
    assert np.abs(end - data.mocap_pos).max() > 0.1
    np.testing.assert_allclose(data.mocap_pos, run.log.mocap[0, :, :3], atol=0.05)


def test_every_plan_is_in_the_table_the_figure_and_the_file(run: Run, tmp_path: Path) -> None:
    planned = run.flight_plan
    assert planned is not None
    rows = plan_rows(planned)
    assert sum(row.asked for row in rows) == len(planned.records)
    assert sum(row.taken for row in rows) == run.metrics["replans"]
    write_plans(planned, tmp_path / "plans.json")
    entries = json.loads((tmp_path / "plans.json").read_text(encoding="utf-8"))
    assert [entry["reason"] for entry in entries] == [r.reason for r in planned.records]
    assert tmp_path / "replanning.png" in write_figures(run, tmp_path)


def test_the_report_counts_decisions_and_explains_contacts(run: Run, tmp_path: Path) -> None:
    planned = run.flight_plan
    assert planned is not None
    counts = {row.reason: row.asked for row in reason_rows(planned)}
    assert counts == run.metrics["plans_for"]
    hit = {
        "first_s": 1.25, "steps": 7, "depth_m": 0.0123, "predicted": False,
        "explanation": "it had not been where it was predicted since 1.20 s",
    }  # fmt: skip
    broken = {"geom": "car_3b", "time": 1.2, "error": 0.321, "assumed": "it goes on"}
    metrics = run.metrics | {
        "status": "collision", "contacts": {"car_3b": hit}, "broken_predictions": [broken],
    }  # fmt: skip
    write_report(dataclasses.replace(run, metrics=metrics), tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    for said in (
        "contact of the body with car_3b. What it met was not where it had been predicted.",
        ">12.3<",
        hit["explanation"],
        ">0.321<",
        broken["assumed"],
        "What was assumed of car_3b did not hold.",
        "among what stands still",
        *counts,
    ):
        assert str(said) in page


def test_the_recording_has_what_moves_and_what_was_planned(run: Run, tmp_path: Path) -> None:
    planned = run.flight_plan
    assert planned is not None
    path = tmp_path / "run.rrd"
    write_recording(run, path)
    verify_recording(path)
    places = np.array(recorded(path, "/bodies/car_1a", "Transform3D:translation")).reshape(-1, 3)
    assert np.ptp(places[:, 1]) > 1.0
    found = [record for record in planned.records if np.isfinite(record.cost)]
    for entity, values in (
        ("latency", [1e3 * record.latency for record in planned.records]),
        ("cost", [record.cost for record in found]),
        ("lower_bound", [record.lower_bound for record in found]),
    ):
        scalars = np.array(recorded(path, f"/replanning/{entity}", "Scalars:scalars")).ravel()
        np.testing.assert_allclose(scalars, values)
    assert len(recorded(path, "/replanning/path", "LineStrips3D:strips")) == len(found)
    for chunk in RrdReader(path).stream():
        names = chunk.to_record_batch().schema.names
        if chunk.entity_path.startswith(("/replanning", "/bodies")) and not chunk.is_static:
            assert "sim_time" in names
            assert "plan_time" not in names


def test_a_world_without_mocap_bodies_is_written_and_read(tmp_path: Path) -> None:
    settings = hz.RunSettings(video=False, replanning=hz.Replanning(duration=0.3))
    out = tmp_path / "run"
    hz.simulate(hz.load_scene("pendulum_gallery", body="point"), out, settings)
    scene, motion = read_run(out)
    assert motion.world is not None
    qpos, mocap = motion.world
    assert qpos.shape == (len(motion.progress), scene.model.nq)
    assert mocap.shape == (len(motion.progress), 0, 7)
    swing = scene.model.jnt_qposadr[scene.model.joint("pendulum_1").id]
    assert np.ptp(qpos[:, swing]) > 0.01


@pytest.mark.render
def test_what_moves_moves_in_the_video(run: Run, tmp_path: Path) -> None:
    """With body, path and way left out, only the traffic can differ between two frames."""
    log = run.log
    assert log is not None
    still = dataclasses.replace(log, position=np.repeat(log.position[:1], len(log.time), axis=0))
    qpos = log.qpos.copy()
    qpos[:] = qpos[0]
    still = dataclasses.replace(still, qpos=qpos)
    film = dataclasses.replace(run, log=still, flight_plan=None)
    path = tmp_path / "run.mp4"
    write_video(film, path, width=160, height=120, fps=2.0)
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-i", str(path)]
    raw = subprocess.run(
        [*command, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True
    ).stdout
    frames = np.frombuffer(raw, np.uint8).reshape(-1, 120, 320, 3).astype(int)
    overview = frames[:, :, :160]
    changed = (np.abs(np.diff(overview, axis=0)) > 40).any(axis=3).mean(axis=(1, 2))
    assert (changed > 0.01).all()
