"""Constrained zonotopes (Scott, Raimondo, Marseglia and Braatz 2016)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, as_floats
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.form.form import Ball, GeneratorForm, join_balls
from hzmp_planners.sets.generator_set import GeneratorSet, checked_form


@dataclass(frozen=True, eq=False, init=False)
class ConstrainedZonotope(GeneratorSet):
    r""":math:`Z = \{c + G \xi : \|\xi\|_\infty \le 1,\ A \xi = b\}`."""

    G: Floats
    """Generators, shape (n, ng)."""
    c: Floats
    """Centre, shape (n,)."""
    A: Floats
    """Constraint matrix, shape (nc, ng)."""
    b: Floats
    """Constraint offsets, shape (nc,)."""

    def __init__(self, G: ArrayLike, c: ArrayLike, A: ArrayLike, b: ArrayLike) -> None:
        vars(self).update(zip("GcAb", checked_form(G, c, A, b), strict=True))

    @classmethod
    def from_vertices(cls, V: ArrayLike) -> ConstrainedZonotope:
        """Convex hull of the k rows of V (k, n), with k generators and one constraint.

        x = V' lam, 1'lam = 1, 0 <= lam <= 1, in factors xi = 2 lam - 1: < V'/2, V'1/2, 1', 2-k >.
        """
        vertices = as_floats(V, "V", 2)
        if vertices.shape[0] == 0:
            raise ShapeError("V must hold at least one vertex")
        if vertices.shape[1] == 0:
            raise ShapeError("V must have at least one column: a set needs a space")
        return cls.of_known_vertices(vertices)

    @classmethod
    def of_known_vertices(cls, vertices: Floats) -> ConstrainedZonotope:
        """`from_vertices` for an array that has been checked."""
        hull = cls._of_form(GeneratorForm.of_points(vertices))
        hull._remember_points(vertices)
        return hull

    def _make_form(self) -> GeneratorForm:
        balls = join_balls((Ball(self.G.shape[1], math.inf),), ())
        return GeneratorForm(self.G, self.c, self.A, self.b, balls)

    @classmethod
    def _of_form(cls, form: GeneratorForm) -> ConstrainedZonotope:
        return cls._unchecked(form, G=form.G, c=form.c, A=form.A, b=form.b)

    def _fields(self) -> dict[str, Any]:
        known = {} if self._points is None else {"points": self._points.tolist()}
        A = {"shape": list(self.A.shape), "values": self.A.ravel().tolist()}
        return {"G": self.G.tolist(), "c": self.c.tolist(), "A": A, "b": self.b.tolist()} | known
