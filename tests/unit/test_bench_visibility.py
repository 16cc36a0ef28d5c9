"""The visibility graph of the benchmarks: optima of scenes, and cases known by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hzmp_planners.planning.result import path_length
from hzmp_sim.bench.boxes.laws import PIECES, maze, random_boxes, set_piece
from hzmp_sim.bench.boxes.recheck import recheck
from hzmp_sim.bench.boxes.scene import BoxScene, read_scenes
from hzmp_sim.bench.boxes.visibility import shortest_path
from oracles import World as ConvexWorld
from oracles import shortest_length

SCENES = Path(__file__).resolve().parents[1] / "data" / "scenes"
PLANAR = {scene.name: scene for scene in read_scenes(SCENES) if scene.n == 2}


def solve(scene: BoxScene) -> float:
    """Length of the shortest path, which is re-checked; inf without one."""
    path = shortest_path(scene.lo, scene.hi, scene.low, scene.high, scene.start, scene.goal)
    if path is None:
        return math.inf
    true = recheck(path.tolist(), scene.obstacles(), (scene.lo, scene.hi), scene.start, scene.goal)
    assert true.depth == 0.0
    assert true.end_error == 0.0
    assert true.length == pytest.approx(path_length(path), rel=1e-14)
    return true.length


def among(*boxes: tuple[list[float], list[float]]) -> BoxScene:
    """Boxes in the unit square, from (0.1, 0.5) to (0.9, 0.5)."""
    low, high = (np.array([box[end] for box in boxes]).reshape(-1, 2) for end in (0, 1))
    ends = np.array([0.1, 0.5]), np.array([0.9, 0.5])
    return BoxScene("boxes", "boxes", np.zeros(2), np.ones(2), low, high, *ends)


@pytest.mark.parametrize("name", [name for name, scene in PLANAR.items() if scene.optimum])
def test_cost_is_the_optimum_of_the_scene(name: str) -> None:
    scene = PLANAR[name]
    # The files' optima keep a ten-millionth away from the obstacles.
    assert solve(scene) == pytest.approx(scene.optimum, rel=1e-6)


@pytest.mark.parametrize("name", [name for name in PIECES[2] if f"{name}_2d" in PLANAR])
def test_set_pieces_are_those_of_the_files(name: str) -> None:
    assert solve(set_piece(name, 2)) == pytest.approx(PLANAR[f"{name}_2d"].optimum, rel=1e-6)


@pytest.mark.parametrize("scene", [*(random_boxes(2, 20, seed) for seed in range(8)), maze(5, 1)])
def test_cost_is_that_of_the_tests_own_graph(scene: BoxScene) -> None:
    world = ConvexWorld(scene.lo, scene.hi, scene.obstacles())
    expected = shortest_length(world, scene.start, scene.goal)
    assert solve(scene) == pytest.approx(expected, rel=1e-7)


def test_paths_known_by_hand() -> None:
    assert solve(among()) == pytest.approx(0.8, rel=1e-15)
    # Around the square, by its upper or lower corners.
    around = among(([0.4, 0.4], [0.6, 0.6]))
    assert solve(around) == pytest.approx(2.0 * math.hypot(0.3, 0.1) + 0.2, rel=1e-8)
    # Along the wall of the workspace, which is free.
    hanging = among(([0.4, 0.0001], [0.6, 1.0]))
    assert solve(hanging) == pytest.approx(2.0 * math.hypot(0.3, 0.4999) + 0.2, rel=1e-8)


def test_boxes_that_touch_leave_no_way_between() -> None:
    closed = among(([0.4, -1.0], [0.6, 0.5]), ([0.4, 0.5], [0.6, 2.0]))
    assert math.isinf(solve(closed))
    ajar = among(([0.4, -1.0], [0.6, 0.5]), ([0.4, 0.5 + 1e-7], [0.6, 2.0]))
    assert solve(ajar) == pytest.approx(0.8, rel=1e-6)
    # A corner to a corner: no way through the point.
    corners = among(
        ([0.4, -1.0], [0.5, 0.5]), ([0.5, 0.5], [0.6, 2.0]), ([0.3, 0.9], [0.55, 2.0]),
        ([0.45, -1.0], [0.7, 0.1]),
    )  # fmt: skip
    assert solve(corners) > 0.9
