import numpy as np
import pytest

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope
from hzmp_tracking import Limits, Trajectory
from hzmp_tracking.containment import cubic_maxima, derivative_maxima, violations
from hzmp_tracking.cover import cover


def slow_maximum(coefficients: Floats, h: float) -> float:
    """Reference: dense sampling and numpy's polynomial roots."""
    p = np.polynomial.Polynomial(coefficients)
    roots = p.deriv().trim(1e-300).roots() if np.any(coefficients[1:]) else np.zeros(0)
    times = [t.real for t in np.atleast_1d(roots) if 0 <= t.real <= h and abs(t.imag) < 1e-6 * h]
    return float(p(np.concatenate([np.linspace(0, h, 501), times])).max())


@pytest.mark.parametrize("shrink", [(1, 1, 1, 1), (1, 1, 1, 1e-9), (1, 1, 1e-12, 1e-14),
                                    (1, 1, 0, 0), (1, 0, 1, 0), (1, 0, 0, 1), (1, 0, 0, 0),
                                    (1, 1e-13, 1, 1), (1e6, 1, 1, 1)])  # fmt: skip
def test_cubic_maxima_agree_with_a_slow_reference(shrink: tuple[float, ...]) -> None:
    rng = np.random.default_rng(1)
    C = rng.normal(size=(200, 4)) * np.array(shrink)
    h = rng.uniform(0.01, 3.0, 200)
    slow = np.array([slow_maximum(c, t) for c, t in zip(C, h, strict=True)])
    excess = (cubic_maxima(C, h) - slow) / max(shrink)
    assert excess.min() >= -1e-14  # nothing is missed
    assert excess.max() <= 1e-8  # the companion matrix is the less accurate of the two


def test_a_piece_of_no_duration_is_its_start() -> None:
    assert cubic_maxima(np.array([[2.0, 5.0, 1.0, 1.0]]), np.zeros(1))[0] == 2.0


def test_a_spike_between_samples_is_caught() -> None:
    # From 1 mm inside to 1 mm outside and back in 40 us, between two samples of a 1 kHz check.
    width, height = 20e-6, 1e-3
    still = np.zeros((1, 4, 2))
    still[0, 0, 0] = 1.0 - height
    spike = still.copy()
    spike[0, 1:3, 0] = [4.0 * height / width, -2.0 * height / width**2]
    C = np.concatenate([still, spike, still])
    cell = Polytope.from_box([-1, -1], [1, 1])
    times = np.cumsum([0.0, 0.5003, 2 * width, 0.5])
    trajectory = Trajectory(times, C, np.zeros(3, dtype=np.int64), (cell,), np.zeros((2, 2)),
                            Limits())  # fmt: skip
    sampled = trajectory.sample(np.arange(0.0, times[-1], 1e-3)).position
    assert cell.violation(sampled).max() < 0.0
    assert trajectory.containment == pytest.approx(height, rel=1e-9)


def test_round_off_is_zero_and_more_is_not() -> None:
    cell = Polytope.from_box([0.0], [1.0])
    for outside, reported in ((1e-14, 0.0), (-1e-14, 0.0), (1e-9, 1e-9)):
        still = np.array([[[1.0 + outside], [0.0], [0.0], [0.0]]])
        values = violations(still, np.ones(1), np.array([0]), (cell,))
        assert values[0] == pytest.approx(reported, abs=1e-15)


def test_derivative_maxima_are_those_of_dense_samples() -> None:
    rng = np.random.default_rng(2)
    C, h = rng.normal(size=(6, 4, 3)), rng.uniform(0.2, 1.0, 6)
    fine = [np.linspace(0, t, 20001)[:, None] for t in h]
    v = [np.abs(c[1] + s * (2 * c[2] + 3 * s * c[3])).max(0) for c, s in zip(C, fine, strict=True)]
    a = [np.abs(2 * c[2] + 6 * s * c[3]).max(0) for c, s in zip(C, fine, strict=True)]
    velocity, acceleration, jerk = derivative_maxima(C, h)
    assert np.allclose(velocity, np.max(v, axis=0), rtol=1e-7)
    assert np.allclose(acceleration, np.max(a, axis=0), rtol=1e-12)
    assert np.allclose(jerk, np.abs(6 * C[:, 3]).max(0), rtol=1e-15)


def test_cover_cuts_a_run_at_shared_faces() -> None:
    cells = [Polytope.from_box([k, 0.0], [k + 1.0, 1.0]) for k in range(4)]
    run = np.zeros((1, 4, 2))
    run[0, 0], run[0, 1] = [0.5, 0.5], [1.0, 0.0]
    C, h, owners = cover(run, np.array([3.0]), [(0, 4)], cells)
    assert owners.tolist() == [0, 1, 2, 3]
    assert h == pytest.approx([0.5, 1.0, 1.0, 0.5])
    assert violations(C, h, owners, cells).max() == 0.0


def test_cover_changes_over_inside_an_overlap() -> None:
    cells = [Polytope.from_box([0, 0], [2, 1]), Polytope.from_box([1, 0], [3, 1])]
    run = np.zeros((1, 4, 2))
    run[0, 0], run[0, 1] = [0.5, 0.5], [1.0, 0.0]
    C, h, owners = cover(run, np.array([2.0]), [(0, 2)], cells)
    assert owners.tolist() == [0, 1]
    assert violations(C, h, owners, cells).max() == pytest.approx(-0.5)


def test_cover_is_honest_about_what_no_cell_holds() -> None:
    cells = [Polytope.from_box([0.0], [1.0]), Polytope.from_box([1.2], [2.0])]
    run = np.array([[[0.5], [1.0], [0.0], [0.0]]])
    C, h, owners = cover(run, np.array([1.0]), [(0, 2)], cells)
    assert violations(C, h, owners, cells).max() == pytest.approx(0.2)
