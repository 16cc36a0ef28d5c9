"""What is asked of a generator form: support, emptiness, nearest points; a program each."""

from __future__ import annotations

import math

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners._ball_program import Block, ConvexProgram, conjugate, norm
from hzmp_planners._convex_program import Optimum, least_residual, minimize
from hzmp_planners.constants import RESIDUAL_TOL
from hzmp_planners.sets.form.form import GeneratorForm, diagonal


def farthest(form: GeneratorForm, d: Floats) -> Floats | None:
    """A point with the largest d.x; None when the set is empty.

    Raises:
        SolverError: no verdict that holds.
    """
    weights = d @ form.G
    if not form.b.size:
        factors = [_farthest_in_ball(part, ball.p) for ball, part in form.parts(weights)]
        return form.point(np.concatenate([np.zeros(0), *factors]))
    if not form.G.shape[1]:
        return None if np.abs(form.b).max() > RESIDUAL_TOL else form.c
    scale = sum(norm(part, conjugate(ball.p)) for ball, part in form.parts(weights)) or 1.0
    found = minimize(
        ConvexProgram(-weights / scale, *form.equations, form.blocks), "support of a set"
    )
    return None if found is None else form.point(found.v)


def is_empty(form: GeneratorForm) -> bool:
    """True when no factors in the balls satisfy the constraints, up to `RESIDUAL_TOL`.

    Raises:
        SolverError: no verdict that holds.
    """
    A, b = form.equations
    if not b.size:
        return False
    if (np.abs(b[~A.any(axis=1)]) > RESIDUAL_TOL).any():  # 0 = b for some b
        return True
    if not A.shape[1]:
        return False
    program = ConvexProgram(np.zeros(A.shape[1]), A, b, form.blocks)
    guess = program.clip(np.asarray(np.linalg.lstsq(A, b)[0], dtype=np.float64))
    if program.residual(guess) <= 0.1 * RESIDUAL_TOL:  # a point of the set: no program needed
        return False
    return least_residual(program, "emptiness of a set").bound > RESIDUAL_TOL


def distance_by_axes(form: GeneratorForm, x: Floats) -> float:
    """Least largest coordinate of x - z over points z of the set [m]; inf when empty.

    Raises:
        SolverError: no verdict that holds.
    """
    found = _nearest(form, x, math.inf)
    if found is None:
        return math.inf
    return float(np.abs(form.point(found.v[: form.G.shape[1]]) - x).max(initial=0.0))


def nearest_point(form: GeneratorForm, x: Floats) -> Floats | None:
    """Euclidean projection of x; None when the set is empty.

    Raises:
        SolverError: no verdict that holds.
    """
    found = _nearest(form, x, 2.0)
    return None if found is None else form.point(found.v[: form.G.shape[1]])


def _nearest(form: GeneratorForm, x: Floats, p: float) -> Optimum | None:
    unit = max(form.size, float(np.abs(x - form.c).max(initial=0.0)))
    return minimize(_gap_program(form, x - form.c, unit, p), "nearest point of a set")


def nearest_points(one: GeneratorForm, two: GeneratorForm) -> tuple[Floats, Floats] | None:
    """A pair of points, one of each set, at the least Euclidean distance; None if one is empty.

    Raises:
        SolverError: no verdict that holds.
    """
    offset = two.c - one.c
    unit = max(one.size, two.size, float(np.abs(offset).max(initial=0.0)))
    difference = one.plus(two.mapped(-np.eye(one.c.size)))
    found = minimize(_gap_program(difference, offset, unit, 2.0), "distance of two sets")
    if found is None:
        return None
    ng = one.G.shape[1]
    return one.point(found.v[:ng]), two.point(found.v[ng : ng + two.G.shape[1]])


def interior_slack(one: GeneratorForm, two: GeneratorForm) -> Optimum | None:
    """The slack program of corollary 3.3 on two generator forms; its value is -delta.

    max delta with |xi_1| <= 1 - delta and |xi_2| <= 1 - delta in the norm of each block, the
    constraints of both sets, and c_1 + G_1 xi_1 = c_2 + G_2 xi_2. None when no factors of any size
    (up to 4) satisfy them. Where delta > 0 the point is strictly inside both; delta = 0 is a
    contact only if no factor of the two forms is fixed.
    """
    unit = max(one.size, two.size, float(np.abs(two.c - one.c).max(initial=0.0)))
    A = diagonal(one.equations[0], two.equations[0])
    A = np.vstack([A, np.hstack([one.G, -two.G]) / unit])
    b = np.concatenate([one.equations[1], two.equations[1], (two.c - one.c) / unit])
    # Variables: per block its radius 1 - delta, then its factors; last delta.
    balls = one.balls + two.balls
    width = A.shape[1] + len(balls) + 1
    E = np.zeros((len(b) + len(balls), width))
    column = source = 0
    for k, ball in enumerate(balls):
        E[len(b) + k, [column, width - 1]] = 1.0
        E[: len(b), column + 1 : column + 1 + ball.size] = A[:, source : source + ball.size]
        column, source = column + 1 + ball.size, source + ball.size
    q = np.zeros(width)
    q[-1] = -1.0
    blocks = [Block(ball.size + 1, ball.p, 4.0, epigraph=True) for ball in balls]
    program = ConvexProgram(
        q, E, np.append(b, np.ones(len(balls))), (*blocks, Block(1, math.inf, 3.0))
    )
    return minimize(program, "slack of a contact")


def _gap_program(form: GeneratorForm, x: Floats, unit: float, p: float) -> ConvexProgram:
    """Minimise t with |G xi - x|_p <= t in units of length, over the factors of the set."""
    A, b = form.equations
    n, ng = form.G.shape
    farthest = float(np.linalg.norm(x) + np.linalg.norm(form.reaches(np.eye(n)))) / unit + 1.0
    E = np.zeros((len(b) + n, ng + 1 + n))
    E[: len(b), :ng] = A
    E[len(b) :, :ng] = form.G / unit
    E[len(b) :, ng + 1 :] = np.eye(n)
    q = np.zeros(ng + 1 + n)
    q[ng] = 1.0
    blocks = (*form.blocks, Block(n + 1, p, farthest, epigraph=True))
    return ConvexProgram(q, E, np.concatenate([b, x / unit]), blocks)


def _farthest_in_ball(weights: Floats, p: float) -> Floats:
    """A point of the unit ball with the largest inner product with the weights."""
    if p == math.inf:
        return np.sign(weights)
    size = np.abs(weights).max(initial=0.0)
    if size == 0.0:
        return np.zeros_like(weights)
    if p == 1.0:
        best = np.zeros_like(weights)
        j = int(np.abs(weights).argmax())
        best[j] = math.copysign(1.0, weights[j])
        return best
    powers = np.abs(weights / size) ** (conjugate(p) - 1.0)
    return np.asarray(np.sign(weights) * powers / norm(powers, p))
