"""The parts of the planner's loop: proof, crossings, goals, watchdog."""

from __future__ import annotations

import gc
import math
import threading
import time
import weakref
from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from hzmp_sim.motion.hulls import Hulls
from hzmp_sim.replanning.candidates import Dynamics
from hzmp_sim.replanning.commitment import Commitment
from hzmp_sim.replanning.crossing import crossed, shortened
from hzmp_sim.replanning.flown import FlownReference, rest_at
from hzmp_sim.replanning.goals import Goals, Station
from hzmp_sim.replanning.pilot import Pilot
from hzmp_sim.replanning.proof import bezier_points, first_conflict
from hzmp_sim.replanning.watchdog import StageError, Watchdog
from hzmp_sim.settings import Replanning
from hzmp_tracking import Limits, time_parameterize
from moving_boxes import MovingBoxes

LIMITS = Limits(2.0, 4.0, 30.0)
LATENCY = 0.05
ROOM = Polytope.from_box([0.0, 0.0], [10.0, 6.0])


def run_along(points: Floats, begins: float = 0.0) -> Commitment:
    trajectory = time_parameterize(points, [ROOM] * (len(points) - 1), LIMITS, quick=True)
    return Commitment(trajectory, begins, 0.0)


def boxes(rng: np.random.Generator, count: int) -> MovingBoxes:
    return MovingBoxes(
        centres=rng.uniform(1.0, 5.0, (count, 2)),
        halves=rng.uniform(0.1, 0.5, (count, 2)),
        velocities=rng.uniform(-1.5, 1.5, (count, 2)),
        periods=rng.uniform(2.0, 6.0, count),
    )


def gap(world: MovingBoxes, commitment: Commitment, times: Floats) -> Floats:
    """Distance of the reference to the nearest box along the axes; negative inside."""
    places = world.places(times)
    at = commitment.trajectory.sample(times - commitment.begins).position
    return np.asarray((np.abs(at[:, None] - places) - world.halves).max(axis=2).min(axis=1))


@pytest.mark.parametrize("seed", range(25))
def test_a_trajectory_that_is_proved_meets_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = boxes(rng, 3)
    commitment = run_along(rng.uniform(0.5, 5.5, (3, 2)), begins=0.3)
    slabs = world.slabs(0.3, 0.05, 100)
    conflict = first_conflict(commitment, slabs, 0.3)
    last = 5.3 if conflict is None else conflict.time
    times = np.linspace(0.3, last, 20_001)[:-1]
    if last > 0.3:
        assert gap(world, commitment, times).min() >= -1e-9
    if conflict is not None:  # something is near then: slabs are larger than what they hold
        assert gap(world, commitment, np.array([conflict.time]))[0] < 0.3


def test_a_conflict_shorter_than_a_slab_is_found() -> None:
    commitment = run_along(np.array([[1.0, 1.0], [9.0, 1.0]]))
    middle = float(commitment.trajectory.sample(2.0).position[0, 0])
    thin = MovingBoxes(
        np.array([[middle, 1.0]]), np.array([[0.005, 0.1]]), np.zeros((1, 2)), np.array([1.0])
    )
    conflict = first_conflict(commitment, thin.slabs(0.0, 0.05, 120), 0.0)
    assert conflict is not None
    assert conflict.time == pytest.approx(2.0, abs=0.02)


def test_resting_at_the_end_counts() -> None:
    commitment = run_along(np.array([[1.0, 1.0], [3.0, 1.0]]))
    comer = MovingBoxes(np.array([[3.0, 5.0]]), np.full((1, 2), 0.2), np.array([[0.0, -1.0]]))
    slabs = comer.slabs(0.0, 0.05, 120)
    conflict = first_conflict(commitment, slabs, 0.0)
    assert conflict is not None
    assert 3.6 < conflict.time <= 3.8
    assert first_conflict(commitment, comer.slabs(0.0, 0.05, 60), 0.0) is None


def test_bezier_points_are_those_of_the_trajectory() -> None:
    trajectory = run_along(np.array([[1.0, 1.0], [4.0, 3.0], [9.0, 1.0]])).trajectory
    times = np.union1d(np.linspace(0.0, trajectory.duration, 37), trajectory.breakpoints)
    points = bezier_points(trajectory, times)
    for (a, b), (p0, p1, p2, p3) in zip(pairwise(times.tolist()), points, strict=True):
        for s in (0.0, 0.3, 1.0):
            value = (1 - s) ** 3 * p0 + 3 * s * (1 - s) ** 2 * p1 + 3 * s * s * (1 - s) * p2
            at = trajectory.sample(a + s * (b - a)).position[0]
            assert value + s**3 * p3 == pytest.approx(at, abs=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_crossings_against_dense_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.0, 10.0, (5, 3))
    middles, halves = rng.uniform(0.0, 10.0, (6, 3)), rng.uniform(0.2, 2.0, (6, 3))
    boxed = zip(middles - halves, middles + halves, strict=True)
    shapes = [Polytope.from_box(low, high) for low, high in boxed]
    absent = np.full((1, 6), -np.inf)
    b = np.concatenate([absent, [shape.b for shape in shapes]])
    found, reached = crossed(points, Hulls(np.repeat(shapes[0].A[None], 7, axis=0), b))
    lengths = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    dense = np.linspace(0.0, lengths[-1], 40_001)
    at = np.column_stack([np.interp(dense, lengths, column) for column in points.T])
    inside = np.array([shape.violation(at) < -2e-3 for shape in shapes])
    assert set(np.flatnonzero(inside.any(axis=1)) + 1) <= set(found)
    if inside.any():
        assert reached <= dense[inside.any(axis=0).argmax()] + 1e-9
    if found:
        way = shortened(points, reached)
        end = way[-1]
        assert min(abs(float(shape.violation(end)[0])) for shape in shapes) < 2e-9 or not reached
    assert shortened(points, math.inf) is points


