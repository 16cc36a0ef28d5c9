"""Constrained convex generators (Silvestre 2022): one form for boxes and norm balls together."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from operator import index
from typing import Any

from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.form.form import Ball, GeneratorForm, join_balls
from hzmp_planners.sets.generator_set import GeneratorSet, checked_form


@dataclass(frozen=True, eq=False, init=False)
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
    balls: tuple[Ball, ...]
    """Size and norm p of each block of factors, in order: inf for a box, 2 for a ball."""

    def __init__(
        self,
        G: ArrayLike,
        c: ArrayLike,
        A: ArrayLike | None,
        b: ArrayLike | None,
        balls: Iterable[tuple[int, float]],
    ) -> None:
        matrices = checked_form(G, c, A, b)
        try:
            blocks = tuple(Ball(index(size), float(p)) for size, p in balls)
        except (TypeError, ValueError) as error:
            raise ShapeError(f"balls must be pairs of a size and a norm, got {balls}") from error
        ng = matrices[0].shape[1]
        if sum(ball.size for ball in blocks) != ng or any(ball.size < 0 for ball in blocks):
            raise ShapeError(f"balls must cover the {ng} generators once, got {blocks}")
        if not all(ball.p >= 1.0 for ball in blocks):
            raise ShapeError(f"the norms p of the balls must be at least 1, got {blocks}")
        vars(self).update(zip("GcAb", matrices, strict=True), balls=blocks)

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
