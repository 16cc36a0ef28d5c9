"""Planning on a space that has just followed obstacles: the answers of one prepared afresh."""

from __future__ import annotations

import math
import time
from itertools import pairwise

import numpy as np
import pytest

from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.free_space.halfspaces import leaf_halfspaces
from hzmp_planners.planning import Planner, PlanStatus, plan
from hzmp_planners.planning.result import path_length
from hzmp_planners.sets import Polytope
from oracles import Floats, World, random_free_points, random_world


def moving_world(n: int, kind: str = "grid", seed: int = 0) -> tuple[FreeSpace, list[Polytope]]:
    """A free space and obstacles that come."""
    rng = np.random.default_rng(seed)
    world = random_world(rng, kind, n, 12)
    return world.free_space(), random_world(rng, kind, n, 4).obstacles


def prepared_afresh(space: FreeSpace) -> FreeSpace:
    """The same leaves without anything that an update took over."""
    return FreeSpace(space.bounds, space.obstacles, space._world)._knowing(space.graph)


def ends_in(space: FreeSpace, seed: int = 0) -> tuple[Floats, Floats]:
    world = World(*space.bounds, list(space.obstacles))
    start, goal = random_free_points(np.random.default_rng(seed), world, 2)
    return start, goal


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("kind", ["grid", "rotated", "slivers", "hulls"])
def test_an_updated_space_answers_as_one_prepared_afresh(n: int, kind: str) -> None:
    before, more = moving_world(n, kind)
    _ = before.leaf_boxes
    added = before.with_obstacles(more)
    moved = added.with_obstacles({0: None, len(added.obstacles) - 1: more[0]})
    for space in (added, moved, added.with_obstacles(more[:1])):
        fresh = prepared_afresh(space)
        known = leaf_halfspaces(space._world.leaves, space._world.table, space.scale)
        for taken, made in zip(space.halfspaces, known, strict=True):
            assert np.array_equal(taken, made)
        corners = [leaf.vertices() for leaf in space.leaves]
        assert np.array_equal(space.leaf_boxes[0], [points.min(axis=0) for points in corners])
        assert np.array_equal(space.leaf_boxes[1], [points.max(axis=0) for points in corners])
        start, goal = ends_in(space)
        one, two = (Planner(each, start, goal).first_path() for each in (space, fresh))
        assert np.array_equal(one.waypoints, two.waypoints)
        assert np.array_equal(one.leaves, two.leaves)
        for cell, again in zip(one.cells(space), two.cells(fresh), strict=True):
            assert np.array_equal(cell.A, again.A)
            assert np.array_equal(cell.b, again.b)


