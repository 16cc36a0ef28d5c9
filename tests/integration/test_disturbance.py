"""Flights in wind, with weak actuators and with sensors that err: the run says what it was."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import hzmp_sim as hz
from hzmp_planners.errors import QueryError
from hzmp_sim import Disturbance, RunSettings
from hzmp_sim.simulation.disturbance import Sensors, wind_at_steps
from hzmp_tracking.controllers import BodyState


def flown(body: str, **disturbance: object) -> hz.Run:
    scene = hz.load_scene("enclosure", body=body, clearance=0.15)
    settings = RunSettings(disturbance=Disturbance(**disturbance), seed=3)  # type: ignore[arg-type]
    return hz.simulate(scene, settings=settings)


@pytest.mark.parametrize(
    ("body", "disturbance", "most"),
    [
        ("point", {"wind": (5.0, 0.0, 0.0)}, 0.005),
        ("point", {"thrust_loss": 0.1}, 0.005),
        ("quadrotor", {"gust": 5.0}, 0.1),
        ("quadrotor", {"wind": (3.0, -3.0, 0.0), "gust": 2.0}, 0.1),
        ("quadrotor", {"thrust_loss": 0.1}, 0.1),
    ],
)
def test_bodies_arrive_all_the_same(body: str, disturbance: dict[str, object], most: float) -> None:
    calm, disturbed = flown(body).metrics, flown(body, **disturbance).metrics
    assert disturbed["status"] == "goal_reached"
    assert calm["tracking_error_max_m"] < disturbed["tracking_error_max_m"] <= most
    assert disturbed["beyond_clearance_s"] == 0.0
    assert calm["disturbed_by"] == ""


def test_wind_pushes_the_way_it_blows() -> None:
    run = flown("point", wind=(0.0, 4.0, 0.0))
    assert run.log is not None
    off = (run.log.position - run.log.reference)[-1]
    assert off[1] > 5e-4
    assert off[1] > 2.0 * abs(off[0])
    assert "wind of 0 4 0 m/s" in run.metrics["disturbed_by"]
    assert run.metrics["disturbance"]["wind"] == (0.0, 4.0, 0.0)


def test_wind_of_the_world_blows_all_the_same_and_is_known(tmp_path: Path) -> None:
    file = tmp_path / "scene.xml"
    pushes = []
    for option in ("", '<option density="1.2" viscosity="1.8e-5" wind="0 4 0"/>'):
        file.write_text(f"""<mujoco>{option}
          <custom><numeric name="workspace" data="-2 -2 0  2 2 2"/></custom>
          <worldbody><site name="start" pos="-1 0 1"/><site name="goal" pos="1 0 1"/></worldbody>
        </mujoco>""")
        run = hz.simulate(hz.load_scene(file, body="point"))
        assert run.log is not None
        assert np.abs((run.log.position - run.log.reference)[:, 1]).max() < 1e-6
        pushes.append(float(run.log.control[-1, 1]))
    assert pushes[0] == pytest.approx(0.0, abs=1e-6)
    assert pushes[1] < -0.1  # against the wind, as the loads of the body at rest say


def test_the_same_seed_is_the_same_flight_and_the_scene_stays_calm() -> None:
    one, two = (flown("point", gust=4.0, position_noise=0.002) for _ in range(2))
    assert one.log is not None
    assert two.log is not None
    assert np.array_equal(one.log.qpos, two.log.qpos)
    assert not one.scene.model.opt.wind.any()
    assert one.scene.model.opt.density == 0.0


def test_a_body_off_its_way_for_long_is_told_of() -> None:
    scene = hz.load_scene("enclosure", body="point", clearance=0.02)
    settings = RunSettings(disturbance=Disturbance(delay=0.02))
    metrics = hz.simulate(scene, settings=settings).metrics
    assert metrics["beyond_clearance_s"] > 0.1
    assert any("off its reference" in warning for warning in metrics["warnings"])
    assert metrics["disturbed_by"] == "measurements 20 ms old"


def test_gusts_have_their_size_their_mean_and_memory() -> None:
    rng = np.random.default_rng(0)
    dt = 0.002
    disturbance = Disturbance(wind=(1.0, 2.0, 3.0), gust=3.0)
    wind = wind_at_steps(disturbance, 200_000, dt, rng)
    gusts = wind - [1.0, 2.0, 3.0]
    assert np.linalg.norm(gusts, axis=1).max() <= 3.0 * (1.0 + 1e-12)
    assert np.abs(gusts.mean(axis=0)).max() < 0.2
    assert np.allclose(gusts.std(axis=0), 1.0, atol=0.15)
    later = round(0.5 / dt)
    kept = (gusts[later:] * gusts[:-later]).mean() / (gusts**2).mean()
    assert kept == pytest.approx(math.exp(-1.0), abs=0.1)


def test_sensors_are_late_by_whole_steps_and_err_as_much_as_told() -> None:
    rng = np.random.default_rng(0)
    states = [BodyState([float(k)] * 3, [-float(k)] * 3) for k in range(50)]
    late = Sensors(Disturbance(delay=0.01), 50, 0.002, rng)
    seen = [late.measure(state).position[0] for state in states]
    assert seen == [0.0] * 5 + [float(k) for k in range(45)]
    noisy = Sensors(Disturbance(position_noise=0.1, velocity_noise=0.2), 5000, 0.002, rng)
    still = BodyState([1.0, 2.0, 3.0], [0.0, 0.0, 0.0])
    drawn = [noisy.measure(still) for _ in range(5000)]
    assert np.std([state.position for state in drawn], axis=0) == pytest.approx([0.1] * 3, rel=0.1)
    assert np.std([state.velocity for state in drawn], axis=0) == pytest.approx([0.2] * 3, rel=0.1)
    assert np.mean([s.position for s in drawn], axis=0) == pytest.approx([1, 2, 3], abs=0.02)


@pytest.mark.parametrize(
    "wrong",
    [
        {"gust": -1.0}, {"thrust_loss": 1.0}, {"delay": math.inf}, {"wind": (1.0, math.nan, 0.0)},
        {"wind": (1.0, 2.0)}, {"position_noise": math.nan},
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(QueryError, match=next(iter(wrong))):
        Disturbance(**wrong)  # type: ignore[arg-type]


def test_every_part_has_words() -> None:
    values = {field.name: 0.5 for field in dataclasses.fields(Disturbance)[1:]}
    words = Disturbance(wind=(1.0, 0.0, 0.0), **values).describe()
    assert len(words.split(", ")) == len(dataclasses.fields(Disturbance))
