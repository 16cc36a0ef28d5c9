"""Stops from a moving state: at rest, within the limits, in the cell at every instant."""

from __future__ import annotations

import numpy as np
import pytest
import ruckig

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking import Limits, Trajectory, stop_trajectory

LIMITS = Limits(velocity=2.0, acceleration=4.0, jerk=20.0)


def check(stop: Trajectory, position: Floats, velocity: Floats, acceleration: Floats) -> None:
    assert stop.containment <= 0.0
    assert stop.limit_usage.max() <= 1.0 + 1e-9
    first = stop.sample(0.0)
    for given, found in zip((position, velocity, acceleration), first[:3], strict=True):
        assert np.allclose(found[0], given, rtol=0.0, atol=1e-9)
    last = stop.sample(stop.duration * (1.0 - 1e-12))
    assert np.abs(last.velocity).max() <= 1e-7
    assert np.abs(last.acceleration).max() <= 1e-4
    t = np.linspace(0.0, stop.duration, 2001)
    assert stop.cells[0].violation(stop.sample(t).position).max() <= 1e-12


def braking_time(velocity: Floats, acceleration: Floats) -> float:
    """Of the fastest stop of all [s], by ruckig, axis by axis."""
    times = []
    for v, a in zip(velocity.tolist(), acceleration.tolist(), strict=True):
        request = ruckig.InputParameter(1)
        request.control_interface = ruckig.ControlInterface.Velocity
        request.current_position, request.current_velocity = [0.0], [v]
        request.current_acceleration = [a]
        request.max_velocity, request.max_acceleration, request.max_jerk = [2.0], [4.0], [20.0]
        result = ruckig.Trajectory(1)
        ruckig.Ruckig(1).calculate(request, result)
        times.append(result.duration)
    return max(times)


def test_random_states_in_random_cells() -> None:
    rng = np.random.default_rng(0)
    braked = steered = 0
    for _ in range(120):
        normals = rng.normal(size=(10, 3))
        cell = Polytope.from_halfspaces(
            normals, np.linalg.norm(normals, axis=1) * rng.uniform(0.3, 1.2, 10)
        )
        velocity, acceleration = rng.uniform(-1.8, 1.8, 3), rng.uniform(-1.0, 1.0, 3)
        try:
            stop = stop_trajectory(np.zeros(3), velocity, cell, LIMITS, acceleration)
        except QueryError:
            continue
        check(stop, np.zeros(3), velocity, acceleration)
        fastest = braking_time(velocity, acceleration)
        assert stop.duration >= fastest * (1.0 - 1e-9)
        at_once = stop.duration <= fastest * (1.0 + 1e-9)
        braked, steered = braked + int(at_once), steered + int(not at_once)
    assert braked > 20
    assert steered


def test_one_axis_brakes_later_where_the_cell_is_slanted() -> None:
    # Below the diagonal, moving along it: with y braked like x the way is straight and inside, but
    # y has the shorter way to brake and would leave x to run on across a wall at x = y + 0.05.
    lane = Polytope.from_halfspaces([[1.0, -1.0], [-1.0, 1.0], [1.0, 0.0], [-1.0, 0.0]],
                                    [0.05, 0.05, 3.0, 1.0])  # fmt: skip
    velocity = np.array([1.9, 1.9])
    slow_x = Limits(velocity=2.0, acceleration=[2.0, 4.0], jerk=20.0)
    stop = stop_trajectory([0.0, 0.0], velocity, lane, slow_x)
    check(stop, np.zeros(2), velocity, np.zeros(2))
    # Straight on, y as slowly as x has to: no stop is faster.
    assert stop.duration == pytest.approx(1.9 / 2.0 + 2.0 / 20.0)


