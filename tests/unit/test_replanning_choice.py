"""What the pilot chooses from: paths, places to rest, and what a trajectory is worth."""

from __future__ import annotations

import numpy as np
import pytest

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Planner
from hzmp_planners.sets import Polytope
from hzmp_sim.replanning.ahead import Ahead
from hzmp_sim.replanning.candidates import Dynamics, along
from hzmp_sim.replanning.commitment import Commitment, State
from hzmp_sim.replanning.crossing import crossed
from hzmp_sim.replanning.routes import Router
from hzmp_sim.replanning.worth import Worth
from hzmp_tracking import Limits, time_parameterize
from moving_boxes import MovingBoxes

LIMITS = Limits(2.0, 4.0, 30.0)
DYNAMICS = Dynamics(LIMITS, 2)
ROOM = Polytope.from_box((0, 0), (12, 8))


def swinging(rng: np.random.Generator, count: int = 10) -> MovingBoxes:
    return MovingBoxes(
        np.column_stack([np.linspace(2.0, 10.0, count), rng.uniform(1, 7, count)]),
        np.full((count, 2), 0.5),
        np.column_stack([np.zeros(count), rng.uniform(-1.4, 1.4, count)]),
        rng.uniform(6.0, 12.0, count),
    )


def commitment(points: list[list[float]], remaining: float, begins: float = 0.0) -> Commitment:
    cells = [ROOM] * (len(points) - 1)
    return Commitment(time_parameterize(np.array(points), cells, LIMITS), begins, remaining)


@pytest.mark.parametrize("seed", range(8))
def test_a_router_with_a_memory_finds_ways_as_short(seed: int) -> None:
    """Along a way among boxes that move: clear of all, and seldom longer than without memory."""
    rng = np.random.default_rng(seed)
    space = FreeSpace.decompose(((0, 0), (12, 8)), [Polytope.from_box((5.8, 0), (6.2, 3))])
    world, router, goal = swinging(rng), Router(space), np.array([11.5, 4.0])
    excess = []
    for k in range(40):
        start = np.array([0.5 + 0.02 * k, 4.0])
        begin = np.full(10, 0.05 * k)
        swept = world.hulls(begin, begin + 0.5)
        swept = swept.without(swept.contain(start) | swept.contain(goal))
        found, fresh = router.route(start, goal, swept), Router(space).route(start, goal, swept)
        assert found is not None
        assert fresh is not None
        assert found.found == fresh.found
        if not found.found:
            continue
        assert crossed(found.plan.waypoints, swept)[0] == []
        cut = [hull for hull in swept if hull is not None]
        best = Planner(space.with_obstacles(cut), start, goal).first_path().cost
        assert found.plan.lower_bound <= best + 1e-9
        excess.append(found.plan.cost / fresh.plan.cost - 1.0)
    assert np.mean(excess) < 0.01


def test_a_place_is_free_until_something_comes() -> None:
    comer = MovingBoxes(np.array([[0.0, 4.0]]), np.full((1, 2), 0.5), np.array([[1.0, 0.0]]))
    ahead = Ahead(comer, 0.0, guard=2.0)
    point = np.array([5.0, 4.0])  # it is there from 4.5 s to 5.5 s
    times = np.arange(0.0, 8.0, 0.1)
    free = np.array([ahead.free(point, time) for time in times])
    assert free[times < 2.4].all()
    assert not free[(times > 2.6) & (times < 5.4)].any()
    assert free[times > 5.7].all()


def test_ends_where_the_body_could_not_rest_are_tried_last() -> None:
    space = FreeSpace.decompose(((0, 0), (40, 8)), [])
    start = np.array([1.0, 4.0])
    found = Router(space).static(start, np.array([39.0, 4.0]))
    assert found is not None
    still = State(start, np.zeros(2), np.zeros(2))
    first = next(along(found, still, 0.0, DYNAMICS))

    def elsewhere(point: Floats, time: float) -> bool:
        here = bool(abs(point[0] - first.end[0]) < 0.1)
        if here:  # the guess is a good one
            assert time == pytest.approx(first.ends, rel=0.1)
        return not here

    other = next(along(found, still, 0.0, DYNAMICS, rests=elsewhere))
    assert abs(other.end[0] - first.end[0]) > 0.1
    (slow,) = along(found, still, 0.0, DYNAMICS, most=1, pace=0.5)
    assert np.abs(slow.trajectory.sample(np.linspace(0, 9, 99)).velocity).max() <= 1.0 + 1e-6
    assert slow.trajectory.limits == LIMITS


def test_what_a_trajectory_is_worth() -> None:
    goal = np.array([11.0, 4.0])
    worth = Worth(DYNAMICS, 0.0, np.array([1.0, 4.0]), goal, 10.0)
    near = commitment([[1.0, 4.0], [4.0, 4.0]], 7.0)
    far = commitment([[1.0, 4.0], [8.0, 4.0]], 3.0)
    there = commitment([[1.0, 4.0], [11.0, 4.0]], 0.0)
    detour = commitment([[1.0, 4.0], [6.0, 8.0], [11.0, 4.0]], 0.0)
    assert worth.sooner(far, near)
    assert worth.sooner(there, near)
    assert not worth.sooner(detour, there)
    assert not worth.sooner(near, there)
    assert not worth.sooner(there, there)  # nothing is gained
    resting = commitment([[1.0, 4.0], [1.5, 4.0]], 9.5, begins=-5.0)
    assert worth.sooner(detour, resting)
