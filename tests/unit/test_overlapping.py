"""Overlapping maximal leaves: the same set, maximal leaves, doors that lose no way through."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import PlanStatus, plan, verify
from hzmp_planners.sets import Polytope
from oracles import load_scene, overlap, random_world

WORLDS = [
    (kind, n, size) for kind in ("grid", "rotated", "hulls") for n, size in ((2, 1.0), (3, 50.0))
]


@pytest.mark.parametrize(("kind", "n", "size"), WORLDS)
def test_the_same_set_in_fewer_leaves(kind: str, n: int, size: float) -> None:
    rng = np.random.default_rng(n + len(kind))
    world = random_world(rng, kind, n, 6, size)
    disjoint = world.free_space()
    space = disjoint.overlapping()
    tol = 1e-8 * world.scale
    assert disjoint.disjoint
    assert not space.disjoint
    assert space.overlapping() is space
    assert len(space) <= len(disjoint)
    assert space.volume == disjoint.volume
    points = world.lo + (world.hi - world.lo) * rng.random((1000, n))
    assert np.array_equal(space.contains(points), disjoint.contains(points))
    for leaf in space.leaves:
        assert leaf.violation(leaf.vertices()).max() <= tol
        assert all(overlap(leaf, block) <= tol for block in space.obstacles)
    # No leaf is superfluous: each disjoint leaf is in one of them, and each is needed for one.
    inside = np.array(
        [
            [big.violation(small.vertices()).max() <= tol for small in disjoint.leaves]
            for big in space.leaves
        ]
    )
    assert inside.any(axis=0).all()
    assert all((inside.sum(axis=0)[row] == 1).any() for row in inside)


@pytest.mark.parametrize(("kind", "n", "size"), WORLDS)
def test_leaves_are_maximal(kind: str, n: int, size: float) -> None:
    """Moved out by a thousandth, every facet meets an obstacle or the workspace wall."""
    world = random_world(np.random.default_rng(n), kind, n, 4, size)
    space = world.free_space().overlapping()
    eye = np.eye(n)
    walls = (np.vstack([eye, -eye]), np.append(world.hi, -world.lo))
    for leaf in space.leaves:
        for j in range(len(leaf.b)):
            if any(
                np.allclose(leaf.A[j], a) and np.isclose(leaf.b[j], c)
                for a, c in zip(*walls, strict=True)
            ):
                continue
            wider = leaf.b.copy()
            wider[j] += 1e-3 * size
            body = Polytope(np.vstack([leaf.A, walls[0]]), np.append(wider, walls[1]))
            assert max(overlap(body, block) for block in space.obstacles) > 1e-9 * size


@pytest.mark.parametrize(("kind", "n", "size"), WORLDS)
def test_doors_lie_in_both_leaves_and_connect_what_is_connected(
    kind: str, n: int, size: float
) -> None:
    world = random_world(np.random.default_rng(3 * n), kind, n, 6, size)
    disjoint = world.free_space()
    space = disjoint.overlapping()
    tol = 1e-8 * world.scale
    for face in space.graph.faces:
        for leaf in face.leaves:
            assert space.leaf(leaf).violation(face.vertices).max() <= tol
        assert np.abs(face.vertices @ face.normal - face.offset).max() <= tol
    doors = {tuple(sorted(ends)) for ends in space.graph.ends.tolist()}
    for i, j in combinations(range(len(space)), 2):
        if overlap(space.leaf(i), space.leaf(j)) > 1e-6 * size:
            assert (i, j) in doors
    for x in world.lo + (world.hi - world.lo) * np.random.default_rng(0).random((40, n)):
        one, two = disjoint.leaves_at(x), space.leaves_at(x)
        assert bool(len(one)) == bool(len(two))
    assert len(set(space.graph.components)) == len(set(disjoint.graph.components))


@pytest.mark.parametrize(
    "name",
    [
        "random_2d_s000",
        "random_2d_s010",
        "maze2d_5",
        "narrow_passage_3d",
        "random_3d_s004",
        "dividing_walls_3d",
    ],
)
def test_the_planner_finds_the_same_optimum(name: str) -> None:
    scene = load_scene(name)
    disjoint = scene.free_space()
    space = disjoint.overlapping()
    best = plan(disjoint, scene.start, scene.goal, time_limit=20.0)
    result = plan(space, scene.start, scene.goal, time_limit=20.0, gap=2e-3)
    assert best.status is result.status is PlanStatus.OPTIMAL
    assert result.cost <= best.cost * (1.0 + 2e-3)
    assert result.lower_bound <= best.cost * (1.0 + 1e-9)
    assert len(result.leaves) <= len(best.leaves)
    assert verify(result).ok, verify(result).describe()
    assert len(result.cells(space)) == len(result.leaves)


def test_a_closed_room_stays_closed() -> None:
    walls = [
        Polytope.from_box([1.0, 1.0], [2.0, 1.1]), Polytope.from_box([1.0, 1.9], [2.0, 2.0]),
        Polytope.from_box([1.0, 1.0], [1.1, 2.0]), Polytope.from_box([1.9, 1.0], [2.0, 2.0]),
    ]  # fmt: skip
    space = FreeSpace.decompose(([0, 0], [3, 3]), walls).overlapping()
    result = plan(space, [1.5, 1.5], [0.5, 0.5])
    assert result.status is PlanStatus.INFEASIBLE
    assert verify(result).ok
    opened = space.with_obstacles({3: None})
    assert not opened.disjoint
    assert plan(opened, [1.5, 1.5], [0.5, 0.5]).status is PlanStatus.OPTIMAL


@pytest.mark.parametrize("n", [2, 3])
def test_no_leaf_and_one_leaf(n: int) -> None:
    lo, hi = np.zeros(n), np.ones(n)
    nothing = FreeSpace.decompose((lo, hi), [Polytope.from_box(lo, hi)]).overlapping()
    assert len(nothing) == len(nothing.graph) == 0
    assert not nothing.contains(0.5 * hi).any()
    whole = FreeSpace.decompose((lo, hi)).overlapping()
    assert len(whole) == 1
    assert whole.leaf_of(0.5 * hi).tolist() == [0]
