"""How closely bodies follow: targets that are held, with their disturbances."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import hzmp_sim as hz

OPEN = """<mujoco><custom><numeric name="workspace" data="-12 -12 0  12 12 6"/></custom>
<worldbody><site name="start" pos="-10 -10 2"/><site name="goal" pos="10 10 4"/></worldbody>
</mujoco>
"""


def flown(
    world: str | Path, body: str, disturbance: hz.Disturbance, **limits: Any
) -> dict[str, object]:
    scene = hz.load_scene(world, body=body, clearance=0.15)
    settings = hz.RunSettings(seed=3, disturbance=disturbance, video=False, **limits)
    metrics = hz.simulate(scene, settings=settings).metrics
    assert metrics["status"] == "goal_reached"
    return metrics


def error(metrics: dict[str, object]) -> float:
    value = metrics["tracking_error_max_m"]
    assert isinstance(value, float)
    return value


CALM = hz.Disturbance()


def test_point_within_a_millimetre() -> None:
    assert error(flown("narrow_passage", "point", CALM)) <= 1e-3


@pytest.mark.parametrize(
    "limits",
    [
        {},
        {"velocity": 2.0, "acceleration": 4.0, "jerk": 20.0},
        {"velocity": 2.0, "acceleration": 4.0, "total_jerk": 30.0},
    ],
)
def test_quadrotor_within_two_centimetres(limits: dict[str, float]) -> None:
    metrics = flown("narrow_passage", "quadrotor", CALM, **limits)
    assert error(metrics) <= 0.02


def test_default_limits_ask_for_no_more_than_the_rotors_and_the_shape_have() -> None:
    metrics = flown("narrow_passage", "quadrotor", CALM)
    assert metrics["warnings"] == []
    for name in ("thrust_usage", "body_rate_usage"):
        share = metrics[name]
        assert isinstance(share, float)
        assert 0.0 < share <= 0.8 * (1.0 + 1e-6)
    tilt, reference = metrics["tilt_max_rad"], metrics["tilt_reference_max_rad"]
    assert isinstance(tilt, float)
    assert isinstance(reference, float)
    assert reference <= 0.48 * (1.0 + 1e-6)
    assert tilt <= 0.6


def test_a_reference_beyond_the_rotors_is_told_of() -> None:
    metrics = flown("narrow_passage", "quadrotor", CALM, velocity=2.0, acceleration=5.0, jerk=40.0)
    warnings = metrics["warnings"]
    assert isinstance(warnings, list)
    assert any("of the body rate" in warning for warning in warnings)


def test_quadrotor_at_five_metres_a_second_in_the_open(tmp_path: Path) -> None:
    file = tmp_path / "open.xml"
    file.write_text(OPEN)
    scene = hz.load_scene(file, body="quadrotor")
    run = hz.simulate(scene, settings=hz.RunSettings(speed=5.0, video=False))
    assert run.trajectory is not None
    assert run.trajectory.norm_peaks[0] == pytest.approx(5.0, rel=1e-6)
    assert run.metrics["tracking_error_max_m"] <= 0.05


@pytest.mark.parametrize(
    ("disturbance", "most"),
    [
        (hz.Disturbance(gust=5.0), 0.1),
        (hz.Disturbance(wind=(5.0, 0.0, 0.0)), 0.1),
        (hz.Disturbance(thrust_loss=0.1), 0.05),
        (hz.Disturbance(delay=0.02), 0.1),
        (hz.Disturbance(velocity_noise=0.05, position_noise=0.005), 0.05),
    ],
)
def test_quadrotor_holds_out(disturbance: hz.Disturbance, most: float) -> None:
    metrics = flown("narrow_passage", "quadrotor", disturbance)
    assert error(metrics) <= most


def test_no_offset_stays_when_thrust_is_lost() -> None:
    scene = hz.load_scene("narrow_passage", body="quadrotor", clearance=0.15)
    settings = hz.RunSettings(disturbance=hz.Disturbance(thrust_loss=0.1), video=False)
    log = hz.simulate(scene, settings=settings).log
    assert log is not None
    assert log.tracking_error[-1] <= 0.005