def test_a_spline_steers_where_the_acceleration_leaves_the_line() -> None:
    lane = Polytope.from_halfspaces([[1.0, -1.0], [-1.0, 1.0], [1.0, 0.0], [-1.0, 0.0]],
                                    [0.05, 0.05, 3.0, 1.0])  # fmt: skip
    velocity, acceleration = np.array([1.9, 1.9]), np.array([0.2, -0.2])
    slow_x = Limits(velocity=2.0, acceleration=[2.0, 4.0], jerk=20.0)
    stop = stop_trajectory([0.0, 0.0], velocity, lane, slow_x, acceleration)
    check(stop, np.zeros(2), velocity, acceleration)
    assert stop.duration < 1.15 * (1.9 / 2.0 + 2.0 / 20.0)


NORMED = Limits(2.0, 4.0, 20.0, speed=2.0, total_acceleration=4.0, total_jerk=20.0)


def test_norms_alone_are_braked_straight_and_at_full_force() -> None:
    everywhere = Polytope.from_box([-9.0] * 3, [9.0] * 3)
    velocity = 1.8 * np.array([2.0, -1.0, 2.0]) / 3.0
    stop = stop_trajectory(np.zeros(3), velocity, everywhere, NORMED)
    check(stop, np.zeros(3), velocity, np.zeros(3))
    assert stop.duration == pytest.approx(1.8 / 4.0 + 4.0 / 20.0)
    assert stop.norm_peaks[1] == pytest.approx(4.0)


def test_stops_keep_limits_on_norms_from_any_state_or_say_that_they_cannot() -> None:
    rng, stopped = np.random.default_rng(11), 0
    for _ in range(20):
        velocity, acceleration = rng.normal(size=(2, 3))
        velocity *= rng.uniform(0.2, 1.8) / np.linalg.norm(velocity)
        acceleration *= rng.uniform(0.0, 2.0) / np.linalg.norm(acceleration)
        cell = Polytope.from_box([-3.0] * 3, [3.0] * 3)
        try:
            stop = stop_trajectory(np.zeros(3), velocity, cell, NORMED, acceleration)
        except QueryError:
            continue
        stopped += 1
        check(stop, np.zeros(3), velocity, acceleration)
        sample = stop.sample(np.linspace(0.0, stop.duration, 2001))
        for values, norm in zip(sample[1:], NORMED.norms, strict=True):
            assert np.linalg.norm(values, axis=1).max() <= norm * (1.0 + 1e-9)
    assert stopped >= 18


def test_the_cell_in_which_the_stop_is_possible_is_taken() -> None:
    near = Polytope.from_box([-1.0, -1.0], [0.1, 1.0])
    wide = Polytope.from_box([-1.0, -0.2], [3.0, 0.2])
    stop = stop_trajectory([0.0, 0.0], [2.0, 0.0], [near, wide], LIMITS)
    assert stop.cells == (wide,)
    check(stop, np.zeros(2), np.array([2.0, 0.0]), np.zeros(2))


def test_where_there_is_no_stop_it_says_so() -> None:
    wall = Polytope.from_box([-1.0, -1.0], [0.3, 1.0])
    with pytest.raises(QueryError, match="no stop inside the cell"):
        stop_trajectory([0.0, 0.0], [2.0, 0.0], wall, LIMITS)
    with pytest.raises(QueryError, match="limit is 2"):
        stop_trajectory([0.0, 0.0], [2.5, 0.0], wall, LIMITS)
    with pytest.raises(ShapeError, match="position"):
        stop_trajectory([0.0, 0.0, 0.0], [1.0, 0.0], wall, LIMITS)
    with pytest.raises(ShapeError, match="at least one"):
        stop_trajectory([0.0, 0.0], [1.0, 0.0], [], LIMITS)


def test_at_rest_it_stays_there() -> None:
    cell = Polytope.from_box([0.0, 0.0], [1.0, 1.0])
    stop = stop_trajectory([0.0, 1.0], [0.0, 0.0], cell, LIMITS)
    assert stop.duration == 0.0
    assert stop.containment <= 0.0
    assert np.array_equal(stop.sample(1.0).position, [[0.0, 1.0]])
