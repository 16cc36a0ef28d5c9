"""A clearance from test flights holds in the flight it is for."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import exit_code

import hzmp_sim as hz
from hzmp_planners.errors import QueryError
from hzmp_sim.simulation import clearance_for
from hzmp_sim.world_arguments import World

CALM, WINDY = hz.Disturbance(), hz.Disturbance(wind=(3.0, 0.0, 0.0), gust=3.0)


@pytest.mark.parametrize(
    ("body", "calm", "windy"), [("point", 2e-3, 6e-3), ("quadrotor", 0.01, 0.05)]
)
def test_clearance_of_the_tube_is_enough(body: str, calm: float, windy: float) -> None:
    tubes = []
    for disturbance, most in ((CALM, calm), (WINDY, windy)):
        settings = hz.RunSettings(disturbance=disturbance, seed=1)
        tube = hz.tracking_tube(hz.load_scene("enclosure", body=body, clearance=0.0), settings)
        assert 1e-4 < tube < most
        clearance = clearance_for(tube)
        assert 1.5 * tube <= clearance < 1.5 * tube + 1.1e-3
        run = hz.simulate(
            hz.load_scene("enclosure", body=body, clearance=clearance), settings=settings
        )
        assert run.metrics["status"] == "goal_reached"
        assert run.metrics["beyond_clearance_s"] == 0.0
        assert run.metrics["min_clearance_m"] > 0.0
        tubes.append(tube)
    assert tubes[0] < tubes[1]


def test_harder_limits_make_a_wider_tube_and_the_seed_decides() -> None:
    scene = hz.load_scene("enclosure", body="quadrotor")
    gentle, again = (hz.tracking_tube(scene, hz.RunSettings(acceleration=1.0)) for _ in range(2))
    assert gentle == again
    assert gentle < hz.tracking_tube(scene, hz.RunSettings(acceleration=5.0, jerk=20.0))


def test_command_line_measures_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    assert exit_code("run", "maze", "--clearance", "auto", "--no-video", "--out", str(out)) == 0
    said = capsys.readouterr().err
    assert "clearance 2 mm, for tracking errors of up to 0." in said
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["query"]["clearance"] == 2e-3
    assert metrics["tracking_error_max_m"] < 1e-3


def test_other_commands_have_no_flight() -> None:
    with pytest.raises(QueryError, match="hzmp-sim run"):
        World(clearance="auto").load("maze")
