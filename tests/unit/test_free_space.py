from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from hzmp_planners.errors import ShapeError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from oracles import (
    World,
    depth_in_obstacles,
    free_box_volume,
    halfspace_volume,
    overlap,
    random_world,
    union_volume,
)

GRID = [(n, size, seed) for n in (2, 3) for size in (1e-2, 1.0, 1e3) for seed in range(4)]
OBLIQUE = [
    (kind, n, size)
    for kind in ("rotated", "hulls", "slivers", "loose grid")
    for n in (2, 3)
    for size in (1e-2, 1.0, 1e3)
]


def box(*corners: list[float]) -> Polytope:
    return Polytope.from_box(*corners)


def check_leaves(world: World, space: FreeSpace) -> None:
    """Leaves are apart from each other and from obstacles, and their two forms are one set."""
    tol = 1e-8 * world.scale
    hulls = [leaf.interval_hull() for leaf in space.leaves]
    meets = [
        (i, j)
        for i, j in combinations(range(len(hulls)), 2)
        if (hulls[i][0] < hulls[j][1]).all() and (hulls[j][0] < hulls[i][1]).all()
    ]
    for i, j in meets:
        assert overlap(space.leaves[i], space.leaves[j]) <= tol
    for leaf, (lo, hi) in zip(space.leaves, hulls, strict=True):
        for block in world.obstacles:
            low, high = block.interval_hull()
            if (low < hi).all() and (lo < high).all():
                assert overlap(leaf, block) <= tol
        assert leaf.violation(leaf.vertices()).max() <= tol
        assert halfspace_volume(leaf.A, leaf.b) == pytest.approx(
            leaf.volume(), rel=1e-6, abs=float(tol * np.prod(world.hi - world.lo) / world.scale)
        )
    columns = space.incidence.toarray().T
    assert all(
        np.array_equal(space.vertices[column], leaf.vertices())
        for column, leaf in zip(columns, space.leaves, strict=True)
    )


def check_membership(world: World, space: FreeSpace, rng: np.random.Generator) -> None:
    """Points are in the free space iff they are in no obstacle's interior."""
    points = world.lo + (world.hi - world.lo) * rng.random((600, world.n))
    depth = depth_in_obstacles(world, points)
    clear = np.abs(depth) > 1e-8 * world.scale
    assert (space.contains(points) == (depth < 0.0))[clear].all()
    outside = world.lo - 1e-3 * (world.hi - world.lo)
    assert not space.contains(outside).any()


