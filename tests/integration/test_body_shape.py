"""Flying as what the body is: through a slot that the ball about its centre cannot pass."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import exit_code

import hzmp_sim as hz

SLOT = """<mujoco model="slot">
  <custom><numeric name="workspace" data="-2 -1 -1 2 1 2"/></custom>
  <worldbody>
    <geom name="sill" type="box" pos="0 0 -0.05" size="0.2 1 0.95"/>
    <geom name="lintel" type="box" pos="0 0 1.6" size="0.2 1 0.4"/>
    <body name="tray" pos="-1.3 0 0.4" gravcomp="1">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom name="tray" type="box" size="0.3 0.3 0.03" mass="1"/>
    </body>
    <site name="goal" pos="1.3 0 1.5"/>
  </worldbody>
  <actuator><motor joint="x"/><motor joint="y"/><motor joint="z"/></actuator>
</mujoco>"""


@pytest.fixture
def slot(tmp_path: Path) -> Path:
    """A flat body, 6 cm high, before a slot of 30 cm; a ball that holds it is 85 cm wide."""
    file = tmp_path / "slot.xml"
    file.write_text(SLOT)
    return file


def test_flat_body_flies_through_a_low_slot(
    slot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "run")
    assert exit_code("run", str(slot), "--no-video", "--out", out) == 0
    metrics = json.loads((tmp_path / "run" / "metrics.json").read_text())
    assert (metrics["status"], metrics["collision_steps"]) == ("goal_reached", 0)
    assert metrics["min_clearance_m"] >= 0.04
    assert metrics["plan_verified"]
    assert metrics["body_shape"]["kind"] == "hull"
    assert metrics["body_shape"]["highest_m"] == pytest.approx([0.3, 0.3, 0.03])
    assert "its convex hull as it stands, 0.6 x 0.6 x 0.06 m" in (
        tmp_path / "run" / "report.html"
    ).read_text(encoding="utf-8")
    assert exit_code("audit", out) == 0  # read again as it was flown
    capsys.readouterr()


def test_same_way_is_proved_closed_for_the_ball(
    slot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert exit_code("plan", str(slot), "--shape", "ball", "--json") == 3
    found = json.loads(capsys.readouterr().out)
    assert (found["status"], found["verified"]) == ("infeasible", True)


def test_inspect_states_the_shape(slot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code("inspect", str(slot)) == 0
    text = capsys.readouterr().out
    assert "shape     its convex hull as it stands, 0.6 x 0.6 x 0.06 m" in text
    assert "mm larger all around" in text
    assert exit_code("inspect", str(slot), "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["shape"]["kind"] == "hull"
    assert found["widest_body"]["radius_m"] is None
    # 0.3 m high, less 0.06 m of body and 0.05 m of clearance on either side.
    assert found["widest_body"]["extra_radius_m"] == pytest.approx(0.07, abs=2e-3)


def test_quadrotor_that_tilts_beyond_its_cylinder_is_told_of() -> None:
    calm = hz.simulate(hz.load_scene("narrow_passage", body="quadrotor"))
    assert calm.metrics["body_shape"]["kind"] == "cylinder"
    assert 0.3 < calm.metrics["tilt_max_rad"] < 0.6
    assert not calm.metrics["warnings"]
    held = hz.load_scene("narrow_passage", body="quadrotor", max_tilt=0.2)
    # The limits that follow from the body know how far it may tilt; those set by hand do not.
    within = hz.simulate(held).metrics
    assert within["tilt_max_rad"] < 0.2
    assert not within["warnings"]
    run = hz.simulate(held, settings=hz.RunSettings(acceleration=3.0, jerk=10.0))
    assert run.metrics["tilt_max_rad"] > 0.2
    assert any("of the tilt that the body has" in text for text in run.metrics["warnings"])
    assert any("beyond the 0.2 that its shape is for" in text for text in run.metrics["warnings"])


def test_shape_for_another_body_is_one_clear_line(
    slot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert exit_code("plan", str(slot), "--shape", "cylinder") == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    assert "it keeps its orientation; auto, ball, hull do" in said
    assert exit_code("plan", str(slot), "--shape", "egg") == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
