from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Plan, PlanStatus, plan, verify
from hzmp_planners.sets import Polytope
from oracles import (
    Floats,
    Scene,
    World,
    load_scene,
    overlap,
    random_free_points,
    random_world,
    shortest_length,
)

LONG = 60.0  # [s] on a machine that does other work: no verdict may depend on the clock


def check(result: Plan, gap: float = 1e-3) -> None:
    """What holds for every plan with a path."""
    space, tol = result.space, 1e-8 * result.space.scale
    points, leaves = result.waypoints, result.leaves.tolist()
    assert result.status is PlanStatus.OPTIMAL
    assert result.gap <= gap
    assert result.lower_bound <= result.cost
    assert np.array_equal(points[0], result.start)
    assert np.array_equal(points[-1], result.goal)
    assert len(points) == len(leaves) + 1
    assert len(set(leaves)) == len(leaves)
    assert result.cost == pytest.approx(sum(math.dist(p, q) for p, q in pairwise(points)))
    for (p, q), leaf in zip(pairwise(points), leaves, strict=True):
        assert space.leaves[leaf].violation([p, q]).max() <= tol
    faces = {frozenset(face.leaves) for face in space.graph.faces}
    assert all(frozenset(pair) in faces for pair in pairwise(leaves))
    check_history(result)
    cells = result.cells(space)
    assert len(cells) == len(leaves)
    for (p, q), cell, leaf in zip(pairwise(points), cells, leaves, strict=True):
        assert cell.violation([p, q]).max() <= tol
        assert cell.violation(space.leaves[leaf].vertices()).max() <= tol
        lo, hi = cell.interval_hull()
        for block, (low, high) in zip(space.obstacles, space.obstacle_boxes, strict=True):
            if (low < hi).all() and (lo < high).all():
                assert overlap(cell, block) <= tol
    assert all(overlap(one, two) >= -tol for one, two in pairwise(cells))
    report = verify(result)
    assert report.ok, report.describe()


def check_history(result: Plan) -> None:
    times, costs, bounds = np.array(result.history).T
    assert (np.diff(times) >= 0.0).all()
    assert (times >= 0.0).all()
    with np.errstate(invalid="ignore"):
        fewer = costs[1:] < costs[:-1]
        more = bounds[1:] > bounds[:-1]
    assert (costs[1:] <= costs[:-1]).all()
    assert (bounds[1:] >= bounds[:-1]).all()
    assert (fewer | more).all()
    assert (costs[-1], bounds[-1]) == (result.cost, result.lower_bound)


def check_against(result: Plan, optimum: float, gap: float = 1e-3) -> None:
    check(result, gap)
    assert result.lower_bound <= optimum + 1e-9 * result.space.scale
    assert result.cost >= optimum - 1e-9 * result.space.scale
    assert result.cost <= optimum * (1.0 + gap)


