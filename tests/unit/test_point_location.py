"""`leaf_of` by the cuts, against a test of every leaf."""

from __future__ import annotations

import numpy as np
import pytest

from hzmp_planners.errors import ShapeError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from oracles import Floats, random_world

KINDS = [(kind, n) for kind in ("grid", "rotated", "hulls", "slivers") for n in (2, 3)]


def holders(space: FreeSpace, X: Floats) -> list[set[int]]:
    tol = 1e-9 * space.scale
    held = np.array([leaf.violation(X) <= tol for leaf in space.leaves]).reshape(-1, len(X))
    return [set(np.flatnonzero(column).tolist()) for column in held.T]


@pytest.mark.parametrize(("kind", "n"), KINDS)
def test_every_point_is_in_the_leaf_that_is_found(kind: str, n: int) -> None:
    rng = np.random.default_rng(n)
    world = random_world(rng, kind, n, 8, 10.0 ** rng.uniform(-3, 3))
    disjoint = world.free_space()
    for space in (disjoint, disjoint.overlapping()):
        points = world.lo + (world.hi - world.lo) * rng.uniform(-0.1, 1.1, (300, n))
        on_faces = [face.vertices.mean(axis=0) for face in space.graph.faces[:60]]
        points = np.vstack([points, *on_faces, space.vertices[:60]])
        expected = holders(space, points)
        found = space.leaf_of(points)
        assert found.tolist() == [min(leaves, default=-1) for leaves in expected]
        assert np.array_equal(space.contains(points), found >= 0)
        for point, leaves in zip(points, expected, strict=True):
            assert space.leaves_at(point).tolist() == sorted(leaves)


def test_points_after_updates() -> None:
    rng = np.random.default_rng(1)
    world, other = (random_world(rng, "rotated", 3, 8) for _ in range(2))
    space = world.free_space()
    for _ in range(3):
        moved = {int(i): other.obstacles[int(i)] for i in rng.choice(8, 3, replace=False)}
        space = space.with_obstacles(moved).with_obstacles(other.obstacles[:1])
        space = space.with_obstacles({len(space.obstacles) - 1: None})
        points = rng.random((300, 3))
        assert space.leaf_of(points).tolist() == [
            min(leaves, default=-1) for leaves in holders(space, points)
        ]


def test_no_points_and_bad_points() -> None:
    space = FreeSpace.decompose(([0, 0], [1, 1]), [Polytope.from_box([0.2, 0.2], [0.4, 0.4])])
    assert space.leaf_of(np.zeros((0, 2))).shape == (0,)
    assert space.leaf_of([0.3, 0.3]).tolist() == [-1]
    assert space.leaf_of([5.0, 5.0]).tolist() == [-1]
    with pytest.raises(ShapeError, match="2 columns"):
        space.leaf_of([[0.1, 0.2, 0.3]])
    with pytest.raises(ShapeError, match="finite"):
        space.leaf_of([[0.1, np.nan]])
