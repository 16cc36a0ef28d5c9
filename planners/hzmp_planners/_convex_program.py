"""Convex programs over balls whose verdicts are checked, whatever solver they come from.

    minimise q.v  subject to  E v = e,  v in K,   K a product of balls and norm cones, all bounded

Since K is bounded, every vector y gives a lower bound by weak duality,

    q.v  =  e.y + (q - E'y).v  >=  e.y + min over w in K of (q - E'y).w  =  L(y)

and the inner minimum has a closed form on each block. So a solver's word is never taken: its point
is clipped into K and its residual recomputed, its multipliers become a bound, and the two must
meet. Infeasibility is proved by the same bound on the least residual.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array, eye_array, hstack

from hzmp_planners._arrays import Floats
from hzmp_planners._ball_program import Block, ConvexProgram, Matrix
from hzmp_planners._program_solvers import solve_by_interior_point, solve_by_simplex
from hzmp_planners.constants import GAP_TOL, RESIDUAL_TOL
from hzmp_planners.errors import SolverError


@dataclass(frozen=True, eq=False)
class Optimum:
    """A point whose residual and distance from the bound were recomputed."""

    v: Floats
    """Point of K, shape (nx,)."""
    value: float
    """q.v."""
    bound: float
    """L(y): no feasible point has a smaller value."""
    y: Floats
    """Multipliers that prove the bound, shape (m,)."""


def minimize(program: ConvexProgram, purpose: str) -> Optimum | None:
    """The verified optimum, or None when it is proved that no point of K has E v = e.

    Feasible means up to a residual of `RESIDUAL_TOL`, or up to a hundred times that where the
    feasible points have no room at all (two discs that touch) and no solver comes nearer.

    Args:
        program: what to solve.
        purpose: what it is solved for, for the error message.

    Raises:
        SolverError: neither solver returned a verdict that could be verified.
    """
    found = _attempt(program, RESIDUAL_TOL)
    if found is not None:
        return found
    if least_residual(program, purpose).bound > RESIDUAL_TOL:
        return None
    for room in (10.0 * RESIDUAL_TOL, 100.0 * RESIDUAL_TOL):
        found = _attempt(program, room)
        if found is not None:
            return found
        found = _attempt(_elastic(program, room), RESIDUAL_TOL)
        if found is not None:
            v = found.v[: program.q.size]
            return Optimum(v, float(program.q @ v), found.bound, found.y)
    raise SolverError(f"{purpose}: neither HiGHS nor Clarabel found a verdict that holds")


def least_residual(program: ConvexProgram, purpose: str) -> Optimum:
    """Minimise the largest entry of |E v - e| over K: always feasible, so always decided.

    Raises:
        SolverError: neither solver returned an optimum that could be verified.
    """
    m, nx = program.e.size, program.q.size
    most = float(np.abs(program.e).max(initial=0.0)) + 1.0
    relaxed = ConvexProgram(
        np.concatenate([np.zeros(nx), [1.0], np.zeros(m)]),
        _beside(program.E, csc_array((m, 1)), csc_array(eye_array(m))),
        program.e,
        (*program.blocks, Block(m + 1, math.inf, most, epigraph=True)),
    )
    for answer in _answers(relaxed):
        v = program.clip(answer[0][:nx])
        value = float(np.abs(program.E @ v - program.e).max(initial=0.0))
        bound = relaxed.lower_bound(answer[1])
        if bound > RESIDUAL_TOL or value - bound <= 10.0 * GAP_TOL * max(1.0, value):
            return Optimum(v, value, bound, answer[1])
    raise SolverError(f"{purpose}: neither HiGHS nor Clarabel found a verdict that holds")


def _beside(*matrices: Floats | Matrix) -> Floats | Matrix:
    """Columns of several matrices side by side; dense if the first one is."""
    if isinstance(matrices[0], np.ndarray):
        return np.hstack([m if isinstance(m, np.ndarray) else m.toarray() for m in matrices])
    return csc_array(hstack([csc_array(m) for m in matrices]))


def _elastic(program: ConvexProgram, room: float) -> ConvexProgram:
    """The same program with every equation free to miss by `room`."""
    m = program.e.size
    return ConvexProgram(
        np.append(program.q, np.zeros(m)),
        _beside(program.E, csc_array(eye_array(m))),
        program.e,
        (*program.blocks, Block(m, math.inf, room)),
    )


def _attempt(program: ConvexProgram, residual_tol: float) -> Optimum | None:
    """The first answer that passes the check."""
    for v, y in _answers(program):
        point = program.clip(v)
        value, bound = float(program.q @ point), program.lower_bound(y)
        close = value - bound <= GAP_TOL * max(1.0, abs(value))
        if close and program.residual(point) <= residual_tol:
            return Optimum(point, value, bound, y)
    return None


def _answers(program: ConvexProgram) -> Iterator[tuple[Floats, Floats]]:
    """Points and multipliers, unchecked, of one solver after the other."""
    if program.is_linear and (answer := solve_by_simplex(program)) is not None:
        yield answer
    # The first is more than Clarabel reaches: where it stops for want of progress, a nearest point
    # is as near as it can be had. Curved programs at times lose their way there, and not before.
    for tolerance in (1e-12, 1e-9, 1e-8):
        if (answer := solve_by_interior_point(program, tolerance)) is not None:
            yield answer
