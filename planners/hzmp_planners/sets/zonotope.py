"""Zonotopes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats
from hzmp_planners.sets.form.form import Ball, GeneratorForm, join_balls
from hzmp_planners.sets.generator_set import GeneratorSet, checked_form


@dataclass(frozen=True, eq=False, init=False)
class Zonotope(GeneratorSet):
    r""":math:`Z = \{c + G \xi : \|\xi\|_\infty \le 1\}`."""

    G: Floats
    """Generators, shape (n, ng)."""
    c: Floats
    """Centre, shape (n,)."""

    def __init__(self, G: ArrayLike, c: ArrayLike) -> None:
        generators, centre, _, _ = checked_form(G, c)
        vars(self).update(G=generators, c=centre)

    def _make_form(self) -> GeneratorForm:
        _, _, A, b = checked_form(self.G, self.c)
        balls = join_balls((Ball(self.G.shape[1], math.inf),), ())
        return GeneratorForm(self.G, self.c, A, b, balls)

    @classmethod
    def _of_form(cls, form: GeneratorForm) -> Zonotope:
        return cls._unchecked(form, G=form.G, c=form.c)

    def _fields(self) -> dict[str, Any]:
        return {"G": self.G.tolist(), "c": self.c.tolist()}
