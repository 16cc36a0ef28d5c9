"""`hzmp-sim bench peers`: one small run without any peer, the peers' drivers, settings, scenes."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hzmp_planners.errors import SceneError
from hzmp_sim.bench.boxes.laws import default_scenes, maze, random_boxes, set_piece, solvable
from hzmp_sim.bench.boxes.scene import BoxScene, read_scenes
from hzmp_sim.bench.fresh import FreshProcesses
from hzmp_sim.bench.peers.cells import cells_of, face_pairs
from hzmp_sim.bench.peers.jobs import Job, jobs_of, run_job
from hzmp_sim.bench.peers.ours import measure_ours
from hzmp_sim.bench.peers.planners import PLANNERS, asked_for
from hzmp_sim.bench.peers.report import markdown
from hzmp_sim.bench.peers.results import COLD, WARM, Results, Run
from hzmp_sim.bench.peers.settings import PeersSettings, effort_of
from hzmp_sim.bench.peers.visible import measure_visibility

PythonRun = Callable[..., subprocess.CompletedProcess[str]]

# --- scenes ---------------------------------------------------------------------------------------


def test_scenes_are_the_same_after_a_way_through_json() -> None:
    for scene in (random_boxes(3, 5, 1), set_piece("wall_gap", 2), maze(3, 0)):
        data = json.loads(json.dumps(scene.to_dict()))
        assert BoxScene.from_dict(data).to_dict() == scene.to_dict()


def test_scene_files_are_read_with_their_cells_or_refused(root: Path, tmp_path: Path) -> None:
    scenes = {scene.name: scene for scene in read_scenes(root / "tests" / "data" / "scenes")}
    known = scenes["maze2d_5"]
    low, _, edges = cells_of(known)
    assert (len(low), len(edges)) == (51, 52)
    assert scenes["four_rooms_2d"].optimum == pytest.approx(1.78995, abs=1e-4)
    with pytest.raises(SceneError, match="no scene file"):
        read_scenes(tmp_path)
    (tmp_path / "bad.json").write_text('{"bounds": {"lo": [0, 0], "hi": [1, 1]}}')
    with pytest.raises(SceneError, match=r"bad\.json cannot be used"):
        read_scenes(tmp_path)


def test_built_in_scenes_follow_their_laws() -> None:
    scenes, _ = default_scenes(0, quick=True)
    assert len({scene.name for scene in scenes}) == len(scenes)
    for scene in scenes:
        assert solvable(scene)
        assert ((scene.start >= scene.lo) & (scene.goal <= scene.hi)).all()
    boxes = random_boxes(3, 40, 3)
    sides = boxes.high - boxes.low
    assert sides.min() >= 0.1
    assert sides.max() <= 0.2
    np.testing.assert_array_equal(boxes.low, random_boxes(3, 40, 3).low)


def test_face_pairs_are_counted_cell_by_cell() -> None:
    # A chain of three cells: one, two and one faces.
    assert face_pairs(3, np.array([[0, 1], [1, 2]])) == 1 + 4 + 1


# --- ours, and the yardstick ----------------------------------------------------------------------


def test_our_runs_are_measured_cold_and_warm() -> None:
    scene = set_piece("wall_gap", 2).to_dict()
    answer = measure_ours(scene, seed=0, budget=1.0, gap=1e-3, verified=True)
    cold, warm = (Run(**run) for run in answer["runs"])
    (best,) = measure_visibility(scene, [0])["runs"]
    assert (cold.planner, warm.planner) == (COLD, WARM)
    for run in (cold, warm):
        assert run.defects == []
        assert run.cost == pytest.approx(best["cost"], rel=1e-3)
        assert run.lower_bound <= best["cost"] * (1.0 + 1e-9)
        assert run.depth < 1e-8
        assert run.bounds[-1][1] == run.lower_bound
    assert cold.history[0][0] > cold.offline_s > 0.0
    assert answer["leaves"] == 4


# --- jobs -----------------------------------------------------------------------------------------


def test_every_planner_has_its_jobs_and_large_scenes_none_for_the_convex_graph() -> None:
    settings = PeersSettings(runs=2, checks=("states",), gcs_pairs=10)
    jobs, left_out = jobs_of(
        set_piece("wall_gap", 2), asked_for(settings), settings, effort_of(settings)
    )
    tasks = [job.task.rpartition(":")[2] for job in jobs]
    assert tasks.count("measure_ours") == 2
    assert tasks.count("measure_ompl") == 2 * 4
    assert tasks.count("measure_visibility") == tasks.count("measure_fast_paths") == 1
    assert "reference" not in tasks
    assert "measure_convex_graph" not in tasks
    assert "4 cells with 16 pairs of faces" in left_out[0]
    spatial, _ = jobs_of(random_boxes(3, 3, 0), [], settings, effort_of(settings))
    assert [job.task.rpartition(":")[2] for job in spatial][-1] == "reference"


def test_failures_are_noted_and_those_of_ours_are_defects() -> None:
    run = Run("yard", "gcs", "", 0, [], 1.0)
    with FreshProcesses() as processes:
        theirs = run_job(processes, Job("json:loads", {"s": "nope"}, (run,)))
        ours = run_job(processes, Job("json:loads", {"s": "nope"}, (run,), ours=True))
        late = run_job(processes, Job("time:sleep", {}, (run,), limit=0.2))
    assert theirs["runs"][0]["note"].startswith("failed: json:loads: JSONDecodeError")
    assert theirs["runs"][0]["defects"] == []
    assert ours["runs"][0]["defects"][0].startswith("failed: ")
    assert late["runs"][0]["note"].startswith("failed: ")


# --- the run --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def finished(
    python: PythonRun, root: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, Path]:
    """Output and folder of a small run without peers."""
    folder = tmp_path_factory.mktemp("bench")
    scenes = folder / "scenes"
    scenes.mkdir()
    for name in ("four_rooms_2d.json", "wall_gap_3d.json"):
        (scenes / name).write_bytes((root / "tests" / "data" / "scenes" / name).read_bytes())
    small = (
        "--quick", "--runs", "2", "--planners", "visibility", "--checks", "exact",
        "--reference-time", "0.2",
    )  # fmt: skip
    done = python(
        "-m", "hzmp_sim", "bench", "peers", *small, "--scenes", "scenes", "--out", "made",
        cwd=folder, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "four_rooms_2d: " in done.stderr
    return done.stdout, folder / "made"


def test_run_writes_its_files(finished: tuple[str, Path]) -> None:
    printed, folder = finished
    assert "Every returned path, checked again" in printed
    figures = {"cost_exact.png", "success_exact.png"}
    assert {path.name for path in folder.iterdir()} == {
        "peers.json", "peers.md", "ompl_logs", *figures,
    }  # fmt: skip
    logs = {path.name for path in (folder / "ompl_logs").iterdir()}
    assert logs == {"four_rooms_2d.exact.log", "wall_gap_3d.exact.log"}
    for name in figures:
        assert (folder / name).read_bytes().startswith(b"\x89PNG")


def test_run_can_be_read_back(finished: tuple[str, Path]) -> None:
    folder = finished[1]
    data = json.loads((folder / "peers.json").read_text(encoding="utf-8"))
    results = Results.from_dict(data)
    assert results.to_dict() == data
    assert data["benchmark"] == "peers"
    assert data["defects"] == []
    flat, tall = results.scenes
    assert (flat.source, flat.n, tall.n) == ("visibility", 2, 3)
    assert flat.reference == pytest.approx(1.78995, abs=1e-4)
    assert len(results.of(WARM, "exact")) == len(results.of(WARM, "states")) == 4
    for run in results.runs:
        assert run.depth < 1e-8
        assert run.cost is not None
    page = (folder / "peers.md").read_text(encoding="utf-8")
    assert page.endswith(markdown(results, ["cost_exact.png", "success_exact.png"]))
    assert results.command.split()[:3] == ["hzmp-sim", "bench", "peers"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--runs", "0"], "runs must be at least 1"),
        (["--budget", "-1"], "budget must be positive"),
        (["--scenes", "nowhere"], "scenes must be a folder"),
    ],
)
def test_bad_settings_are_one_clear_line(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from hzmp_sim.cli import BAD_INPUT, main

    with pytest.raises(SystemExit) as stopped:
        main(["bench", "peers", *arguments])
    assert stopped.value.code == BAD_INPUT
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_settings_give_their_command() -> None:
    assert PeersSettings().command() == "hzmp-sim bench peers"
    settings = PeersSettings(planners=("gcs", "aorrtc"), checks=("exact",), runs=3)
    assert settings.command(Path("x y")) == (
        "hzmp-sim bench peers --planners gcs aorrtc --checks exact --runs 3 --out 'x y'"
    )
    assert [one.name for one in asked_for(settings)] == ["aorrtc", "gcs"]


# --- the peers, where they are installed ----------------------------------------------------------

SCENE = set_piece("wall_gap", 2)
HERE = [one for one in PLANNERS if one.missing is None and one.modules]


def test_missing_peers_say_what_to_install() -> None:
    for planner in PLANNERS:
        line = planner.missing
        assert line is None or f"pip install {planner.packages}" in line


@pytest.mark.skipif(not HERE, reason="no peer is installed")
def test_installed_peers_find_free_paths() -> None:
    settings = PeersSettings(quick=True, runs=1, budget=0.2)
    best = measure_visibility(SCENE.to_dict(), [0])["runs"][0]["cost"]
    jobs, left_out = jobs_of(SCENE, HERE, settings, effort_of(settings))
    assert left_out == []
    with FreshProcesses() as processes:
        answers = [run_job(processes, job) for job in jobs if not job.ours]
    for run in (Run(**run) for answer in answers for run in answer["runs"]):
        assert run.cost is not None, run
        assert best * (1.0 - 1e-6) <= run.cost < 2.0 * best
        assert run.depth < 1e-6
        assert run.end_error < 1e-6
        assert 0.0 <= run.python_s < run.total_s


# --- the driver of OMPL, with a stand-in for it ---------------------------------------------------


class Stub:
    """Takes any call; what a test needs is set on top."""

    def __init__(self, *arguments: Any) -> None:
        self.arguments = arguments

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *arguments: None


class Information(Stub):
    def setMotionValidator(self, validator: Any) -> None:  # noqa: N802
        self.validator = validator

    def setStateValidityChecker(self, checker: Any) -> None:  # noqa: N802
        self.checker = checker

    def allocState(self) -> list[float]:  # noqa: N802
        return [0.0, 0.0]

    def checkMotion(self, one: Any, two: Any) -> bool:  # noqa: N802
        return bool(self.validator.checkMotion(one, two))

    def isValid(self, one: Any) -> bool:  # noqa: N802
        return bool(self.checker(one))


class Path2D(Stub):
    points: list[list[float]]

    def getStates(self) -> list[list[float]]:  # noqa: N802
        return self.points

    def length(self) -> float:
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())


class Definition(Stub):
    path: Path2D | None = None

    def setStartAndGoalStates(self, *states: Any) -> None:  # noqa: N802
        self.states = states

    def hasExactSolution(self) -> bool:  # noqa: N802
        return self.path is not None

    def getSolutionPath(self) -> Path2D | None:  # noqa: N802
        return self.path


class Solver(Stub):
    """Checks the straight line, then finds a way around the wall on the second round."""

    detour: tuple[list[float], ...] = ([-0.15, 0.31], [0.15, 0.31])
    cost = float("inf")

    def setProblemDefinition(self, definition: Definition) -> None:  # noqa: N802
        self.definition = definition

    def bestCost(self) -> Any:  # noqa: N802
        cost = Stub()
        vars(cost)["value"] = lambda: self.cost
        return cost

    def solve(self, stop: Callable[[], bool]) -> None:
        (information,) = self.arguments
        start, goal = self.definition.states
        assert not information.checkMotion(start, goal)
        assert information.isValid(start)
        assert not stop()
        points = [start, *self.detour, goal]
        assert all(information.checkMotion(*pair) for pair in pairwise(points))
        path = Path2D()
        path.points, self.cost = points, 1.0
        self.definition.path = path
        while not stop():
            pass


@pytest.fixture
def driver(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """`measure_ompl` on stand-ins for OMPL and for numba's compiler."""
    base, geometric, util, numba, package = (Stub() for _ in range(5))
    vars(base).update(
        RealVectorStateSpace=Stub, RealVectorBounds=Stub, SpaceInformation=Information,
        ProblemDefinition=Definition, PathLengthOptimizationObjective=Stub, MotionValidator=Stub,
        PlannerTerminationCondition=lambda stop: stop,
    )  # fmt: skip
    vars(geometric).update(BITstar=Solver)
    vars(util).update(LogLevel=Stub(), RNG=Stub())
    vars(numba).update(njit=lambda signature, **options: lambda function: function)
    names = {"ompl": package, "ompl.base": base, "ompl.geometric": geometric, "ompl.util": util}
    for name, module in (names | {"numba": numba}).items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.delitem(sys.modules, "hzmp_sim.bench.peers.ompl.measure", raising=False)
    from hzmp_sim.bench.peers.ompl import edges, measure

    edges.compiled.cache_clear()
    yield measure.measure_ompl
    edges.compiled.cache_clear()
    sys.modules.pop("hzmp_sim.bench.peers.ompl.measure", None)


