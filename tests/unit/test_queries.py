"""Resuming, reporting, vetoes, warm starts, many queries, several corridors, and output."""

from __future__ import annotations

import json
import math
from itertools import pairwise

import numpy as np
import pytest

from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import (
    Improvement,
    Plan,
    Planner,
    PlanStatus,
    plan,
    plan_corridors,
    plan_many,
    verify,
)
from hzmp_planners.sets import Polytope
from oracles import Floats, load_scene, random_free_points, random_world, shortest_length

LONG = 60.0
SQUARE = Polytope.from_box((1, -0.5), (2, 0.5))


def one_square() -> FreeSpace:
    return FreeSpace.decompose(((0, -2), (3, 2)), [SQUARE])


# Resuming and reporting


@pytest.mark.parametrize("name", ["random_2d_s003", "random_3d_s001"])
def test_a_query_goes_on_where_it_stopped(name: str) -> None:
    scene = load_scene(name)
    space = scene.free_space()
    planner = Planner(space, scene.start, scene.goal)
    found: list[Plan] = [planner.solve(1e-4)]
    while found[-1].status is not PlanStatus.OPTIMAL:
        found.append(planner.solve(0.02 * 1.5 ** len(found)))
    last = found[-1]
    assert verify(last).ok
    assert last.cost == pytest.approx(scene.cost, rel=1e-3)
    for one, two in pairwise(found):
        assert two.cost <= one.cost
        assert two.lower_bound >= one.lower_bound
        assert two.history[: len(one.history)] == one.history
    times, _, _ = np.array(last.history).T
    assert (np.diff(times) >= 0.0).all()
    again = planner.solve(LONG)
    assert again.history == last.history


def test_every_improvement_is_reported() -> None:
    scene = load_scene("random_3d_s001")
    seen: list[Improvement] = []
    found = plan(
        scene.free_space(), scene.start, scene.goal, time_limit=LONG, on_improvement=seen.append
    )
    assert [(i.time_s, i.cost, i.lower_bound) for i in seen] == list(found.history)
    for one, two in pairwise(seen):
        assert two.cost < one.cost or two.lower_bound > one.lower_bound
        assert two.cost <= one.cost
    for improvement in seen:
        length = np.linalg.norm(np.diff(improvement.waypoints, axis=0), axis=1).sum()
        assert length == pytest.approx(improvement.cost if len(improvement.waypoints) else 0.0)


