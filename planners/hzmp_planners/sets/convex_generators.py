"""Constrained convex generators (Silvestre 2022): one form for boxes and norm balls together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.form import Ball, GeneratorForm, join_balls
from hzmp_planners.sets.generator_set import GeneratorSet, checked_form


@dataclass(frozen=True, eq=False)
class ConstrainedConvexGenerator(GeneratorSet):
    r""":math:`\{c + G \xi : A \xi = b,\ \|\xi_k\|_{p_k} \le 1\}` for blocks :math:`\xi_k`."""

    G: Floats
    """Generators, shape (n, ng)."""
    c: Floats
    """Centre, shape (n,)."""
    A: Floats
    """Constraint matrix, shape (nc, ng)."""
    b: Floats
    """Constraint offsets, shape (nc,)."""
    balls: Sequence[Ball] = field(default=())
    """Size and norm p of each block of factors, in order: inf for a box, 2 for a ball."""

    def __post_init__(self) -> None:
        G, c, A, b = checked_form(self.G, self.c, self.A, self.b)
        balls = tuple(Ball(int(size), float(p)) for size, p in self.balls)
        covered = sum(ball.size for ball in balls)
        if covered != G.shape[1] or any(ball.size < 0 for ball in balls):
            raise ShapeError(f"balls must cover the {G.shape[1]} generators once, got {balls}")
        if not all(ball.p >= 1.0 for ball in balls):
            raise ShapeError(f"the norms p of the balls must be at least 1, got {balls}")
        for name, value in (("G", G), ("c", c), ("A", A), ("b", b), ("balls", balls)):
            object.__setattr__(self, name, value)

    def _make_form(self) -> GeneratorForm:
        return GeneratorForm(self.G, self.c, self.A, self.b, join_balls(self.balls, ()))

    @classmethod
    def _of_form(cls, form: GeneratorForm) -> ConstrainedConvexGenerator:
        return cls(form.G, form.c, form.A, form.b, form.balls)

    def _fields(self) -> dict[str, Any]:
        A = {"shape": list(self.A.shape), "values": self.A.ravel().tolist()}
        balls = [[ball.size, str(ball.p)] for ball in self.balls]
        fields = {"G": self.G.tolist(), "c": self.c.tolist(), "A": A, "b": self.b.tolist()}
        return fields | {"balls": balls}
