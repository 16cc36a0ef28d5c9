"""`hzmp-sim bench`: what it counts, its fresh processes, and one small run of it."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hzmp_planners.errors import SceneError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from hzmp_sim.bench.fresh import FreshProcesses, TaskError, TaskTimeoutError
from hzmp_sim.bench.scale.cover import cover_error, misplaced_points, union_volume, volumes
from hzmp_sim.bench.scale.figures import FIGURES
from hzmp_sim.bench.scale.fits import fits_of
from hzmp_sim.bench.scale.naive import Order, naive_cells, naive_count
from hzmp_sim.bench.scale.peers import Peer
from hzmp_sim.bench.scale.report import markdown
from hzmp_sim.bench.scale.results import Results, Target, WorldResult
from hzmp_sim.bench.scale.settings import ScaleSettings
from hzmp_sim.bench.tables import Table
from hzmp_sim.bench.worlds import FAMILIES, World, WorldSpec, read_scene, squares

Run = Callable[..., subprocess.CompletedProcess[str]]

UNIT = {n: (np.zeros(n), np.ones(n)) for n in (2, 3)}


def box(*corners: list[float]) -> Polytope:
    return Polytope.from_box(*corners)


# --- counts and volumes that are known by hand ----------------------------------------------------

AMID = box([0.4, 0.4], [0.6, 0.6])
BESIDE = box([0.7, 0.4], [0.8, 0.6])


@pytest.mark.parametrize(
    ("n", "obstacles", "given", "reach"),
    [
        (2, [], 1, 1),
        (2, [AMID], 4, 4),
        # The second box lies in the strip right of the first: four cells instead of that one.
        (2, [AMID, BESIDE], 7, 7),
        # Covered by the first, it meets no cell.
        (2, [AMID, box([0.45, 0.45], [0.55, 0.55])], 4, 4),
        # It only touches the strip from outside the workspace.
        (2, [AMID, box([1.0, 0.0], [2.0, 1.0])], 4, 4),
        # A wall across: what is right of it, what is left of it.
        (2, [box([0.4, -1.0], [0.6, 2.0])], 2, 2),
        # Hanging from the top: the strips right and left of it go first in the given order (facets
        # +x, +y, -x, -y), then the second box, low and wide, leaves 3 + 3 + 2 cells of three. The
        # cell below the first box has the greatest reach: whole, it holds the second one.
        (2, [box([0.4, 0.9], [0.5, 1.0]), box([0.3, 0.1], [0.6, 0.2])], 8, 6),
        (3, [box([0.4] * 3, [0.6] * 3)], 6, 6),
        (3, [box([0.4] * 3, [0.6] * 3), box([0.7, 0.4, 0.4], [0.8, 0.6, 0.6])], 11, 11),
    ],
)
def test_naive_orders_count_what_is_counted_by_hand(
    n: int, obstacles: list[Polytope], given: int, reach: int
) -> None:
    assert naive_count(*UNIT[n], obstacles) == given
    assert naive_count(*UNIT[n], obstacles, "reach") == reach


@pytest.mark.parametrize("order", ["given", "reach"])
@pytest.mark.parametrize("family", list(FAMILIES))
def test_naive_cells_fill_the_free_space(family: str, order: Order) -> None:
    world = WorldSpec(family, 12, 3).make()
    cells = naive_cells(world.lo, world.hi, world.obstacles, order)
    space = FreeSpace.decompose(world.bounds, world.obstacles)
    total = sum(float(volumes(batch).sum()) for batch in cells)
    assert total == pytest.approx(space.volume, rel=1e-12)


def test_union_of_obstacles_counts_overlaps_once_and_only_what_is_inside() -> None:
    cross = [box([0.0, 0.4], [1.0, 0.6]), box([0.4, -1.0], [0.6, 3.0])]
    assert union_volume(*UNIT[2], cross) == pytest.approx(0.2 + 0.2 - 0.04, abs=1e-15)
    assert union_volume(*UNIT[2], [*cross, *cross]) == pytest.approx(0.36, abs=1e-15)
    assert union_volume(*UNIT[2], []) == 0.0
    corner = Polytope.from_vertices([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    below = box([0.0] * 3, [1.0, 1.0, 0.5])
    assert union_volume(*UNIT[3], [corner, below]) == pytest.approx(0.5 + 1 / 48, abs=1e-15)


def test_a_wrong_cover_is_noticed() -> None:
    lo, hi = UNIT[2]
    world = World("two", lo, hi, (AMID, BESIDE))
    space = FreeSpace.decompose((lo, hi), world.obstacles)
    X = np.random.default_rng(0).random((2000, 2))
    assert cover_error(world, space) < 1e-14
    assert misplaced_points(world, space, X) == 0
    half = FreeSpace.decompose((lo, hi), [AMID])
    assert cover_error(world, half) == pytest.approx(0.02)
    inside = int(BESIDE.contains(X).sum())
    assert misplaced_points(world, half, X) == inside > 0


# --- worlds ---------------------------------------------------------------------------------------


def test_squares_are_those_of_the_scene_of_that_name() -> None:
    world = squares(49)
    corners = [block.interval_hull() for block in world.obstacles]
    assert len(corners) == 2401
    assert [end.tolist() for end in corners[0]] == [[-0.485, -0.485], [-0.475, -0.475]]
    last_but_two = [[0.475, 0.43499999999999994], [0.485, 0.44499999999999995]]
    assert [end.tolist() for end in corners[-3]] == last_but_two


@pytest.mark.parametrize("family", list(FAMILIES))
def test_a_seed_gives_one_world_of_constant_density(family: str) -> None:
    spec = WorldSpec(family, 20, 7)
    one, two, other = spec.make(), spec.make(), WorldSpec(family, 20, 8).make()
    assert len(one.obstacles) == 20
    assert np.prod(one.hi - one.lo) == pytest.approx(20.0)
    for first, second in zip(one.obstacles, two.obstacles, strict=True):
        np.testing.assert_array_equal(first.vertices(), second.vertices())
    assert not np.array_equal(one.obstacles[0].A @ one.hi, other.obstacles[0].b)


def test_a_scene_file_is_read_or_refused(root: Path, tmp_path: Path) -> None:
    path = root / "tests" / "data" / "scenes" / "four_rooms_2d.json"
    assert len(read_scene(path).obstacles) == 2
    bad = tmp_path / "bad.json"
    bad.write_text('{"bounds": {"lo": [0, 0]}}')
    with pytest.raises(SceneError, match=r"bad\.json"):
        read_scene(bad)


# --- fresh processes ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def processes() -> Iterator[FreshProcesses]:
    with FreshProcesses() as made:
        yield made


def test_a_task_gives_its_value(processes: FreshProcesses) -> None:
    assert processes.run("builtins:dict", {"a": [1.5, None]}) == {"a": [1.5, None]}


def test_memory_of_a_task_is_its_own(processes: FreshProcesses) -> None:
    before = processes.run("hzmp_sim.bench.memory:peak_mb", {})
    held = np.ones(40_000_000)  # 320 MB in this process, none in the other
    after = processes.run("hzmp_sim.bench.memory:peak_mb", {})
    assert held.nbytes > 3e8
    assert abs(after - before) < 50.0


def test_failures_of_a_task_are_told_and_the_next_one_runs(processes: FreshProcesses) -> None:
    with pytest.raises(TaskError, match="JSONDecodeError"):
        processes.run("json:loads", {"s": "nope"})
    with pytest.raises(TaskError, match=r"crashed \(exit code 3\)"):
        processes.run("os:_exit", {"status": 3})
    with pytest.raises(TaskTimeoutError, match=r"more than 0\.2 s"):
        processes.run("subprocess:run", {"args": ["sleep", "60"]}, limit=0.2)
    assert processes.run("builtins:dict", {}) == {}


# --- the run --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def finished(python: Run, root: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """Output and folder of a small run."""
    folder = tmp_path_factory.mktemp("bench")
    scenes = folder / "scenes"
    scenes.mkdir()
    name = "four_rooms_2d.json"
    (scenes / name).write_bytes((root / "tests" / "data" / "scenes" / name).read_bytes())
    small = ("--quick", "--counts", "3", "6", "--repeats", "1", "--no-peers")
    done = python(
        "-m", "hzmp_sim", "bench", "scale", *small, "--scenes", "scenes", "--out", "made",
        cwd=folder, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout, folder / "made"


@pytest.fixture(scope="module")
def data(finished: tuple[str, Path]) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((finished[1] / "scale.json").read_text(encoding="utf-8"))
    return loaded


def test_run_prints_tables_and_writes_files(finished: tuple[str, Path]) -> None:
    printed, folder = finished
    for heading in ("Targets", "Time", "Leaves per obstacle", "Obstacles that move"):
        assert f"\n{heading}" in f"\n{printed}"
    assert {path.name for path in folder.iterdir()} == {"scale.json", "scale.md", *FIGURES}
    for name in FIGURES:
        assert (folder / name).read_bytes().startswith(b"\x89PNG")


def test_run_measures_every_kind_of_world(data: dict[str, Any]) -> None:
    assert data["benchmark"] == "scale"
    assert data["exact"] is True
    measured = [(world["family"], world["obstacles"]) for world in data["worlds"]]
    families = ("turned", "boxes", "flat")
    assert measured == [(family, count) for family in families for count in (3, 6)] + [
        ("squares", 4), ("dense", 6), ("scene", 2),
    ]  # fmt: skip
    for world in data["worlds"]:
        assert len(world["decompose_s"]) == len(world["graph_s"]) >= 1
        assert min(world["decompose_s"]) > 0.0
        assert world["peak_mb"] >= world["base_mb"] > 10.0
        assert world["cover_error"] < 1e-12
        assert world["misplaced"] == 0
        assert min(world["leaves"], world["naive"], world["naive_reach"]) > 0
        assert 0 < world["overlapping"] <= world["leaves"]
    for row in data["moving"]:
        assert len(row["static_s"]) == len(row["numbered_s"]) + 1
        assert row["cover_error"] < 1e-12
    assert {fit["family"] for fit in data["fits"]} == set(families)
    assert {"processor", "cores", "load", "versions"} <= set(data["machine"])


def test_targets_of_worlds_that_were_not_measured_say_so(data: dict[str, Any]) -> None:
    verdicts = {target["asked"]: target["verdict"] for target in data["targets"]}
    assert verdicts["200 boxes in 3-D, with leaf graph"] == "not measured"
    assert verdicts["points on the wrong side, in all worlds"] == "met"


def test_page_is_made_from_the_data(finished: tuple[str, Path], data: dict[str, Any]) -> None:
    results = Results.from_dict(data)
    assert results.to_dict() == data
    page = (finished[1] / "scale.md").read_text(encoding="utf-8")
    assert page.endswith(markdown(results, FIGURES))
    assert results.command in page
    words = results.command.split()
    assert words[:3] == ["hzmp-sim", "bench", "scale"]
    assert words[3:] == [
        "--quick", "--counts", "3", "6", "--repeats", "1", "--no-peers", "--scenes", "scenes",
        "--out", "made",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--repeats", "0"], "repeats must be at least 1"),
        (["--counts", "0"], "counts must be whole numbers of at least 1"),
        (["--peer-time", "-1"], "peer_time must be positive"),
        (["--scenes", "nowhere"], "scenes must be a folder"),
    ],
)
def test_bad_settings_are_one_clear_line(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from hzmp_sim.cli import BAD_INPUT, main

    with pytest.raises(SystemExit) as stopped:
        main(["bench", "scale", *arguments])
    assert stopped.value.code == BAD_INPUT
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


# --- figures of a run -----------------------------------------------------------------------------


def world_result(count: int, total: float) -> WorldResult:
    return WorldResult(
        "boxes", "boxes, 3-D", 3, count, 0, 10 * count, 40 * count, [total], [0.0], total,
        100.0, 90.0, 0.0, 10, 0, 1.0, 1.0, 1.0, 1.0, naive=20 * count,
    )  # fmt: skip


def test_exponent_is_that_of_the_times() -> None:
    (fit,) = fits_of([world_result(N, 2e-3 * N**1.25) for N in (400, 100, 200)])
    assert fit.counts == [100, 200, 400]
    assert fit.exponent == pytest.approx(1.25)
    assert fit.last == pytest.approx(1.25)
    assert fits_of([world_result(100, 1.0)]) == []


@pytest.mark.parametrize(
    ("measured", "verdict"), [(None, "not measured"), (1.0, "met"), (1.01, "missed")]
)
def test_verdicts(measured: float | None, verdict: str) -> None:
    assert Target("a thing", 1.0, "s", measured).verdict == verdict


def test_a_missing_peer_says_what_to_install() -> None:
    def peer(*modules: str) -> Peer:
        return Peer("it", modules, "its-package", (), "", "", "boxes", lambda sizes: sizes.iris)

    assert peer("json").missing is None
    line = peer("json", "no_such_module_anywhere").missing
    assert line is not None
    assert "no_such_module_anywhere not importable; pip install its-package" in line


def test_what_is_left_out_is_said_below_a_table() -> None:
    table = Table("Peers", ("peer", "time"), [], "How to read it.", ["it: not measured"])
    assert table.markdown() == "## Peers\n\nHow to read it.\n\n- it: not measured\n"
    full = Table("Peers", ("peer", "time"), [("it", "1 s")], remarks=["other: not measured"])
    assert full.markdown(3) == (
        "### Peers\n\n| peer | time |\n|---|---|\n| it | 1 s |\n\n- other: not measured\n"
    )


def test_settings_give_their_command() -> None:
    assert ScaleSettings().command() == "hzmp-sim bench scale"
    settings = ScaleSettings(quick=True, peer_time=3.0, seed=2)
    assert settings.command(Path("x y")) == (
        "hzmp-sim bench scale --quick --seed 2 --peer-time 3.0 --out 'x y'"
    )
    assert asdict(settings)["counts"] is None
