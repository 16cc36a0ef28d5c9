"""What a run says of the plans made in flight, and where it shows what moves."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

import hzmp_sim as hz
from hzmp_sim.output.figures import write_figures
from hzmp_sim.output.plans import plan_rows, write_plans
from hzmp_sim.output.poses import pose_at, pose_at_start
from hzmp_sim.run import Run


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
