"""Zonotopes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Bools, Floats, as_floats, as_point, as_points
from hzmp_planners._linprog import minimize_linear
from hzmp_planners.errors import ShapeError


@dataclass(frozen=True, eq=False)
class Zonotope:
    r""":math:`Z = \{c + G \xi : \|\xi\|_\infty \le 1\}`."""

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

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.c.size)

    @property
    def ng(self) -> int:
        """Number of generators."""
        return int(self.G.shape[1])

    def support(self, d: ArrayLike) -> float:
        """Largest d.x over the set, d of shape (n,): d.c + |G'd|_1."""
        direction = as_point(d, "d", self.n)
        return float(direction @ self.c + np.abs(self.G.T @ direction).sum())

    def interval_hull(self) -> tuple[Floats, Floats]:
        """Smallest axis-aligned box (lo, hi)."""
        reach = np.abs(self.G).sum(axis=1)
        return self.c - reach, self.c + reach

    def contains(self, X: ArrayLike, tol: float = 1e-9) -> Bools:
        """Which of the points (k, n) lie in the set, up to `tol` in each coordinate; shape (k,)."""
        points = as_points(X, "X", self.n)
        empty = np.zeros((0, self.ng))
        return np.array(
            [factor_residual(self.G, x - self.c, empty, np.zeros(0)) <= tol for x in points],
            dtype=np.bool_,
        )


def factor_residual(G: Floats, x: Floats, A: Floats, b: Floats) -> float:
    """Least t such that |G xi - x|_inf <= t for some |xi|_inf <= 1 with A xi = b; inf if none.

    The residual is recomputed from the factors that the solver returned.

    Raises:
        SolverError: the linear program ended without a verdict.
    """
    n, ng = G.shape
    ones = np.ones((n, 1))
    optimum = minimize_linear(
        np.append(np.zeros(ng), 1.0),
        upper=(np.block([[G, -ones], [-G, -ones]]), np.concatenate([x, -x])),
        equal=(np.hstack([A, np.zeros((len(b), 1))]), b),
        lo=np.append(-np.ones(ng), 0.0),
        hi=np.append(np.ones(ng), math.inf),
        purpose="membership of a point",
    )
    if optimum is None:
        return math.inf
    factors = np.clip(optimum.x[:-1], -1.0, 1.0)
    gaps = np.concatenate([np.abs(G @ factors - x), np.abs(A @ factors - b)])
    return float(gaps.max(initial=0.0))
