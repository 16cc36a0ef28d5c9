"""Constrained zonotopes (Scott, Raimondo, Marseglia and Braatz 2016)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Bools, Floats, as_floats, as_point, as_points
from hzmp_planners._linprog import minimize_linear
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.zonotope import factor_residual


@dataclass(frozen=True, eq=False)
class ConstrainedZonotope:
    r""":math:`Z = \{c + G \xi : \|\xi\|_\infty \le 1,\ A \xi = b\}`."""

    G: Floats
    """Generators, shape (n, ng)."""
    c: Floats
    """Centre, shape (n,)."""
    A: Floats
    """Constraint matrix, shape (nc, ng)."""
    b: Floats
    """Constraint offsets, shape (nc,)."""

    def __post_init__(self) -> None:
        G, c = as_floats(self.G, "G", 2), as_floats(self.c, "c", 1)
        A, b = as_floats(self.A, "A", 2), as_floats(self.b, "b", 1)
        if G.shape[0] != c.shape[0]:
            raise ShapeError(f"G has {G.shape[0]} rows but c has {c.shape[0]} entries")
        if A.shape != (b.shape[0], G.shape[1]):
            raise ShapeError(
                f"A must have shape ({b.shape[0]}, {G.shape[1]}) for these b and G, got {A.shape}"
            )
        for name, value in (("G", G), ("c", c), ("A", A), ("b", b)):
            object.__setattr__(self, name, value)

    @classmethod
    def from_vertices(cls, V: ArrayLike) -> ConstrainedZonotope:
        """Convex hull of the k rows of V (k, n), with k generators and one constraint.

        x = V' lam, 1'lam = 1, 0 <= lam <= 1, in factors xi = 2 lam - 1: < V'/2, V'1/2, 1', 2-k >.
        """
        vertices = as_floats(V, "V", 2)
        k = vertices.shape[0]
        if k == 0:
            raise ShapeError("V must hold at least one vertex")
        half = vertices.T / 2.0
        return cls(half, half.sum(axis=1), np.ones((1, k)), np.array([2.0 - k]))

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.c.size)

    @property
    def ng(self) -> int:
        """Number of generators."""
        return int(self.G.shape[1])

    @property
    def nc(self) -> int:
        """Number of constraints."""
        return int(self.b.size)

    def support(self, d: ArrayLike) -> float:
        """Largest d.x over the set, d of shape (n,); -inf when empty.

        Raises:
            SolverError: the linear program ended without a verdict.
        """
        direction = as_point(d, "d", self.n)
        if self.ng == 0:  # a point, or nothing: no program to solve
            return -math.inf if self.b.any() else float(direction @ self.c)
        optimum = minimize_linear(
            -(self.G.T @ direction), equal=(self.A, self.b), lo=-1.0, hi=1.0, purpose="support"
        )
        return -math.inf if optimum is None else float(direction @ self.c) - optimum.value

    def is_empty(self) -> bool:
        """True when no factors satisfy the constraints."""
        return self.support(np.zeros(self.n)) == -math.inf

    def contains(self, X: ArrayLike, tol: float = 1e-9) -> Bools:
        """Which of the points (k, n) lie in the set, up to `tol` in each coordinate; shape (k,)."""
        points = as_points(X, "X", self.n)
        return np.array(
            [factor_residual(self.G, x - self.c, self.A, self.b) <= tol for x in points],
            dtype=np.bool_,
        )
