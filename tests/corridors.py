"""Corridors for tests of trajectories, and everything that a trajectory promises."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope
from hzmp_tracking import Limits, Trajectory

LIMITS = Limits(velocity=2.0, acceleration=4.0, jerk=20.0)
L_SHAPE = (
    [[0.5, 0.5], [3.0, 0.5], [3.5, 1.0], [3.5, 3.5]],
    [Polytope.from_box(*box) for box in (([0, 0], [3, 1]), ([3, 0], [4, 1]), ([3, 1], [4, 4]))],
)


def check(
    trajectory: Trajectory,
    waypoints: ArrayLike,
    cells: Sequence[Polytope],
    limits: Limits,
    containment: float = 0.0,
) -> None:
    """Everything that a trajectory promises, by dense samples beside its own certificates."""
    points = np.asarray(waypoints, dtype=float)
    assert trajectory.containment <= containment
    for peak, bound in zip(trajectory.peaks, limits.per_axis(points.shape[1]), strict=True):
        assert (peak <= bound * (1 + 1e-9)).all()
    t = np.linspace(0.0, trajectory.duration, 4001)
    sample = trajectory.sample(t)
    inside = np.min([cell.violation(sample.position) for cell in cells], axis=0)
    assert inside.max() <= 1e-12 * max(1.0, np.abs(points).max())
    assert np.allclose(sample.position[[0, -1]], points[[0, -1]], atol=1e-12)
    assert not sample.velocity[-1].any()
    step = t[1] - t[0]
    # Continuous up to the acceleration: samples differ by no more than the next derivative allows.
    for lower, upper in ((0, 1), (1, 2), (2, 3)):
        jumps = np.abs(np.diff(sample[lower][:-1], axis=0)).max()
        assert jumps <= step * np.abs(sample[upper]).max() * 1.001 + 1e-7
    for k in range(1, len(points) - 1):
        via = trajectory.waypoints[k]
        assert max(cells[k - 1].violation(via)[0], cells[k].violation(via)[0]) <= 1e-10


def random_boxes(rng: np.random.Generator, K: int, n: int) -> tuple[Floats, list[Polytope]]:
    """A chain of boxes that share faces, with random points on them."""
    lo, hi = np.zeros(n), rng.uniform(0.3, 2.0, n)
    cells, points = [Polytope.from_box(lo, hi)], [(lo + hi) / 2]
    for _ in range(K - 1):
        axis, size = int(rng.integers(n)), rng.uniform(0.05, 2.0, n)
        low = lo + rng.uniform(-0.4, 0.6, n) * (hi - lo)
        high = np.maximum(low + size, lo + 0.2 * (hi - lo))
        low[axis], high[axis] = hi[axis], hi[axis] + size[axis]
        a, b = np.maximum(lo, low), np.minimum(hi, high)
        points.append(a + (b - a) * rng.uniform(0.0, 1.0, n))
        points[-1][axis] = hi[axis]
        lo, hi = low, high
        cells.append(Polytope.from_box(lo, hi))
    points.append((lo + hi) / 2)
    return np.array(points), cells