def test_goals_in_a_row_with_a_stay_and_a_change_of_mind() -> None:
    a, b, c = (np.array([float(x), 0.0]) for x in range(3))
    goals = Goals([Station(a, dwell=1.0), Station(b)], [(5.0, Station(c))])
    assert goals.now(0.0) is a
    assert not goals.arrive(2.0)
    assert goals.now(2.5) is a
    assert not goals.arrive(2.6)
    assert goals.now(3.1) is b
    assert goals.now(5.0) is c
    assert goals.arrive(6.0)
    assert goals.reached == 2


def test_a_goal_counts_once_while_a_change_of_mind_is_still_to_come() -> None:
    goals = Goals([Station(np.zeros(2))], [(5.0, Station(np.ones(2)))])
    for now in (1.0, 1.05, 1.1):
        goals.now(now)
        assert not goals.arrive(now)
    assert goals.reached == 1
    goals.now(5.0)
    assert goals.arrive(6.0)
    assert goals.reached == 2


def test_patrol_goes_round() -> None:
    a, b = np.zeros(2), np.ones(2)
    goals = Goals([Station(a), Station(b)], patrol=True)
    seen = []
    for k in range(5):
        seen.append(goals.now(float(k)) is a)
        assert not goals.arrive(float(k))
    assert seen == [True, False, True, False, True]


def test_a_stage_that_raises_or_hangs_is_told_of() -> None:
    dog = Watchdog(0.2)
    assert dog.call(lambda: 7) == 7
    with pytest.raises(StageError, match="ZeroDivisionError"):
        dog.call(lambda: 1 // 0)
    assert dog.call(lambda: 8) == 8
    began = time.perf_counter()
    with pytest.raises(StageError, match=r"no answer within 0\.2 s"):
        dog.call(lambda: time.sleep(3.0))
    assert time.perf_counter() - began < 2.0


@pytest.mark.parametrize("seed", range(4))
def test_the_pilot_among_boxes_that_swing(seed: int) -> None:
    """Kinematically: the reference arrives, proved, continuous, and touches nothing."""
    rng = np.random.default_rng(seed)
    walls = [Polytope.from_box((5.8, 0), (6.2, 2)), Polytope.from_box((5.8, 6), (6.2, 8))]
    space = FreeSpace.decompose(((0, 0), (12, 8)), walls)
    count = 8
    speeds = rng.uniform(0.6, 1.4, count) * rng.choice([-1.0, 1.0], count)
    world = MovingBoxes(
        np.column_stack([np.linspace(2.5, 9.5, count), rng.uniform(2, 6, count)]),
        np.full((count, 2), 0.45),
        np.column_stack([np.zeros(count), speeds]),
        rng.uniform(6.0, 12.0, count),
    )
    settings = Replanning()
    pilot = Pilot(space, Dynamics(LIMITS, 2), settings)
    goal, now = np.array([11.5, 4.0]), 0.0
    flown = FlownReference(rest_at(space, np.array([0.5, 4.0]), LIMITS, 0.01))
    while now < 40.0:
        decision = pilot.decide(now + LATENCY, flown.current, goal, world)
        assert decision.proved
        if decision.commitment is not None:
            flown.switch(decision.commitment)
        now += settings.period
        if flown.current.remaining == 0.0 and now > flown.current.ends:
            break
    whole = flown.whole(now)
    assert np.abs(whole.sample(whole.duration).position[0] - goal).max() < 1e-6
    assert whole.containment <= 1e-9
    assert whole.limit_usage.max() <= 1.0 + 1e-6
    assert gap(world, Commitment(whole, 0.0, 0.0), np.arange(0.0, now, 1e-3)).min() >= -1e-9


def test_the_flown_reference_is_one_path_through_its_moves_and_rests() -> None:
    there = np.array([[1.0, 1.0], [4.0, 1.0], [4.0, 4.0]])
    first = run_along(there)
    second = run_along(there[::-1], begins=first.ends + 0.7)
    flown = FlownReference(first)
    flown.switch(second)
    until = second.ends + 0.4
    whole = flown.whole(until)
    assert whole.duration == pytest.approx(until)
    times = np.linspace(0.0, until, 2001)
    expected = np.where(
        (times < second.begins)[:, None],
        first.trajectory.sample(times.clip(0.0, first.ends)).position,
        second.trajectory.sample((times - second.begins).clip(0.0, second.trajectory.duration))
        .position,
    )  # fmt: skip
    assert np.abs(whole.sample(times).position - expected).max() <= 1e-9
    assert np.array_equal(whole.cells[0].b, ROOM.b)


def test_a_watchdog_that_is_gone_leaves_no_thread_and_no_data() -> None:
    held = np.zeros(3)
    seen = weakref.ref(held)
    before = threading.active_count()
    dog = Watchdog(5.0)
    assert dog.call(partial(np.sum, held)) == 0.0
    assert threading.active_count() == before + 1
    del dog, held
    end = time.perf_counter() + 5.0
    while threading.active_count() > before and time.perf_counter() < end:
        time.sleep(0.01)
    gc.collect()
    assert threading.active_count() == before
    assert seen() is None