@pytest.mark.parametrize("kind", ["rotated", "hulls", "slivers"])
@pytest.mark.parametrize("seed", range(4))
def test_plane_worlds_against_a_visibility_graph(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = (1.0, 1e-2, 1e3, 10.0)[seed]
    world = random_world(rng, kind, 2, 9 if kind != "slivers" else 14, size)
    space = world.free_space()
    for _ in range(3):
        start, goal = random_free_points(rng, world, 2)
        optimum = shortest_length(world, start, goal)
        result = plan(space, start, goal, time_limit=LONG)
        if math.isinf(optimum):
            assert result.status is PlanStatus.INFEASIBLE
            assert verify(result).ok
        else:
            check_against(result, optimum)


@pytest.mark.parametrize("gap", [1e-2, 1e-3, 1e-4, 1e-5])
def test_any_gap_that_is_asked_for_is_met(gap: float) -> None:
    rng = np.random.default_rng(2)
    world = random_world(rng, "rotated", 2, 7)
    space = world.free_space()
    for start, goal in random_free_points(rng, world, 6).reshape(3, 2, 2):
        optimum = shortest_length(world, start, goal)
        assert math.isfinite(optimum)
        check_against(plan(space, start, goal, time_limit=LONG, gap=gap), optimum, gap)


SCENES = [
    "four_rooms_2d", "narrow_passage_2d", "wall_gap_2d", "random_2d_s000", "random_2d_s010",
    "dividing_walls_3d", "random_3d_s004",
]  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_scenes_with_a_known_optimum(name: str) -> None:
    scene = load_scene(name)
    result = plan(scene.free_space(), scene.start, scene.goal, time_limit=LONG)
    check(result)
    # The optimum on file keeps 1e-7 off the boxes, so it is a little longer.
    assert result.lower_bound <= scene.cost + 1e-9
    assert scene.cost * (1.0 - 1e-5) <= result.cost <= scene.cost * 1.001


@pytest.mark.parametrize("name", ["center_square_3d", "goal_enclosure_3d", "random_3d_s003"])
def test_bounds_in_space_never_exceed_the_best_known_path(name: str) -> None:
    scene = load_scene(name)
    result = plan(scene.free_space(), scene.start, scene.goal, time_limit=LONG, gap=5e-3)
    check(result, 5e-3)
    assert result.lower_bound <= scene.cost + 1e-9
    assert result.cost <= scene.cost * 1.005


@pytest.mark.parametrize("seed", range(3))
def test_an_extruded_world_has_the_optimum_of_its_plan_view(seed: int) -> None:
    rng = np.random.default_rng(seed)
    flat = random_world(rng, "rotated", 2, 5)
    start, goal = random_free_points(rng, flat, 2)
    optimum = shortest_length(flat, start, goal)
    assert math.isfinite(optimum)
    tall = [
        Polytope.from_vertices(
            np.vstack(
                [np.column_stack([p.vertices(), np.full(len(p.vertices()), z)]) for z in (-1, 2)]
            )
        )
        for p in flat.obstacles
    ]
    space = FreeSpace.decompose(([0, 0, 0], [1, 1, 1]), tall)
    level = plan(space, [*start, 0.5], [*goal, 0.5], time_limit=LONG)
    check_against(level, optimum)
    # Climbing unrolls: the walls are vertical, so length is hypot(plan view, rise).
    steep = plan(space, [*start, 0.1], [*goal, 0.8], time_limit=LONG)
    check_against(steep, math.hypot(optimum, 0.7))


def room(n: int, wall: float = 0.2) -> list[Polytope]:
    """A closed room [1, 2]^n of boxes."""
    blocks = []
    for axis in range(n):
        for side in (1.0 - wall, 2.0):
            lo, hi = np.full(n, 1.0 - wall), np.full(n, 2.0 + wall)
            lo[axis], hi[axis] = side, side + wall
            blocks.append(Polytope.from_box(lo, hi))
    return blocks


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("world", ["room", "wall", "corner contact"])
def test_no_way_is_a_proof(n: int, world: str) -> None:
    lo, half, hi = np.zeros(n), np.full(n, 1.5), np.full(n, 3.0)
    if world == "room":
        blocks = room(n)
    elif world == "wall":
        blocks = [Polytope.from_box([1.4, *lo[1:] - 0.1], [1.6, *hi[1:]])]
    else:  # two parts of the workspace that meet in one corner or edge only
        blocks = [
            Polytope.from_box([0.0, 1.5, *lo[2:]], [1.5, 3.0, *hi[2:]]),
            Polytope.from_box([1.5, 0.0, *lo[2:]], [3.0, 1.5, *hi[2:]]),
        ]
        assert FreeSpace.decompose((lo, hi), blocks).contains(half).all()
    start, goal = (half * 0.5, half * 1.5) if world == "corner contact" else (hi * 0.5, hi * 0.95)
    if world == "wall":
        start = hi * 0.2
    result = plan(FreeSpace.decompose((lo, hi), blocks), start, goal, time_limit=LONG)
    assert result.status is PlanStatus.INFEASIBLE
    assert result.lower_bound == result.cost == math.inf
    assert result.gap == 0.0
    assert result.waypoints.shape == (0, n)
    assert result.leaves.size == 0
    assert result.cells(result.space) == []
    check_history(result)
    assert verify(result).ok


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize(("width", "passable"), [(1e-4, True), (1e-6, True), (0.0, False)])
def test_a_hairline_door_is_found_and_a_crack_is_none(n: int, width: float, passable: bool) -> None:
    blocks = [
        Polytope.from_box([0.4] + [-0.1] * (n - 1), [0.6, 0.7] + [1.1] * (n - 2)),
        Polytope.from_box([0.4, 0.7 + width] + [-0.1] * (n - 2), [0.6] + [1.1] * (n - 1)),
    ]
    space = FreeSpace.decompose(([0] * n, [1] * n), blocks)
    start, goal = [0.1] * n, [0.9, 0.1] + [0.1] * (n - 2)
    result = plan(space, start, goal, time_limit=LONG)
    if not passable:
        assert result.status is PlanStatus.INFEASIBLE
        assert verify(result).ok
        return
    # Over both edges of the door's lower jamb.
    optimum = 0.2 + 2.0 * math.hypot(0.3, 0.6)
    check_against(result, optimum)


def two_leaves() -> FreeSpace:
    return FreeSpace.decompose(([0, 0], [3, 2]), [Polytope.from_box([1, 1], [2, 2])])


def test_start_and_goal_in_one_leaf_are_joined_by_a_line() -> None:
    space = two_leaves()
    result = plan(space, [0.5, 0.5], [0.2, 0.9], gap=0.0)
    check(result, 0.0)
    assert len(result.waypoints) == 2
    same = plan(space, [0.5, 0.5], [0.5, 0.5], gap=0.0)
    assert (same.cost, same.lower_bound, same.gap) == (0.0, 0.0, 0.0)
    assert same.status is PlanStatus.OPTIMAL
    assert verify(same).ok


SPECIAL = {
    "on a shared face": [1.0, 0.5],
    "on a face's end": [1.0, 1.0],
    "on a corner of an obstacle": [2.0, 1.0],
    "on an obstacle's side": [1.0, 1.6],
    "in a corner of the workspace": [0.0, 2.0],
    "on the wall": [1.5, 0.0],
}


@pytest.mark.parametrize("where", SPECIAL)
def test_starts_on_boundaries(where: str) -> None:
    world = World(np.zeros(2), np.array([3.0, 2.0]), [Polytope.from_box([1, 1], [2, 2.1])])
    space = world.free_space()
    point = np.array(SPECIAL[where])
    for other in ([0.3, 1.8], [2.6, 1.8], [1.5, 0.4], [2.0, 1.5]):
        optimum = shortest_length(world, point, np.array(other))
        for start, goal in ((point, other), (other, point)):
            result = plan(space, start, goal, time_limit=LONG)
            check_against(result, optimum)
            steps = np.linalg.norm(np.diff(result.waypoints, axis=0), axis=1)
            assert steps.min() > 0.0, "a segment of no length"


def test_starts_on_random_faces_and_vertices() -> None:
    rng = np.random.default_rng(3)
    for n in (2, 3):
        space = random_world(rng, "rotated", n, 5 if n == 2 else 3).free_space()
        for k in range(4):
            face = space.graph.faces[int(rng.integers(len(space.graph.faces)))]
            start = face.vertices[0] if k % 2 else face.vertices.mean(axis=0)
            goal = space.vertices[int(rng.integers(len(space.vertices)))]
            result = plan(space, start, goal, time_limit=LONG, gap=1e-2)
            if result.status is not PlanStatus.INFEASIBLE:
                check(result, 1e-2)


BAD: list[tuple[object, type[Exception], str]] = [
    ([1.5, 1.5], QueryError, r"start \(1.5, 1.5\) is 0.5 m inside obstacle 0"),
    ([3.5, 0.5], QueryError, r"start \(3.5, 0.5\) is outside the workspace \[0, 3\] x \[0, 2\]"),
    ([np.nan, 0.5], ShapeError, "start must be finite"),
    ([0.5, np.inf], ShapeError, "start must be finite"),
    ([0.5, 0.5, 0.5], ShapeError, "start must have 2 coordinates, got 3"),
    ([[0.5, 0.5]], ShapeError, "start must have 1 axes"),
    ("here", ShapeError, "start must be an array of numbers"),
]


@pytest.mark.parametrize(("point", "error", "words"), BAD)
def test_bad_points_are_one_clear_line(point: Floats, error: type[Exception], words: str) -> None:
    space = two_leaves()
    for start, goal, text in (
        (point, [0.5, 0.5], words),
        ([0.5, 0.5], point, words.replace("start", "goal")),
    ):
        with pytest.raises(error, match=text) as caught:
            plan(space, start, goal)
        assert "\n" not in str(caught.value)


def test_a_start_in_a_crack_says_so() -> None:
    blocks = [Polytope.from_box([0, 0], [1, 2]), Polytope.from_box([1, 0], [2, 2])]
    space = FreeSpace.decompose(([0, 0], [3, 2]), blocks)
    with pytest.raises(QueryError, match="crack"):
        plan(space, [1.0, 1.0], [2.5, 1.0])


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"time_limit": 0.0}, "time_limit"),
        ({"time_limit": -1.0}, "time_limit"),
        ({"time_limit": math.nan}, "time_limit"),
        ({"gap": -0.1}, "gap"),
        ({"gap": math.inf}, "gap"),
        ({"gap": math.nan}, "gap"),
    ],
)
def test_bad_settings_are_one_clear_line(settings: dict[str, float], words: str) -> None:
    with pytest.raises(QueryError, match=words) as caught:
        plan(two_leaves(), [0.5, 0.5], [2.5, 1.5], **settings)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_the_same_seed_gives_the_same_plan() -> None:
    scenes: list[Scene] = [load_scene(name) for name in ("random_2d_s010", "random_3d_s003")]
    for scene in scenes:
        runs = [
            plan(scene.free_space(), scene.start, scene.goal, time_limit=LONG, gap=1e-2, seed=5)
            for _ in range(2)
        ]
        first, second = runs
        assert np.array_equal(first.waypoints, second.waypoints)
        assert np.array_equal(first.leaves, second.leaves)
        assert np.array_equal(first.samples, second.samples)
        assert [row[1:] for row in first.history] == [row[1:] for row in second.history]
    other = plan(scenes[0].free_space(), scenes[0].start, scenes[0].goal, time_limit=LONG, seed=6)
    check(other)


