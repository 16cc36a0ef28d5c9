"""Several starts and goals, and goal regions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Choice, PlanStatus, plan, plan_any, verify
from hzmp_planners.sets import Polytope
from oracles import random_free_points, random_world, shortest_length

LONG = 60.0
WALL = Polytope.from_box((1.0, -1.0), (1.2, 0.5))


def open_room() -> FreeSpace:
    return FreeSpace.decompose(((-1, -1), (3, 1)), [WALL])


def check(choice: Choice, gap: float = 1e-3) -> None:
    assert choice.status is PlanStatus.OPTIMAL
    assert choice.plan is not None
    assert 0.0 <= choice.gap <= gap
    report = verify(choice)
    assert report.ok, report.describe()


@pytest.mark.parametrize("n", [2, 3])
def test_of_points_the_nearest_pair_is_found(n: int) -> None:
    rng = np.random.default_rng(n)
    for kind in ("rotated", "grid"):
        world = random_world(rng, kind, n, 6)
        space = world.free_space()
        points = random_free_points(rng, world, 6)
        starts, goals = points[:3], points[3:]
        choice = plan_any(space, starts, goals, time_limit=LONG)
        costs = [plan(space, s, g, time_limit=LONG).cost for s in starts for g in goals]
        if math.isinf(min(costs)):
            assert choice.status is PlanStatus.INFEASIBLE
            continue
        check(choice)
        assert choice.plan is not None
        assert choice.lower_bound <= min(costs) <= choice.plan.cost * (1.0 + 1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_the_way_to_a_region_is_the_shortest_to_any_of_its_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = random_world(rng, "rotated", 2, 5)
    space = world.free_space()
    start, middle = random_free_points(rng, world, 2)
    corners = middle + rng.uniform(-0.15, 0.15, (5, 2))
    region = Polytope.from_vertices(corners)
    assert not region.contains(start)[0]
    choice = plan_any(space, start, region, time_limit=LONG)
    ring = region.vertices()
    ring = ring[np.arctan2(*(ring - ring.mean(axis=0)).T).argsort()]
    sides = np.linspace(ring, np.roll(ring, -1, axis=0), 60).reshape(-1, 2)
    sides = sides[space.contains(sides)]
    lengths = [shortest_length(world, start, side) for side in sides]
    if math.isinf(min(lengths)):
        assert choice.status is PlanStatus.INFEASIBLE
        return
    check(choice)
    assert choice.plan is not None
    assert choice.lower_bound <= min(lengths) + 1e-9
    assert choice.plan.cost <= min(lengths) * (1.0 + 1e-3)
    assert region.violation(choice.plan.goal)[0] <= 1e-8


def test_regions_of_every_shape() -> None:
    space = open_room()
    around = math.hypot(1.0, 0.5) + 0.2  # from the origin over the wall's edge to its far corner
    flat = Polytope.from_vertices([(1.2, -1.0), (1.2, 0.5)])  # the far side of the wall
    check(choice := plan_any(space, (0, 0), flat, time_limit=LONG))
    assert choice.plan is not None
    assert choice.plan.cost == pytest.approx(around, rel=1e-3)
    point = Polytope.from_vertices([(2.0, 0.0)])
    check(choice := plan_any(space, (0, 0), point, time_limit=LONG))
    assert choice.plan is not None
    assert choice.plan.cost == pytest.approx(plan(space, (0, 0), (2, 0)).cost, rel=1e-3)
    # Half of it is in the wall, most of the rest outside of the workspace.
    across = Polytope.from_box((0.9, -5.0), (1.1, 0.0))
    check(choice := plan_any(space, (0, 0), across, time_limit=LONG))
    assert choice.plan is not None
    assert choice.plan.cost == pytest.approx(0.9, rel=1e-3)
    assert np.abs(choice.plan.goal - [0.9, 0.0]).max() < 0.05
    mixed = [Polytope.from_box((2.0, -1.0), (3.0, 1.0)), (-0.5, 0.0)]
    check(choice := plan_any(space, [(0, 0), (2.5, 0)], mixed, time_limit=LONG))
    assert choice.plan is not None
    assert choice.plan.cost == 0.0  # the second start has arrived
    check(choice := plan_any(space, (0, 0), mixed, time_limit=LONG))
    assert choice.plan is not None
    assert choice.plan.cost == pytest.approx(0.5)


def test_a_goal_box_in_3d() -> None:
    pillar = Polytope.from_box((1.0, -1.0, -1.0), (1.2, 0.5, 1.0))
    space = FreeSpace.decompose(((-1, -1, -1), (3, 1, 1)), [pillar])
    box = Polytope.from_box((2.0, -0.4, -0.3), (2.4, 0.4, 0.3))
    choice = plan_any(space, (0, 0, 0), box, time_limit=LONG, gap=5e-2)
    check(choice, 5e-2)
    assert choice.plan is not None
    exact = math.hypot(1.0, 0.5) + 0.2 + math.hypot(0.8, 0.1)
    assert choice.lower_bound <= exact <= choice.plan.cost <= exact * 1.001


def test_what_cannot_be_reached() -> None:
    walled = FreeSpace.decompose(((0, 0), (3, 1)), [Polytope.from_box((1, 0), (1.2, 1))])
    beyond = Polytope.from_box((2, 0.2), (2.5, 0.8))
    choice = plan_any(walled, (0.5, 0.5), [beyond, (1.5, 0.5)])
    assert choice.status is PlanStatus.INFEASIBLE
    assert choice.plan is None
    assert math.isinf(choice.lower_bound)
    assert verify(choice).ok
    check(plan_any(walled, [(0.5, 0.5), (2.9, 0.5)], [beyond, (1.5, 0.5)], time_limit=LONG))


def test_too_little_time_leaves_a_valid_bound() -> None:
    space = open_room()
    choice = plan_any(space, (0, 0), Polytope.from_box((2, -1), (3, 1)), time_limit=1e-9)
    assert choice.status is PlanStatus.TIME_LIMIT
    assert choice.lower_bound <= math.hypot(1.0, 0.5) + 0.2 + 0.8
    assert verify(choice).ok


def test_bad_input_is_named() -> None:
    space = open_room()
    inside = Polytope.from_box((1.05, -0.5), (1.1, 0.0))
    with pytest.raises(QueryError, match="goal 1 is a region without a part in the free space"):
        plan_any(space, (0, 0), [(2, 0), inside])
    with pytest.raises(QueryError, match="inside obstacle 0"):
        plan_any(space, (0, 0), [(1.1, 0.0)])
    with pytest.raises(ShapeError, match="goal 0 has dimension 3"):
        plan_any(space, (0, 0), Polytope.from_box((0, 0, 0), (1, 1, 1)))
    with pytest.raises(ShapeError, match="goal 0 is empty"):
        plan_any(space, (0, 0), Polytope.empty(2))
    with pytest.raises(ShapeError):
        plan_any(space, (0, 0), Polytope.from_halfspaces([[1.0, 0.0]], [2.0]))
    with pytest.raises(QueryError, match="one start"):
        plan_any(space, np.zeros((0, 2)), (0, 0))
    with pytest.raises(ShapeError):
        plan_any(space, (0, 0), [])
    with pytest.raises(QueryError, match="time_limit"):
        plan_any(space, (0, 0), (2, 0), time_limit=0.0)


def test_false_claims_are_found() -> None:
    space = open_room()
    region = Polytope.from_box((2.0, -0.5), (2.5, 0.5))
    choice = plan_any(space, (0, 0), region, time_limit=LONG, gap=1e-2)
    check(choice, 1e-2)
    assert choice.plan is not None
    cost = choice.plan.cost
    assert not verify(replace(choice, lower_bound=cost)).ok
    nearest = min(choice.cases, key=lambda case: case.lower_bound)
    rest = tuple(case for case in choice.cases if case is not nearest)
    assert verify(replace(choice, cases=rest)).residuals["missed_goal"] > 1e-6
    elsewhere = plan(space, (0, 0.2), (2.0, 0.0))
    assert not verify(replace(choice, plan=elsewhere)).ok
    assert not verify(replace(choice, plan=plan(space, (0, 0), (1.9, 0.0)))).ok
    moved = replace(nearest, plan=plan(space, (-1, 0), (2.0, 0.0)))
    assert not verify(replace(choice, cases=(moved, *rest))).ok
