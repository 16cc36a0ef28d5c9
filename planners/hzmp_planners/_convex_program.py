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

    Feasible means up to a residual of `RESIDUAL_TOL`.

    Args:
        program: what to solve.
        purpose: what it is solved for, for the error message.

    Raises:
        SolverError: neither solver returned a verdict that could be verified.
    """
    found = _attempt(program)
    if found is not None:
        return found
    nearest = least_residual(program, purpose)
    if nearest.bound > RESIDUAL_TOL:
        return None
    found = _attempt(_elastic(program, 10.0 * RESIDUAL_TOL))
    if found is None:
        raise SolverError(f"{purpose}: neither HiGHS nor Clarabel found a verdict that holds")
    nx = program.q.size
    return Optimum(found.v[:nx], float(program.q @ found.v[:nx]), found.bound, found.y)


def least_residual(program: ConvexProgram, purpose: str) -> Optimum:
    """Minimise the largest entry of |E v - e| over K: always feasible, so always decided.

    Raises:
        SolverError: neither solver returned an optimum that could be verified.
    """
    m = program.e.size
    most = float(np.abs(program.e).max(initial=0.0)) + 1.0
    relaxed = ConvexProgram(
        np.concatenate([np.zeros(program.q.size), [1.0], np.zeros(m)]),
        _beside(program.E, csc_array((m, 1)), csc_array(eye_array(m))),
        program.e,
        (*program.blocks, Block(m + 1, math.inf, most, epigraph=True)),
    )
    found = _attempt(relaxed)
    if found is None:
        raise SolverError(f"{purpose}: neither HiGHS nor Clarabel found a verdict that holds")
    return found


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


def _attempt(program: ConvexProgram) -> Optimum | None:
    """Ask one solver after the other for an optimum that passes the check."""
    if program.is_linear:
        found = _checked(program, solve_by_simplex(program))
        if found is not None:
            return found
    # The first is more than Clarabel reaches: where it stops for want of progress, a nearest point
    # is as near as it can be had. Curved programs at times lose their way there, and not before.
    for tolerance in (1e-12, 1e-9, 1e-8):
        found = _checked(program, solve_by_interior_point(program, tolerance))
        if found is not None:
            return found
    return None


def _checked(program: ConvexProgram, answer: tuple[Floats, Floats] | None) -> Optimum | None:
    if answer is None:
        return None
    v, y = program.clip(answer[0]), answer[1]
    value, bound = float(program.q @ v), program.lower_bound(y)
    close = value - bound <= GAP_TOL * max(1.0, abs(value))
    return Optimum(v, value, bound, y) if close and program.residual(v) <= RESIDUAL_TOL else None
