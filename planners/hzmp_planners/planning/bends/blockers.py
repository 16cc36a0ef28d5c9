"""What stops a line of sight: convex obstacles, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ragged import counts_of, starts_of
from hzmp_planners.constants import NORMAL_TOL
from hzmp_planners.free_space.boxes import overlapping_bounds
from hzmp_planners.sets import Polytope


@dataclass(frozen=True, eq=False)
class Blockers:
    """Convex bodies without their surfaces, as padded arrays of half-spaces."""

    A: Floats
    """Outward unit normals, shape (m, f, n); bodies with fewer facets repeat their last one."""
    b: Floats
    """Shape (m, f) [m]."""
    lows: Floats
    """Lowest coordinates of each body, shape (m, n) [m]."""
    highs: Floats
    """Highest coordinates of each body, shape (m, n) [m]."""

    def __len__(self) -> int:
        return len(self.b)

    def take(self, rows: Ints) -> Blockers:
        """Some of the bodies."""
        return Blockers(self.A[rows], self.b[rows], self.lows[rows], self.highs[rows])

    def within(self, lo: Floats, hi: Floats) -> Blockers:
        """Those whose bounds meet a box."""
        return self.take(np.flatnonzero((self.lows < hi).all(1) & (self.highs > lo).all(1)))

    def heights(self, points: Floats) -> Floats:
        """Signed distance of points (..., n) beyond each facet plane, shape (..., m, f) [m]."""
        m, f, n = self.A.shape
        heights = points @ self.A.reshape(-1, n).T - self.b.ravel()
        return np.asarray(heights.reshape(*points.shape[:-1], m, f))


def below(start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Where heights that go linearly from start (t = 0) to end (t = 1) are all negative.

    Args:
        start: heights above the facets of a body, shape (c, f); rows are independent.
        end: the same at the other end.

    Returns:
        The interval of t for each row, shape (c,) each; empty where the first is not less.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        at = start / (start - end)
    enters = np.where(start >= 0.0, np.where(end < 0.0, at, np.inf), 0.0).max(axis=1)
    leaves = np.where(end >= 0.0, np.where(start < 0.0, at, -np.inf), 1.0).min(axis=1)
    return enters, leaves


def build_blockers(obstacles: Sequence[Polytope]) -> Blockers:
    """Obstacles that all have an interior."""
    if not obstacles:
        return Blockers(np.zeros((0, 1, 3)), np.zeros((0, 1)), np.zeros((0, 3)), np.zeros((0, 3)))
    starts = starts_of(np.array([len(block.b) for block in obstacles], dtype=np.int64))
    counts = counts_of(starts)
    rows = starts[:-1, None] + np.minimum(np.arange(counts.max()), counts[:, None] - 1)
    bounds = np.array([block.interval_hull() for block in obstacles])
    return Blockers(
        np.concatenate([block.A for block in obstacles])[rows],
        np.concatenate([block.b for block in obstacles])[rows],
        bounds[:, 0],
        bounds[:, 1],
    )


def any_touch(blockers: Blockers, tol: float) -> bool:
    """Whether two bodies have facets on one plane, from opposite sides, and touch or nearly so."""
    one, two = overlapping_bounds(
        blockers.lows, blockers.highs, blockers.lows, blockers.highs, -tol
    )
    for i, j in zip(one[one < two].tolist(), two[one < two].tolist(), strict=True):
        close = np.abs(blockers.b[i][:, None] + blockers.b[j]) < tol
        f, g = np.nonzero(close)
        if (np.abs(blockers.A[i][f] + blockers.A[j][g]) < NORMAL_TOL).all(axis=1).any():
            return True
    return False
