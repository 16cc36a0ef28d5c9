"""Flights under a law of the user's own: good ones, and those that it ruins."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import hzmp_sim as hz
from hzmp_planners.errors import QueryError, SceneError
from hzmp_tracking import BodyState, PointController, Reference

WHOLE = {"metrics.json", "report.html", "run.rrd", "scene.xml", "trajectory.parquet"}

Command = Callable[[BodyState, Reference], tuple[float, ...]]


class Law:
    """A controller that is one function."""

    def __init__(self, law: Command) -> None:
        self._law = law

    def command(self, state: BodyState, reference: Reference) -> tuple[float, ...]:
        return self._law(state, reference)


def good(state: BodyState, reference: Reference) -> tuple[float, ...]:
    law = PointController([1.0, 1.0, math.inf], [(-20.0, 20.0)] * 3)
    return law.command(state, reference)[:2]


def diverging(state: BodyState, reference: Reference) -> tuple[float, ...]:
    """The sign of the feedback is wrong."""
    moves = zip(reference.position[:2], state.position[:2], reference.velocity[:2], strict=True)
    return tuple(-50.0 * (wanted - now) + speed for wanted, now, speed in moves)


def pushing(state: BodyState, reference: Reference) -> tuple[float, ...]:
    """Ahead, whatever the reference says."""
    return (-5.0, 0.0)


def undefined(state: BodyState, reference: Reference) -> tuple[float, ...]:
    return (
        (math.nan, 0.0)
        if math.dist(state.position[:2], (4.2, -0.6)) > 1.0
        else good(state, reference)
    )


def test_the_same_law_flies_the_same_way() -> None:
    scene = hz.load_scene("enclosure", body="point")
    usual, own = hz.simulate(scene), hz.simulate(scene, controller=Law(good))
    assert usual.log is not None
    assert own.log is not None
    assert own.metrics["status"] == "goal_reached"
    assert np.allclose(own.log.position, usual.log.position, atol=1e-9)


@pytest.mark.parametrize(
    ("command", "status", "reason"),
    [
        (diverging, "goal_not_reached", "left the workspace after"),
        (pushing, "collision", "off its reference"),
        (undefined, "goal_not_reached", "no longer finite"),
    ],
)
def test_a_law_that_fails_leaves_a_whole_run_that_says_so(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: Command,
    status: str,
    reason: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    scene, out = hz.load_scene("enclosure", body="point"), tmp_path / "run"
    run = hz.simulate(scene, out, hz.RunSettings(video=False), controller=Law(command))
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["status"] == status
    assert any(reason in warning for warning in metrics["warnings"])
    assert {path.name for path in out.iterdir()} >= WHOLE
    assert run.log is not None
    rows = pq.read_table(out / "trajectory.parquet")
    assert rows.num_rows == metrics["steps"] == len(run.log.time) > 100
    assert np.isfinite(run.log.qpos).all()
    assert run.trajectory is not None
    if reason == "no longer finite":
        assert f"after {run.log.time[-1]:.3f} s" in metrics["warnings"][0]
        assert run.log.time[-1] < run.trajectory.duration
    assert [path.name for path in tmp_path.iterdir()] == ["run"]  # no log file of MuJoCo's


def test_another_number_of_commands_is_refused() -> None:
    scene = hz.load_scene("enclosure", body="point")
    law = Law(lambda state, reference: (0.0, 0.0, 0.0))
    with pytest.raises(QueryError, match="gave 3 commands; the model has 2 actuators: 'point_"):
        hz.simulate(scene, controller=law)


def test_a_body_without_actuators_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "still.xml"
    path.write_text("""<mujoco>
      <custom><numeric name="workspace" data="0 0 0  4 4 2"/></custom>
      <worldbody><body name="cart" pos="1 1 1"><joint type="slide" axis="1 0 0"/>
        <joint type="slide" axis="0 1 0"/><geom size="0.1"/></body>
        <site name="goal" pos="3 3 1"/></worldbody></mujoco>""")
    with pytest.raises(SceneError, match="'cart' has no actuator that a controller could use"):
        hz.simulate(hz.load_scene(path, body="cart"), controller=Law(good))
