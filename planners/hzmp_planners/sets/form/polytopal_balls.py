"""Curved sets between polytopal ones: norm balls replaced by polytopes."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners._ball_program import conjugate
from hzmp_planners.errors import QueryError
from hzmp_planners.sets.form.form import Ball, GeneratorForm, diagonal
from hzmp_planners.sets.hulls.sampling import spread_directions

if TYPE_CHECKING:
    from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope


def with_polytopal_balls(
    form: GeneratorForm, directions: int, outside: bool
) -> ConstrainedZonotope:
    """The set with every curved ball replaced by a polytope around it, or inside it.

    A ball's polytope < G', c', A', b' > takes its place by substitution: xi_k = c' + G' eta with
    A' eta = b'. Constraints and generators stay the same maps, so the result encloses the set, or
    is enclosed by it, exactly.

    Args:
        form: the set.
        directions: number of tangents or points a ball.
        outside: around rather than inside.

    Raises:
        QueryError: too few directions to bound a ball.
    """
    from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope

    parts = [_polytope(ball, directions, outside) for ball in form.balls]
    if not parts:
        return ConstrainedZonotope(form.G, form.c, form.A, form.b)
    G, c = diagonal(*(part.G for part in parts)), np.concatenate([part.c for part in parts])
    A = np.vstack([form.A @ G, diagonal(*(part.A for part in parts))])
    b = np.concatenate([form.b - form.A @ c, *(part.b for part in parts)])
    return ConstrainedZonotope(form.G @ G, form.c + form.G @ c, A, b)


def _polytope(ball: Ball, directions: int, outside: bool) -> GeneratorForm:
    m = ball.size
    whole = GeneratorForm(
        np.eye(m), np.zeros(m), np.zeros((0, m)), np.zeros(0), (Ball(m, math.inf),)
    )
    if ball.p == math.inf:
        return whole
    if directions < m + 1:
        raise QueryError(
            f"directions must be at least {m + 1} for a ball of {m} factors: {directions}"
        )
    D = _directions(m, directions)
    if outside:
        # The box is around every norm ball; tangent d.x <= |d|_q, q the conjugate of p.
        return whole.cut(D, np.linalg.norm(D, conjugate(ball.p), axis=1))
    return GeneratorForm.of_points(D / np.linalg.norm(D, ball.p, axis=1)[:, None])


def _directions(m: int, count: int) -> Floats:
    """Spread directions; beyond three factors with all axes among them, so that none is missed."""
    if m <= 3:
        return spread_directions(m, count)
    axes = np.vstack([np.eye(m), -np.eye(m)])
    few = itertools.islice(itertools.product((-1.0, 1.0), repeat=m), count)
    corners = np.array(list(few)) / math.sqrt(m)
    spread = spread_directions(m, max(count - len(axes) - len(corners), 0))
    return np.vstack([axes, corners, spread])