@pytest.mark.parametrize("check", ["exact", "states"])
def test_driver_counts_times_and_checks_again(driver: Any, check: str) -> None:
    (row,) = driver(SCENE.to_dict(), "bit-star", check, 0, 0.05, 1e-3)["runs"]
    run = Run(**row)
    length = 2.0 * float(np.hypot(0.15, 0.31)) + 0.3
    assert run.cost == pytest.approx(length)
    assert run.claimed == 1.0
    assert run.depth == 0.0
    assert (run.edges, run.edges_first) == (4, 4)
    assert run.states == run.states_first
    assert run.states > (300 if check == "states" else 0)
    assert len(run.history) == 1
    assert 0.0 < run.history[0][0] < run.total_s
    assert 0.0 < run.python_first_s <= run.python_s


def test_driver_refuses_a_path_that_does_not_lead_to_the_goal(
    driver: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def short(self: Path2D) -> list[list[float]]:
        return self.points[:1] * 2

    monkeypatch.setattr(Path2D, "getStates", short)
    (row,) = driver(SCENE.to_dict(), "bit-star", "exact", 0, 0.02, 1e-3)["runs"]
    run = Run(**row)
    assert run.cost is None
    assert run.history == []
    assert run.note == "path does not lead from start to goal"
    assert asdict(run) == row
