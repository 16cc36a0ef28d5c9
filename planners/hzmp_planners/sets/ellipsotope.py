"""Ellipsotopes (Kousik, Dai and Gao 2023) with one 2-norm group: the planner's informed sets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Bools, Floats, as_floats, as_point, as_points
from hzmp_planners.errors import QueryError, ShapeError


@dataclass(frozen=True, eq=False)
class Ellipsotope:
    r""":math:`E = \{c + G \xi : \|\xi\|_2 \le 1\}`."""

    G: Floats
    """Generators, shape (n, ng)."""
    c: Floats
    """Centre, shape (n,)."""

    def __post_init__(self) -> None:
        G, c = as_floats(self.G, "G", 2), as_floats(self.c, "c", 1)
        if G.shape[0] != c.shape[0]:
            raise ShapeError(f"G has {G.shape[0]} rows but c has {c.shape[0]} entries")
        object.__setattr__(self, "G", G)
        object.__setattr__(self, "c", c)

    @classmethod
    def informed(cls, start: ArrayLike, goal: ArrayLike, cost: float) -> Ellipsotope:
        r"""All points through which a path from start to goal of length <= cost can pass.

        :math:`\{x : |x - s| + |x - g| \le c\}` (eqs. 38 to 41 of the HZ-MP paper), with
        :math:`G = r_2 I + (r_1 - r_2) a a^T`, :math:`a` the unit vector from s to g,
        :math:`r_1 = c/2`, :math:`r_2 = \sqrt{c^2 - |g - s|^2}/2`.

        Raises:
            QueryError: cost is less than the distance of start and goal.
        """
        s = as_floats(start, "start", 1)
        g = as_point(goal, "goal", s.size)
        distance = float(np.linalg.norm(g - s))
        if not distance * (1.0 - 1e-12) <= cost < math.inf:
            raise QueryError(
                f"cost must be finite and at least |goal - start| = {distance}: {cost}"
            )
        minor = math.sqrt(max(cost * cost - distance * distance, 0.0)) / 2.0
        axis = (g - s) / distance if distance > 0.0 else np.zeros(s.size)
        G = minor * np.eye(s.size) + (cost / 2.0 - minor) * np.outer(axis, axis)
        return cls(G, (s + g) / 2.0)

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.c.size)

    @property
    def ng(self) -> int:
        """Number of generators."""
        return int(self.G.shape[1])

    def support(self, d: ArrayLike) -> float:
        """Largest d.x over the set, d of shape (n,): d.c + |G'd|_2."""
        direction = as_point(d, "d", self.n)
        return float(direction @ self.c + np.linalg.norm(self.G.T @ direction))

    def interval_hull(self) -> tuple[Floats, Floats]:
        """Smallest axis-aligned box (lo, hi)."""
        reach = np.linalg.norm(self.G, axis=1)
        return self.c - reach, self.c + reach

    def contains(self, X: ArrayLike, tol: float = 1e-9) -> Bools:
        """Which of the points (k, n) lie in the set, up to `tol` [m]; shape (k,).

        The factors of least norm are found by the pseudo-inverse; a point off the range of G by
        more than `tol` is outside.
        """
        offset = as_points(X, "X", self.n) - self.c
        factors = offset @ np.linalg.pinv(self.G).T
        inside = factors / np.maximum(1.0, np.linalg.norm(factors, axis=1))[:, None]
        return np.asarray(np.linalg.norm(inside @ self.G.T - offset, axis=1) <= tol)