@pytest.mark.parametrize("n", [2, 3])
def test_a_first_path_is_free_short_and_never_looks_at_the_clock(
    n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    space, more = moving_world(n)
    space = space.with_obstacles(more)
    for seed in range(5):
        start, goal = ends_in(space, seed)
        found = Planner(space, start, goal).first_path()
        ticks = iter(range(10**9))
        with monkeypatch.context() as slow:  # an hour passes between any two looks
            slow.setattr(time, "perf_counter", lambda: 3600.0 * next(ticks))  # noqa: B023
            again = Planner(space, start, goal).first_path()
        assert np.array_equal(found.waypoints, again.waypoints)
        best = plan(space, start, goal, gap=1e-4, time_limit=20.0)
        assert (best.status is PlanStatus.INFEASIBLE) == (found.status is PlanStatus.INFEASIBLE)
        if best.status is PlanStatus.INFEASIBLE:
            continue
        assert found.cost == pytest.approx(path_length(found.waypoints))
        assert space.trace(found.waypoints) is not None
        assert np.linalg.norm(goal - start) * (1 - 1e-12) <= found.lower_bound
        assert found.lower_bound <= best.cost * (1 + 1e-9)
        assert found.cost <= best.cost * (1.0 + 1e-9 if n == 2 else 1.05)


def test_a_first_path_proves_that_there_is_none() -> None:
    wall = Polytope.from_box((1, -1, -1), (2, 4, 4))
    space = FreeSpace.decompose(((0, 0, 0), (3, 3, 3)), [wall])
    found = Planner(space, (0.5, 1, 1), (2.5, 1, 1)).first_path()
    assert found.status is PlanStatus.INFEASIBLE
    assert math.isinf(found.lower_bound)


def around_a_block(n: int) -> tuple[FreeSpace, Floats, Floats]:
    """A block between start and goal that a path passes on either side, above or below."""
    block = Polytope.from_box([2.0, 1.0, 0.0][:n], [3.0, 3.0, 1.0][:n])
    space = FreeSpace.decompose(([0.0] * n, [5.0, 4.0, 1.0][:n]), [block])
    return space, np.array([1.0, 2.1, 0.5][:n]), np.array([4.0, 2.1, 0.5][:n])


@pytest.mark.parametrize("n", [2, 3])
def test_an_old_path_is_kept_only_where_it_is_free_and_shorter(n: int) -> None:
    space, start, goal = around_a_block(n)
    alone = Planner(space, start, goal).first_path()
    detour = np.array([start, [0.5, 0.5, 0.5][:n], [4.5, 0.5, 0.5][:n], goal])
    blocked = np.array([start, goal])
    for old in (detour, blocked):
        found = Planner(space, start, goal, warm_start=old).first_path()
        assert found.cost <= alone.cost * (1 + 1e-12)
    # The optimum as the old path stays, whatever the search finds by itself.
    best = plan(space, start, goal, gap=1e-6, time_limit=20.0)
    kept = Planner(space, start, goal, warm_start=best).first_path()
    assert kept.cost <= best.cost * (1 + 1e-12)


def test_solve_goes_on_from_a_first_path_and_a_first_path_costs_it_nothing() -> None:
    space, start, goal = around_a_block(3)
    planner = Planner(space, start, goal, gap=1e-6)
    first = planner.first_path()
    best = planner.solve(20.0)
    assert best.cost <= first.cost
    assert best.status is PlanStatus.OPTIMAL
    assert planner.first_path().cost == best.cost


def test_the_papers_method_has_no_first_path() -> None:
    space, start, goal = around_a_block(2)
    with pytest.raises(QueryError, match="first path"):
        Planner(space, start, goal, method="paper").first_path()


@pytest.mark.parametrize("n", [2, 3])
def test_cells_of_the_first_segments_are_the_first_cells(n: int) -> None:
    space, start, goal = around_a_block(n)
    found = Planner(space, start, goal).first_path()
    cells = found.cells(space)
    assert len(cells) == len(found.leaves)
    for count in (0, 1, 2, len(cells), len(cells) + 3):
        some = found.cells(space, count=count)
        assert len(some) == min(count, len(cells))
        for one, two in zip(some, cells, strict=False):
            assert np.array_equal(one.A, two.A)
            assert np.array_equal(one.b, two.b)
    with pytest.raises(QueryError, match="count"):
        found.cells(space, count=-1)


def test_a_first_path_passes_no_forbidden_segment() -> None:
    space, start, goal = around_a_block(2)
    free = Planner(space, start, goal).first_path()
    below = free.waypoints[:, 1].min() < 1.0 + 1e-9

    def on_that_side(p: Floats, q: Floats) -> bool:
        return bool(min(p[1], q[1]) < 1.5 if below else max(p[1], q[1]) > 2.5)

    none = Planner(space, start, goal, veto=on_that_side).first_path()
    assert none.status is PlanStatus.TIME_LIMIT
    level = 3.5 if below else 0.5
    other = np.array([start, [1.0, level], [4.0, level], goal])
    found = Planner(space, start, goal, veto=on_that_side, warm_start=other).first_path()
    assert found.cost > free.cost
    assert not any(on_that_side(p, q) for p, q in pairwise(found.waypoints))