def test_samples_lie_on_faces_and_informed_sets_shrink_around_the_path() -> None:
    scene = load_scene("random_3d_s005")
    result = plan(scene.free_space(), scene.start, scene.goal, time_limit=LONG)
    heights = [
        np.abs(result.samples @ face.normal - face.offset) for face in result.space.graph.faces
    ]
    assert len(result.samples) > 0
    assert np.min(heights, axis=0).max() <= 1e-9
    costs = sorted({row[1] for row in result.history if math.isfinite(row[1])}, reverse=True)
    assert len(result.informed) == len(costs)
    for informed in result.informed:
        assert informed.contains(result.waypoints, 1e-6).all()


def test_out_of_time_is_a_status() -> None:
    scene = load_scene("random_3d_s003")
    result = plan(scene.free_space(), scene.start, scene.goal, time_limit=1e-6, gap=0.0)
    assert result.status in (PlanStatus.FEASIBLE, PlanStatus.TIME_LIMIT)
    assert result.lower_bound <= scene.cost
    assert verify(result).ok


def test_a_maze_is_solved_along_its_only_way() -> None:
    scene = load_scene("maze2d_5")
    optimum = shortest_length(scene, scene.start, scene.goal)
    check_against(plan(scene.free_space(), scene.start, scene.goal, time_limit=LONG), optimum)


def test_a_way_much_longer_than_the_workspace_is_wide() -> None:
    """Round-off grows with the length of the path, not with the size of the world."""
    blocks = []
    for k in range(1, 40):
        lo, hi = (-0.1, 0.95) if k % 2 else (0.05, 1.1)
        blocks.append(Polytope.from_box([k / 40 - 0.005, lo], [k / 40 + 0.005, hi]))
    world = World(np.zeros(2), np.ones(2), blocks)
    start, goal = np.array([0.01, 0.01]), np.array([0.99, 0.01])
    optimum = shortest_length(world, start, goal)
    assert optimum > 30.0
    check_against(plan(world.free_space(), start, goal, time_limit=LONG), optimum)
