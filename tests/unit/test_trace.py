from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from oracles import random_world


def two_squares_that_touch() -> FreeSpace:
    squares = [Polytope.from_box((0, 0), (1, 1)), Polytope.from_box((1, 1), (2, 2))]
    return FreeSpace.decompose(((-1, -1), (3, 3)), squares)


@pytest.mark.parametrize("n", [2, 3])
def test_free_segments_are_those_that_meet_no_obstacle(n: int) -> None:
    rng = np.random.default_rng(n)
    free = blocked = 0
    for _ in range(6):
        world = random_world(rng, "hulls", n, 8)
        space = world.free_space()
        shares = np.linspace(0.0, 1.0, 400)[:, None]
        for p, q in rng.uniform(world.lo, world.hi, (40, 2, n)):
            inside = [block.violation(p + shares * (q - p)).min() for block in world.obstacles]
            traced = space.trace([p, q])
            if min(inside) < -1e-6:
                assert traced is None
                blocked += 1
            elif min(inside) > 1e-2:  # between two samples it cannot be inside either
                assert traced is not None
                free += 1
            if traced is None:
                continue
            points, leaves = traced
            assert np.array_equal(points[[0, -1]], [p, q])
            assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(
                np.linalg.norm(q - p)
            )
            for segment, leaf in zip(pairwise(points), leaves.tolist(), strict=True):
                assert space.leaf(leaf).violation(np.array(segment)).max() <= 1e-8
            assert all(i != j for i, j in pairwise(leaves.tolist()))
    assert free > 10
    assert blocked > 10


def test_a_polyline_keeps_its_corners() -> None:
    space = two_squares_that_touch()
    corners = np.array([[-0.5, 0.5], [-0.5, 1.5], [0.5, 1.5]])
    traced = space.trace(corners)
    assert traced is not None
    points, leaves = traced
    assert len(points) == len(leaves) + 1
    assert all((np.abs(points - corner).max(axis=1) < 1e-12).any() for corner in corners)


def test_where_obstacles_touch_nothing_passes() -> None:
    space = two_squares_that_touch()
    assert space.trace([(0.5, 1.5), (1.5, 0.5)]) is None
    assert space.trace([(0.5, 1.5), (1.0, 1.0)]) is not None


def test_along_walls_and_on_one_spot() -> None:
    space = two_squares_that_touch()
    assert space.trace([(-1, -1), (3, -1)]) is not None  # the workspace's wall
    assert space.trace([(0, 0), (1, 0)]) is not None  # a side of an obstacle
    still = space.trace([(-0.5, 0.5), (-0.5, 0.5)])
    assert still is not None
    assert len(still[1]) == 1
    assert space.trace([(0.5, 0.5), (0.5, 0.5)]) is None
    assert space.trace([(-0.5, 0.5)]) is None