@pytest.mark.parametrize("seed", range(4))
def test_bounds_below_a_cutoff_are_true(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = random_world(rng, "rotated", 2, 8)
    space = world.free_space()
    start, goal = random_free_points(rng, world, 2)
    exact = shortest_length(world, start, goal)
    straight = math.dist(start, goal)
    for share in (0.2, 0.6, 0.9, 0.999, 1.1):
        cutoff = straight + share * (min(exact, 3.0 * straight) - straight)
        planner = Planner(space, start, goal)
        for limit in (1.05 * cutoff, cutoff):
            found = planner.solve(LONG, limit)
            assert found.lower_bound <= exact * (1.0 + 1e-9)
            assert min(found.cost, limit) <= found.lower_bound * (1.0 + 1e-3)
            assert verify(found).ok


# Vetoes


@pytest.mark.parametrize("name", ["random_2d_s003", "random_3d_s001"])
def test_forbidden_segments_are_never_used(name: str) -> None:
    scene = load_scene(name)
    space = scene.free_space()
    best = plan(space, scene.start, scene.goal, time_limit=LONG)
    centre = best.waypoints[len(best.waypoints) // 2]

    def near(p: Floats, q: Floats) -> bool:
        along = q - p
        share = np.clip((centre - p) @ along / max(along @ along, 1e-300), 0.0, 1.0)
        return bool(np.linalg.norm(p + share * along - centre) < 0.03)

    found = plan(space, scene.start, scene.goal, time_limit=2.0, veto=near)
    assert len(found.leaves)
    assert not any(near(p, q) for p, q in pairwise(found.waypoints))
    assert found.cost > best.cost
    assert found.lower_bound <= best.cost
    assert verify(found).ok


def test_a_veto_without_objections_changes_nothing_that_counts() -> None:
    space = one_square()
    asked: list[tuple[Floats, Floats]] = []

    def note(p: Floats, q: Floats) -> bool:
        asked.append((p, q))
        return False

    found = plan(space, (0, 0), (3, 0), veto=note)
    assert found.status is PlanStatus.OPTIMAL
    assert found.cost == pytest.approx(plan(space, (0, 0), (3, 0)).cost)
    assert {(tuple(p), tuple(q)) for p, q in asked} >= {
        (tuple(p), tuple(q)) for p, q in pairwise(found.waypoints)
    }


def test_a_veto_on_the_straight_line_is_gone_around() -> None:
    space = one_square()

    def low(p: Floats, q: Floats) -> bool:
        return bool(max(abs(p[1]), abs(q[1])) < 0.1)

    found = plan(space, (0.1, 0), (0.9, 0), time_limit=1.0, veto=low)
    assert len(found.leaves)
    assert not any(low(p, q) for p, q in pairwise(found.waypoints))


def test_when_everything_is_forbidden_nothing_is_found() -> None:
    space = one_square()
    found = plan(space, (0, 0), (3, 0), time_limit=0.3, veto=lambda p, q: True)
    assert found.status is PlanStatus.TIME_LIMIT
    assert not len(found.waypoints)
    assert found.lower_bound <= 2.0 * math.hypot(1.0, 0.5) + 1.0
    with pytest.raises(QueryError, match="veto"):
        plan(space, (0, 0), (3, 0), veto=lambda p, q: True, method="paper")


# Warm starts


@pytest.mark.parametrize("name", ["random_2d_s003", "random_3d_s001"])
def test_an_old_plan_is_the_first_path(name: str) -> None:
    scene = load_scene(name)
    space = scene.free_space()
    old = plan(space, scene.start, scene.goal, time_limit=LONG)
    again = plan(space, scene.start, scene.goal, warm_start=old)
    assert again.history[0][1] <= old.cost * (1.0 + 1e-12)
    moved = scene.start + 0.3 * (old.waypoints[1] - scene.start)
    ahead = plan(space, moved, scene.goal, time_limit=LONG, warm_start=old.waypoints)
    assert ahead.history[0][1] <= old.cost - 0.3 * math.dist(scene.start, old.waypoints[1]) + 1e-9
    assert verify(ahead).ok


def test_an_old_plan_that_is_blocked_now_does_no_harm() -> None:
    space = one_square()
    old = plan(space, (0, 0.2), (3, 0.2))
    blocked = space.with_obstacles([Polytope.from_box((1.4, 0.4), (1.6, 1.9))])
    found = plan(blocked, (0, 0.2), (3, 0.2), warm_start=old)
    assert found.cost == pytest.approx(plan(blocked, (0, 0.2), (3, 0.2)).cost)
    for useless in ([(0, 0.2)], np.zeros((0, 2)), [(0, 0), (1.5, 0), (3, 0)]):
        assert plan(space, (0, 0.2), (3, 0.2), warm_start=useless).cost == pytest.approx(old.cost)


# Many queries, several corridors


def test_many_queries_are_each_answered_as_alone() -> None:
    rng = np.random.default_rng(0)
    world = random_world(rng, "rotated", 2, 6)
    space = world.free_space()
    points = random_free_points(rng, world, 8)
    many = plan_many(space, points[:4], points[4:])
    for found, start, goal in zip(many, points[:4], points[4:], strict=True):
        alone = plan(space, start, goal)
        assert np.array_equal(found.waypoints, alone.waypoints)
        assert found.lower_bound == alone.lower_bound
    assert plan_many(space, points[0], points[:2])[0].cost == 0.0
    with pytest.raises(QueryError, match="query 1: goal"):
        plan_many(space, points[:2], [points[2], world.hi + 1.0])
    with pytest.raises(QueryError, match="3 starts and 2 goals"):
        plan_many(space, points[:3], points[:2])


def test_a_square_is_passed_on_both_sides() -> None:
    space = one_square()
    found = plan_corridors(space, (0, 0.1), (3, 0.1), 3, time_limit=5.0)
    assert len(found) == 2  # there are no others
    over, under = found
    assert over.cost == pytest.approx(2 * math.hypot(1.0, 0.4) + 1.0)
    assert under.cost == pytest.approx(2 * math.hypot(1.0, 0.6) + 1.0)
    assert over.status is PlanStatus.OPTIMAL
    assert under.status is PlanStatus.FEASIBLE
    assert all(verify(each).ok for each in found)


def test_corridors_differ_and_bend_at_obstacles_only() -> None:
    scene = load_scene("random_2d_s001")
    space = scene.free_space()
    found = plan_corridors(space, scene.start, scene.goal, 4, time_limit=20.0)
    assert len(found) == 4
    costs = [each.cost for each in found]
    assert costs == sorted(costs)
    assert costs[0] == pytest.approx(scene.cost, rel=1e-6)
    assert np.diff(costs).min() > 1e-4
    corners = np.concatenate([block.vertices() for block in space.obstacles])
    for each in found:
        assert verify(each).ok
        for a, b, c in zip(each.waypoints, each.waypoints[1:], each.waypoints[2:], strict=False):
            excess = math.dist(a, b) + math.dist(b, c) - math.dist(a, c)
            if excess > 1e-6:
                assert np.abs(corners - b).max(axis=1).min() < 1e-5


def test_corridors_without_a_choice() -> None:
    space = one_square()
    assert len(plan_corridors(space, (0.1, 0), (0.9, 0), 3)) == 1
    walled = FreeSpace.decompose(((0, -2), (3, 2)), [Polytope.from_box((1, -2), (2, 2))])
    assert plan_corridors(walled, (0, 0), (3, 0), 3) == []
    with pytest.raises(QueryError, match="count"):
        plan_corridors(space, (0, 0), (3, 0), 0)
    with pytest.raises(QueryError, match="apart"):
        plan_corridors(space, (0, 0), (3, 0), 2, apart=-1.0)


# Output


def test_waypoints_at_a_spacing() -> None:
    found = plan(one_square(), (0, 0), (3, 0))
    points, leaves = found.interpolated(0.1)
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert gaps.max() <= 0.1 + 1e-12
    assert gaps.sum() == pytest.approx(found.cost)
    assert len(points) == len(leaves) + 1
    for waypoint in found.waypoints:
        assert np.abs(points - waypoint).max(axis=1).min() == 0.0
    for segment, leaf in zip(pairwise(points), leaves.tolist(), strict=True):
        assert found.space.leaf(leaf).violation(np.array(segment)).max() <= 1e-9
    same, _ = found.interpolated(math.inf)
    assert np.array_equal(same, found.waypoints)
    with pytest.raises(QueryError, match="spacing"):
        found.interpolated(0.0)


def test_plans_without_a_path_have_no_points_either() -> None:
    walled = FreeSpace.decompose(((0, -2), (3, 2)), [Polytope.from_box((1, -2), (2, 2))])
    found = plan(walled, (0, 0), (3, 0))
    points, leaves = found.interpolated(0.1)
    assert points.shape == (0, 2)
    assert leaves.shape == (0,)
    data = json.loads(found.to_json())
    assert data["status"] == "infeasible"
    assert data["cost_m"] is None
    assert data["lower_bound_m"] is None


def test_a_plan_as_json_is_complete() -> None:
    found = plan(one_square(), (0, 0), (3, 0))
    data = json.loads(found.to_json(indent=1))
    assert data["waypoints"] == found.waypoints.tolist()
    assert data["leaves"] == found.leaves.tolist()
    assert data["cost_m"] == found.cost
    assert data["lower_bound_m"] == found.lower_bound
    known = [[None if math.isinf(value) else value for value in row] for row in found.history]
    assert data["history"] == known
    assert plan(one_square(), (0, 0), (3, 0), warm_start=data["waypoints"]).cost == found.cost
