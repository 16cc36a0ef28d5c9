"""The exact re-check of paths, and the edge checks that OMPL calls, in the benchmarks."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hzmp_planners.sets import Polytope
from hzmp_sim.bench.boxes.recheck import depth_in, recheck
from hzmp_sim.bench.peers.ompl.edges import (
    edge_is_free,
    spatial_boxes,
    state_is_free,
    states_are_free,
)
from oracles import largest_ball, rotation

UNIT = np.zeros(2), np.ones(2)
SQUARE = Polytope.from_box([0.4, 0.4], [0.6, 0.6])


@pytest.mark.parametrize(
    ("path", "depth"),
    [
        ([[0.0, 0.0], [1.0, 0.0]], 0.0),
        ([[0.0, 0.4], [1.0, 0.4]], 0.0),  # along its side
        ([[0.3, 0.5], [0.5, 0.3]], 0.0),  # past its corner: x + y = 0.8
        ([[0.0, 0.5], [1.0, 0.5]], 0.1),  # through the middle
        ([[0.0, 0.41], [1.0, 0.41]], 0.01),
        ([[0.0, 0.0], [1.0, 1.0]], 0.1),
        ([[0.3, 0.51], [0.51, 0.3]], 0.005),  # cuts the corner: deepest at (0.405, 0.405)
        ([[0.45, 0.5], [0.47, 0.5]], 0.07),  # inside from end to end
        ([[0.5, 0.5], [0.5, 0.5]], 0.1),  # a point
        ([[0.0, 0.0], [0.0, 1.0], [0.45, 0.55], [0.0, 1.0]], 0.05),  # a corner of the path
    ],
)
def test_depth_in_a_square(path: list[list[float]], depth: float) -> None:
    assert depth_in(np.array(path), SQUARE) == pytest.approx(depth, abs=1e-15)


def test_depth_is_the_largest_among_points_of_the_path() -> None:
    rng = np.random.default_rng(0)
    for n in (2, 3):
        for _ in range(30):
            turned = rng.uniform(-1.0, 1.0, (n + 5, n)) @ rotation(rng, n).T
            block = Polytope.from_vertices(turned)
            path = rng.uniform(-1.2, 1.2, (4, n))
            found = depth_in(path, block)
            t = np.linspace(0.0, 1.0, 2001)[:, None]
            dense = np.vstack([p + t * (q - p) for p, q in pairwise(path)])
            depths = (block.b - dense @ block.A.T).min(axis=1)
            assert found >= max(0.0, float(depths.max())) - 1e-14
            assert found <= max(0.0, float(depths.max())) + 2e-3
            assert found <= largest_ball(block.A, block.b)[0] + 1e-12


def test_recheck_measures_length_ends_and_what_is_outside() -> None:
    start, goal = np.array([0.1, 0.1]), np.array([0.9, 0.1])
    good = recheck([[0.1, 0.1], [0.9, 0.1]], [SQUARE], UNIT, start, goal)
    assert good.length == pytest.approx(0.8)
    assert (good.depth, good.end_error) == (0.0, 0.0)
    astray = recheck([[0.1, 0.1], [0.5, -0.2], [0.9, 0.2]], [SQUARE], UNIT, start, goal)
    assert astray.depth == pytest.approx(0.2)
    assert astray.end_error == pytest.approx(0.1)


# --- the checks that OMPL calls -------------------------------------------------------------------


def ask(check: str, p: list[float], q: list[float], resolution: float = 1e-3) -> tuple[bool, int]:
    """Verdict on a segment beside the square, extruded, and how many states it took."""
    counts = np.zeros(2, dtype=np.int64)
    boxes = spatial_boxes(np.array([[0.4, 0.4]]), np.array([[0.6, 0.6]]))
    function = edge_is_free if check == "exact" else states_are_free
    free = function(p[0], p[1], 0.0, q[0], q[1], 0.0, boxes, resolution, counts)
    assert counts[0] == 1
    return free, int(counts[1])


@pytest.mark.parametrize(
    ("p", "q", "exact", "by_states"),
    [
        ([0.0, 0.0], [1.0, 0.0], True, True),
        ([0.0, 0.5], [1.0, 0.5], False, False),
        ([0.0, 0.4], [1.0, 0.4], True, False),  # along its side: open and closed boxes differ
        ([0.5, 0.0], [0.5, 0.4], True, False),  # up to its side
        ([0.5, 0.0], [0.5, 0.39], True, True),
        ([0.3, 0.5001], [0.5001, 0.3], False, True),  # cuts the corner between two states
        ([0.2, 0.2], [0.2, 0.2], True, True),
    ],
)
def test_edges_beside_a_square(
    p: list[float], q: list[float], exact: bool, by_states: bool
) -> None:
    assert ask("exact", p, q) == (exact, 0)
    assert ask("states", p, q)[0] == by_states


@pytest.mark.parametrize("parts", [1, 2, 3, 4, 5, 7, 8, 9, 100])
def test_every_state_of_a_free_edge_is_checked_once(parts: int) -> None:
    free, states = ask("states", [0.0, 0.1], [1.0, 0.1], 1.0 / (parts - 0.5))
    assert free
    assert states == parts
    # A box around any one of the states is found.
    for number in range(1, parts + 1):
        x = number / parts
        boxes = spatial_boxes(np.array([[x - 1e-6, 0.0]]), np.array([[x + 1e-6, 0.2]]))
        counts = np.zeros(2, dtype=np.int64)
        assert not states_are_free(0.0, 0.1, 0.0, 1.0, 0.1, 0.0, boxes, 1.0 / (parts - 0.5), counts)


def test_exact_check_and_recheck_agree() -> None:
    rng = np.random.default_rng(1)
    for _ in range(300):
        low = rng.uniform(0.0, 0.8, (3, 3))
        high = low + rng.uniform(0.05, 0.4, (3, 3))
        p, q = rng.uniform(0.0, 1.0, (2, 3)).tolist()
        blocks = [Polytope.from_box(*ends) for ends in zip(low, high, strict=True)]
        depth = max(depth_in(np.array([p, q]), block) for block in blocks)
        counts = np.zeros(2, dtype=np.int64)
        boxes = spatial_boxes(low, high)
        free = edge_is_free(p[0], p[1], p[2], q[0], q[1], q[2], boxes, 1.0, counts)
        assert free == (depth == 0.0)


def test_single_states() -> None:
    boxes = spatial_boxes(np.array([[0.4, 0.4]]), np.array([[0.6, 0.6]]))
    counts = np.zeros(2, dtype=np.int64)
    assert state_is_free(0.1, 0.5, 0.0, boxes, counts)
    assert not state_is_free(0.5, 0.5, 0.0, boxes, counts)
    assert counts.tolist() == [0, 2]


def test_wrong_paths_of_ours_are_named() -> None:
    wall = Polytope.from_box((0.4, 0.0), (0.6, 0.5))
    start, goal = np.array([0.1, 0.2]), np.array([0.9, 0.2])
    around = [(0.1, 0.2), (0.4, 0.5), (0.6, 0.5), (0.9, 0.2)]
    free = recheck(around, [wall], UNIT, start, goal)
    assert free.defects(free.length, size=1.0) == []
    assert ["long" in line for line in free.defects(free.length + 1e-3, size=1.0)] == [True]
    through = recheck([(0.1, 0.2), (0.9, 0.3)], [wall], UNIT, start, goal)
    deep, off = through.defects(through.length, size=1.0)
    assert "0.1 m inside" in deep
    assert "0.1 m from start or goal" in off
