"""Ellipsotopes (Kousik, Dai and Gao 2023); with one 2-norm group the planner's informed sets."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from operator import index
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hzmp_planners._arrays import Floats, as_floats, as_point
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets.form.form import Ball, GeneratorForm, join_balls
from hzmp_planners.sets.generator_set import GeneratorSet, checked_form

if TYPE_CHECKING:
    from hzmp_planners.sets.convex_set import ConvexSet
    from hzmp_planners.sets.hybrid_zonotope import HybridZonotope


@dataclass(frozen=True, eq=False, init=False)
class Ellipsotope(GeneratorSet):
    r""":math:`E = \{c + G \xi : \|\xi_J\|_p \le 1\ \forall J \in \mathcal{I},\ A \xi = b\}`.

    Without more arguments one group and no constraints: an ellipsoid with half-axes G.
    """

    G: Floats
    """Generators, shape (n, ng)."""
    c: Floats
    """Centre, shape (n,)."""
    A: Floats
    """Constraint matrix, shape (nc, ng)."""
    b: Floats
    """Constraint offsets, shape (nc,)."""
    groups: tuple[tuple[int, ...], ...]
    """The index set: groups of generator indices that hold each index once."""
    p: float
    """Norm of every group, at least 1."""

    def __init__(
        self,
        G: ArrayLike,
        c: ArrayLike,
        A: ArrayLike | None = None,
        b: ArrayLike | None = None,
        groups: Iterable[Iterable[int]] | None = None,
        p: float = 2.0,
    ) -> None:
        matrices = checked_form(G, c, A, b)
        ng = matrices[0].shape[1]
        try:
            given = [range(ng)] if groups is None else [list(group) for group in groups]
            indices = tuple(tuple(map(index, group)) for group in given if group)
        except TypeError as error:
            raise ShapeError(f"groups must be lists of integers, got {groups}") from error
        if sorted(j for group in indices for j in group) != list(range(ng)):
            raise ShapeError(f"groups must hold each index from 0 to {ng - 1} once, got {indices}")
        if not p >= 1.0:
            raise ShapeError(f"p must be at least 1, got {p}")
        vars(self).update(zip("GcAb", matrices, strict=True), groups=indices, p=float(p))

    @classmethod
    def from_shape_matrix(cls, Q: ArrayLike, c: ArrayLike) -> Ellipsotope:
        r"""The ellipsoid :math:`\{x : (x - c)^T Q^{-1} (x - c) \le 1\}`, with G the root of Q.

        Raises:
            ShapeError: Q is not symmetric positive definite. A flat ellipsoid has no inverse of Q:
                give its half-axes as generators G.
        """
        shape = as_floats(Q, "Q", 2)
        centre = as_point(c, "c", shape.shape[0])
        size = float(np.abs(shape).max(initial=0.0))
        if shape.shape[0] != shape.shape[1] or not np.allclose(shape, shape.T, atol=1e-12 * size):
            raise ShapeError(f"Q must be square and symmetric, got shape {shape.shape}")
        values, vectors = np.linalg.eigh(shape)
        if values.min(initial=math.inf) <= 1e-14 * size:
            raise ShapeError(
                f"Q must be positive definite, but its least eigenvalue is {values.min():.3g}; "
                "give a flat ellipsoid by its half-axes, Ellipsotope(G, c)"
            )
        return cls((vectors * np.sqrt(values)) @ vectors.T, centre)

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

    def _make_form(self) -> GeneratorForm:
        order = [j for group in self.groups for j in group]
        balls = join_balls([Ball(len(group), self.p) for group in self.groups], ())
        return GeneratorForm(self.G[:, order], self.c, self.A[:, order], self.b, balls)

    @classmethod
    def _of_form(cls, form: GeneratorForm) -> Ellipsotope:
        """Boxes become groups of one; all other balls must have one norm."""
        groups: list[range] = []
        start = 0
        for ball in form.balls:
            step = 1 if ball.p == math.inf else ball.size
            groups += [range(j, j + step) for j in range(start, start + ball.size, step)]
            start += ball.size
        norms = {ball.p for ball in form.balls if ball.p != math.inf} or {2.0}
        return cls(form.G, form.c, form.A, form.b, groups, norms.pop())

    def classify(self, leaves: HybridZonotope | Sequence[ConvexSet]) -> NDArray[np.int8]:
        """`Activity` of each polytopal leaf, shape (N,): inactive, partial or active (lemma 3.6).

        Raises:
            ShapeError: another dimension, an empty or a curved leaf.
            SolverError: no verdict that holds.
        """
        from hzmp_planners.sets.activity import classify

        return classify(self, leaves)

    def _fields(self) -> dict[str, Any]:
        return {
            "G": self.G.tolist(),
            "c": self.c.tolist(),
            "A": {"shape": list(self.A.shape), "values": self.A.ravel().tolist()},
            "b": self.b.tolist(),
            "groups": [list(group) for group in self.groups],
            "p": str(self.p),
        }
