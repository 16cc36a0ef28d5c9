"""What a trajectory asks of rotors, beside numeric differentiation and dense samples."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking import Limits, RotorLimits, Trajectory, rotor_demand, time_parameterize

G = 9.81
EVERYWHERE = Polytope.from_box([-1e3] * 3, [1e3] * 3)


def wild(rng: np.random.Generator, size: float, n: int = 3) -> Trajectory:
    """Pieces that need not meet: every extremum is of one piece."""
    coefficients = rng.uniform(-size, size, (6, 4, n))
    cell = Polytope.from_box([-1e3] * n, [1e3] * n)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, 6))])
    return Trajectory(times, coefficients, np.zeros(6, dtype=np.int64), (cell,),
                      np.zeros((2, n)), Limits())  # fmt: skip


def forces(trajectory: Trajectory, count: int) -> list[Floats]:
    """Thrust over mass along each piece, evenly in time, ends included; each (count, 3)."""
    found = []
    for piece, h in zip(trajectory.coefficients, trajectory.durations, strict=True):
        t = np.linspace(0.0, h, count)[:, None]
        force = np.tile([0.0, 0.0, G], (count, 1))
        force[:, : trajectory.n] += 2.0 * piece[2] + 6.0 * piece[3] * t
        found.append(force)
    return found


@pytest.mark.parametrize(("seed", "size", "n"), [(0, 1.0, 3), (1, 4.0, 3), (2, 12.0, 3),
                                                 (3, 30.0, 3), (4, 2.0, 2)])  # fmt: skip
def test_extrema_are_those_of_dense_samples(seed: int, size: float, n: int) -> None:
    trajectory = wild(np.random.default_rng(seed), size, n)
    demand, count = rotor_demand(trajectory), 20_001
    thrusts, tilts, rates = [], [], []
    for force, h in zip(forces(trajectory, count), trajectory.durations, strict=True):
        size_of = np.linalg.norm(force, axis=1)
        direction = force / size_of[:, None]
        thrusts.append(size_of)
        tilts.append(np.arctan2(np.linalg.norm(force[:, :2], axis=1), force[:, 2]))
        # By differences: nothing of the closed form.
        rates.append(np.linalg.norm(np.diff(direction, axis=0), axis=1) * (count - 1) / h)
    thrust, tilt, rate = (np.concatenate(part) for part in (thrusts, tilts, rates))
    assert demand.most_thrust == pytest.approx(thrust.max(), rel=1e-12)
    assert demand.least_thrust <= thrust.min() <= demand.least_thrust + 1e-2 * size / count * 100
    assert tilt.max() - 1e-12 <= demand.tilt <= tilt.max() + 1e-4
    assert rate.max() <= demand.body_rate * (1.0 + 1e-9)
    assert demand.body_rate <= rate.max() * (1.0 + 1e-3)


def test_free_fall_turns_without_bound_and_hovering_not_at_all() -> None:
    still = wild(np.random.default_rng(0), 0.0)
    assert rotor_demand(still) == (G, G, 0.0, 0.0)
    falling = still.coefficients.copy()
    falling[0, 2, 2], falling[0, 3, 0] = -G / 2, 1.0
    demand = rotor_demand(Trajectory(still.breakpoints.copy(), falling, still.piece_cells.copy(),
                                     still.cells, still.waypoints.copy(), Limits()))  # fmt: skip
    assert demand.least_thrust == 0.0
    assert demand.body_rate == math.inf


def test_gravity_may_point_anywhere() -> None:
    trajectory = wild(np.random.default_rng(7), 3.0)
    turned = np.roll(trajectory.coefficients, 1, axis=2)
    same = Trajectory(trajectory.breakpoints.copy(), turned, trajectory.piece_cells.copy(),
                      trajectory.cells, trajectory.waypoints.copy(), Limits())  # fmt: skip
    expected = rotor_demand(trajectory, (0.0, 0.0, -G))
    assert rotor_demand(same, (-G, 0.0, 0.0)) == pytest.approx(expected, rel=1e-12)


def test_limits_that_follow_from_rotors_ask_for_no_more() -> None:
    rng = np.random.default_rng(5)
    for rotors in (RotorLimits(2.0, 25.0, 0.4, 1.5), RotorLimits(7.0, 25.0, 0.6, 3.0),
                   RotorLimits(0.0, 12.0, 0.6, 2.0)):  # fmt: skip
        limits = rotors.limits(3.0)
        points = np.cumsum(rng.uniform(-2.0, 2.0, (5, 3)), axis=0)
        lows = np.minimum(points[:-1], points[1:]) - 0.3
        highs = np.maximum(points[:-1], points[1:]) + 0.3
        cells = [Polytope.from_box(a, b) for a, b in zip(lows, highs, strict=True)]
        trajectory = time_parameterize(points, cells, limits)
        usage = rotors.usage(trajectory)
        assert max(usage[:3]) <= 1.0 + 1e-9
        # Without slack in what binds: the limits are the largest that follow.
        worst = {"tilt": G * math.sin(rotors.tilt), "down": G - rotors.least_thrust,
                 "up": rotors.most_thrust - G}  # fmt: skip
        assert limits.total_acceleration == pytest.approx(min(worst.values()))


def test_more_than_the_rotors_have_shows() -> None:
    rotors = RotorLimits(2.0, 25.0, 0.3, 1.0)
    corner = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 2.0]]
    trajectory = time_parameterize(corner, [EVERYWHERE] * 2, Limits(5.0, 9.0, 60.0))
    usage = rotors.usage(trajectory)
    assert usage.tilt > 1.0
    assert usage.body_rate > 1.0
    assert usage.demand == rotor_demand(trajectory)


@pytest.mark.parametrize("wrong", [(10.0, 25.0, 0.4, 1.0), (0.0, 9.0, 0.4, 1.0),
                                   (0.0, 25.0, 1.6, 1.0), (0.0, 25.0, 0.4, 0.0)])  # fmt: skip
def test_rotors_that_cannot_fly_are_refused(wrong: tuple[float, ...]) -> None:
    with pytest.raises(QueryError):
        RotorLimits(*wrong)


def test_gravity_is_checked() -> None:
    trajectory = wild(np.random.default_rng(0), 1.0)
    with pytest.raises(QueryError, match="vertical"):
        rotor_demand(trajectory, (0.0, 0.0, 0.0))
    with pytest.raises(ShapeError):
        rotor_demand(trajectory, (0.0, -9.81))
