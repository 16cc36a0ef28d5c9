"""`hzmp-sim bench paper` as a user runs it, very small, and what it measures."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hzmp_planners.errors import QueryError
from hzmp_sim.bench.boxes.laws import FLAT, random_boxes
from hzmp_sim.bench.boxes.visibility import shortest_path
from hzmp_sim.bench.paper.figures.all_figures import FIGURES
from hzmp_sim.bench.paper.rectangles import find_scenes
from hzmp_sim.bench.paper.report import markdown, tables_of
from hzmp_sim.bench.paper.results import BEST, PAPER, Results
from hzmp_sim.bench.paper.settings import PaperBenchSettings, effort_of
from hzmp_sim.bench.paper.worlds import WORLDS
from hzmp_sim.cli import app
from oracles import World, shortest_length

SMALL = ["--runs", "2", "--scenes", "3", "--repeats", "1", "--budget", "0.03"]


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench") / "paper"
    code = app(["bench", "paper", *SMALL, "--out", str(folder)], result_action="return_value")
    assert code == 0
    return folder


@pytest.fixture(scope="module")
def results(out: Path) -> Results:
    return Results.from_dict(json.loads((out / "paper.json").read_text()))


def test_all_files_are_there(out: Path) -> None:
    names = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert names == {"paper.json", "paper.md", *(f"figures/{name}" for name in FIGURES)}
    page = (out / "paper.md").read_text()
    for name in FIGURES:
        assert f"](figures/{name})" in page
        assert (out / "figures" / name).stat().st_size > 5000
    assert "made by: hzmp-sim bench paper" in page


def test_what_is_measured_holds(results: Results) -> None:
    assert results.defects == []
    optimum = {scene.seed: scene.optimum for scene in results.scenes}
    assert len(optimum) == 3
    assert results.chosen in optimum
    for planner in (PAPER, BEST):
        many = [run for run in results.many_scenes if run.planner == planner]
        assert sorted(run.scene for run in many) == sorted(optimum)
        assert [run.seed for run in results.many_runs if run.planner == planner] == [0, 1]
    for run in (*results.many_runs, *results.many_scenes):
        best = optimum[run.scene]
        assert run.final_cost <= best * (1.001 if run.planner == BEST else 1.1)
        assert run.lower_bound <= best * (1.0 + 1e-7)
        assert run.decompose_s > 0.0
        assert [cost for _, cost in run.history] == sorted(
            (c for _, c in run.history), reverse=True
        )
    for one in results.experiments:
        assert one.optimum <= one.bound * (1.0 + 1e-6)
        assert [step.number for step in one.steps] == list(range(1, len(one.steps) + 1))
        assert all(a.best >= b.best >= one.bound for a, b in pairwise(one.steps))
        assert one.after["50"][0] <= one.after["8"][0] <= one.after["1"][0]
        assert one.after["50"][0] <= 1.02 * one.optimum


def test_defects_are_found(results: Results) -> None:
    run = results.many_runs[0]
    through = replace(run, defects=["path 0.1 m inside an obstacle"])
    assert any("inside" in line for line in replace(results, many_runs=[through]).defects)
    short = replace(run, cost=0.9 * results.scenes[0].optimum, scene=results.scenes[0].seed)
    assert len(replace(results, many_runs=[short]).defects) >= 1
    proud = replace(run, lower_bound=2.0 * run.final_cost)
    assert any("bound" in line for line in replace(results, many_runs=[proud]).defects)


def test_tables_have_a_cell_for_each_column(results: Results) -> None:
    for table in tables_of(results):
        assert table.rows
        assert {len(row) for row in table.rows} == {len(table.columns)}
    failed = replace(results.many_scenes[0], cost=None, history=[])
    text = markdown(replace(results, many_scenes=[failed, *results.many_scenes[1:]]))
    assert "67 %" in text
    assert "inf" in text


def test_scenes_are_the_solvable_draws_with_their_optima() -> None:
    found = find_scenes(2, 1)
    seeds = [one["seed"] for one in found["scenes"]]
    for one in found["scenes"]:
        scene = random_boxes(2, FLAT, one["seed"])
        world = World(scene.lo, scene.hi, scene.obstacles())
        assert one["optimum"] == pytest.approx(
            shortest_length(world, scene.start, scene.goal), rel=1e-7
        )
    passed = [seed for seed in range(1, seeds[-1]) if seed not in seeds]
    assert len(passed) == found["passed"] > 0
    for seed in passed:
        scene = random_boxes(2, FLAT, seed)
        ends = scene.lo, scene.hi, scene.low, scene.high, scene.start, scene.goal
        assert shortest_path(*ends) is None


@pytest.mark.parametrize("name", WORLDS)
def test_worlds_have_what_the_paper_says(name: str) -> None:
    world = WORLDS[name]()
    space = world.free_space()
    assert space.contains([world.start, world.goal]).all()
    known: dict[str, tuple[Any, ...]] = {
        "maze": ((-100, -100), (800, 600), (400, 250), (385, 470)),
        "passage": ((-15, 0, 0), (15, 15, 5), (-13, 10, 3), (13, 3, 2)),
        "enclosure": ((0, 0), (10, 10), (1, 3), (7, 5)),
    }
    ends = (world.lo, world.hi, world.start, world.goal)
    assert all(np.array_equal(one, two) for one, two in zip(ends, known[name], strict=True))


def test_settings_are_checked_and_recorded() -> None:
    with pytest.raises(QueryError, match="runs must be at least 1"):
        PaperBenchSettings(runs=0)
    with pytest.raises(QueryError, match="budget"):
        PaperBenchSettings(budget=0.0)
    settings = PaperBenchSettings(quick=True, seed=3)
    assert settings.command() == "hzmp-sim bench paper --quick --seed 3"
    assert asdict(effort_of(settings)) == {"runs": 10, "scenes": 10, "repeats": 5}
    assert effort_of(PaperBenchSettings()).runs == 100
