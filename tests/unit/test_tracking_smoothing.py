"""The reference that a quadrotor is given: means over a window, with a continuous jerk."""

from __future__ import annotations

import numpy as np
import pytest

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope
from hzmp_tracking import Limits, Trajectory, time_parameterize
from hzmp_tracking.smoothing import smooth_sample

WIDTH = 0.08


@pytest.fixture(scope="module")
def bend() -> Trajectory:
    cells = [Polytope.from_box([0, 0], [3, 1]), Polytope.from_box([2, 0], [3, 4])]
    return time_parameterize([[0.5, 0.5], [2.5, 0.5], [2.5, 3.5]], cells, Limits(2.0, 4.0, 20.0))


def dense(trajectory: Trajectory) -> tuple[Floats, float]:
    times = np.linspace(-0.2, trajectory.duration + 0.2, 20_001)
    return times, float(times[1] - times[0])


def test_each_derivative_is_that_of_the_one_before(bend: Trajectory) -> None:
    times, step = dense(bend)
    smooth = smooth_sample(bend, times, WIDTH)
    for below, above, most in zip(smooth[1:], smooth[2:], (1e-4, 1e-2, None), strict=False):
        slope = np.diff(below, axis=0) / step
        middle = 0.5 * (above[1:] + above[:-1])
        if most is not None:
            assert np.abs(slope - middle).max() <= most
        else:  # the snap is a step function: right but for the steps that a difference straddles
            assert np.mean(np.abs(slope - middle) > 1e-6) < 0.02


def test_jerk_is_continuous_and_within_its_limit(bend: Trajectory) -> None:
    times, step = dense(bend)
    smooth, sharp = smooth_sample(bend, times, WIDTH), bend.sample(times)
    most = np.abs(smooth.snap).max()
    assert most <= 2.0 * 20.0 / WIDTH + 1e-6
    assert np.abs(np.diff(smooth.jerk, axis=0)).max() <= most * step * 1.001
    assert np.abs(np.diff(sharp.jerk, axis=0)).max() > 10.0
    for values, bound in zip(smooth[1:4], (2.0, 4.0, 20.0), strict=True):
        assert np.abs(values).max() <= bound * (1.0 + 1e-9)
    for values in smooth[1:]:
        assert not values[[0, -1]].any()


def test_it_stays_as_near_as_told(bend: Trajectory) -> None:
    times, step = dense(bend)
    smooth = smooth_sample(bend, times, WIDTH)
    way = bend.sample(times[:1]).position + np.cumsum(smooth.velocity, axis=0) * step
    assert np.abs(way - smooth.position).max() <= WIDTH**2 / 24.0 * 4.0 + 2.0 * step


def test_without_a_window_it_is_the_trajectory(bend: Trajectory) -> None:
    times, _ = dense(bend)
    for one, two in zip(smooth_sample(bend, times, 0.0), bend.sample(times), strict=False):
        assert np.array_equal(one, two)