@pytest.mark.parametrize(("n", "size", "seed"), GRID)
def test_boxes_on_a_grid(n: int, size: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = random_world(rng, "grid", n, 7, size)
    space = world.free_space()
    assert space.volume == pytest.approx(free_box_volume(world), rel=1e-6, abs=1e-9 * size**n)
    check_leaves(world, space)
    check_membership(world, space, rng)


@pytest.mark.parametrize(("kind", "n", "size"), OBLIQUE)
def test_oblique_obstacles(kind: str, n: int, size: float) -> None:
    rng = np.random.default_rng(17 * n + len(kind))
    world = random_world(rng, kind, n, 6, size)
    space = world.free_space()
    free = np.prod(world.hi - world.lo) - union_volume(world)
    assert space.volume == pytest.approx(free, rel=1e-6)
    check_leaves(world, space)
    check_membership(world, space, rng)


def test_many_worlds_keep_their_volume() -> None:
    rng = np.random.default_rng(2)
    for trial in range(60):
        kind = ("grid", "rotated", "hulls", "slivers")[trial % 4]
        n = 2 + trial % 3 % 2
        size = 10.0 ** rng.uniform(-2.0, 3.0)
        world = random_world(rng, kind, n, 4, size)
        free = np.prod(world.hi - world.lo) - union_volume(world)
        volume = world.free_space().volume
        assert volume == pytest.approx(free, rel=1e-6, abs=1e-9 * size**n), trial


def test_the_order_of_obstacles_does_not_change_the_set() -> None:
    rng = np.random.default_rng(4)
    world = random_world(rng, "rotated", 3, 6)
    points = rng.random((500, 3))
    expected = world.free_space().contains(points)
    for _ in range(3):
        order = rng.permutation(6)
        other = World(world.lo, world.hi, [world.obstacles[i] for i in order]).free_space()
        assert (other.contains(points) == expected).all()


@pytest.mark.parametrize("n", [2, 3])
def test_nothing_in_the_way_is_one_leaf(n: int) -> None:
    lo, hi = -np.ones(n), 2.0 * np.ones(n)
    outside = [Polytope.from_box(hi, hi + 1.0), Polytope.from_box(hi + 1.0, hi + 2.0)]
    flat = [Polytope.from_box(np.zeros(n), np.append(0.0, np.ones(n - 1)))]
    point = [Polytope.from_vertices(np.zeros((1, n)))]
    empty = [Polytope.from_halfspaces(np.vstack([np.eye(n), -np.eye(n)]), -np.ones(2 * n))]
    for obstacles in ([], outside, flat, point, empty, outside + flat + point + empty):
        space = FreeSpace.decompose((lo, hi), obstacles)
        assert len(space.leaves) == 1
        assert space.vertices.shape == (2**n, n)
        assert space.volume == pytest.approx(3.0**n)
        assert space.contains(np.zeros(n)).all()
        assert space.graph.faces == ()


@pytest.mark.parametrize("n", [2, 3])
def test_nothing_free_is_no_leaf(n: int) -> None:
    lo, hi = np.zeros(n), np.ones(n)
    low, high = np.zeros(n), np.ones(n)
    low[0] = high[0] = 0.4
    halves = [Polytope.from_box(lo, np.append(0.4, hi[1:])), Polytope.from_box(low, hi)]
    for obstacles in ([Polytope.from_box(lo, hi)], [Polytope.from_box(lo - 1, hi + 1)], halves):
        space = FreeSpace.decompose((lo, hi), obstacles)
        assert space.leaves == ()
        assert space.vertices.shape == (0, n)
        assert space.incidence.shape == (0, 0)
        assert space.volume == 0.0
        assert not space.contains(0.5 * (lo + hi)).any()
        assert space.leaves_at(0.5 * (lo + hi)).size == 0
        assert space.graph.faces == ()
        assert space.graph.components.size == 0


@pytest.mark.parametrize("room", [5e-11, 2e-10, 5e-10, 3e-9, 1e-6])
@pytest.mark.parametrize("n", [2, 3])
def test_a_corner_left_over_of_any_size_does_no_harm(n: int, room: float) -> None:
    """Obstacles that fill the workspace, or nearly: leaves at the limit of the tolerances."""
    A = np.vstack([np.ones((1, n)), -np.eye(n)])
    lo, hi = -np.ones(n), np.ones(n)
    block = Polytope.from_halfspaces(A, np.append(n - room, np.full(n, 3.0)))
    quadrant = Polytope.from_halfspaces(A, np.append(n - room, np.zeros(n)))
    assert FreeSpace.decompose((lo, hi), [block]).volume <= 2.0 * room**n
    space = FreeSpace.decompose((lo, hi), [quadrant])
    assert space.volume == pytest.approx(2.0**n - 1.0, rel=1e-8)
    assert not space.contains(np.full(n, 0.5)).any()
    assert space.contains(np.full(n, -0.5)).all()
    assert len(space.leaves) == space.incidence.shape[1] == len(space.graph.components)


def test_planes_that_agree_up_to_round_off_leave_no_crack() -> None:
    rng = np.random.default_rng(6)
    for n in (2, 3):
        for _ in range(10):
            cut = 0.3 + 1e-13 * rng.standard_normal(4)
            below = [box([-1.0] * n, [c, *[0.6] * (n - 1)]) for c in cut[:2]]
            above = [box([c, *[-1.0] * (n - 1)], [2.0, *[0.6] * (n - 1)]) for c in cut[2:]]
            space = FreeSpace.decompose((np.zeros(n), np.ones(n)), below + above)
            assert space.volume == pytest.approx(1.0 - 0.6 ** (n - 1) if n == 2 else 0.64)
            crack = np.full(n, 0.2)
            crack[0] = 0.3
            assert not space.contains(crack).any()


@pytest.mark.parametrize(
    ("bounds", "obstacles", "words"),
    [
        (([0.0, 0.0], [1.0]), [], "2 or 3 coordinates"),
        (([0.0], [1.0]), [], "2 or 3 coordinates"),
        (([0.0] * 4, [1.0] * 4), [], "2 or 3 coordinates"),
        (([0.0, 2.0], [1.0, 1.0]), [], "axis 1"),
        (([0.0, 1.0], [1.0, 1.0]), [], "axis 1"),
        (([0.0, np.nan], [1.0, 1.0]), [], "finite"),
        (([0.0, 0.0], [1.0, 1.0]), [box([0.0] * 3, [1.0] * 3)], "obstacle 0 has dimension 3"),
        (([0, 0], [1, 1]), [Polytope.from_halfspaces([[1.0, 0.0]], [0.5])], "unbounded"),
    ],
)
def test_bad_input_is_one_clear_line(
    bounds: tuple[list[float], list[float]], obstacles: list[Polytope], words: str
) -> None:
    with pytest.raises(ShapeError, match=words) as caught:
        FreeSpace.decompose(bounds, obstacles)
    assert "\n" not in str(caught.value)


def test_nobody_can_change_what_was_decomposed() -> None:
    space = random_world(np.random.default_rng(0), "rotated", 2, 2).free_space()
    face = space.graph.faces[0]
    for array in (
        *space.bounds, space.vertices, space.incidence.data, space.incidence.indices,
        space.leaves[0].A, space.leaves[0].vertices(), face.vertices, face.normal,
    ):  # fmt: skip
        assert not array.flags.writeable
