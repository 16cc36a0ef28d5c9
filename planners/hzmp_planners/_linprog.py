"""The one place that talks to HiGHS."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csc_array

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SolverError

Matrix = csc_array[np.float64]


class LinearOptimum(NamedTuple):
    """Minimiser and minimum of a linear program."""

    x: Floats
    value: float


def minimize_linear(
    cost: Floats,
    *,
    upper: tuple[Floats, Floats] | None = None,
    equal: tuple[Floats, Floats] | None = None,
    lo: Floats | float = -np.inf,
    hi: Floats | float = np.inf,
    purpose: str,
) -> LinearOptimum | None:
    """Minimise cost.x subject to A x <= b, E x = e and lo <= x <= hi.

    Args:
        cost: shape (nx,).
        upper: (A, b), or None.
        equal: (E, e), or None.
        lo: bounds of all variables, or (nx,).
        hi: likewise.
        purpose: what it is solved for, for the error message.

    Returns:
        The optimum, or None when the constraints have no solution.

    Raises:
        SolverError: unbounded, or no verdict.
    """
    # Simplex first; where planes nearly coincide it may end without a verdict that the interior
    # point method has.
    result = _linprog(cost, upper, equal, lo, hi, "highs")
    if result.status not in (0, 2):
        result = _linprog(cost, upper, equal, lo, hi, "highs-ipm")
    if result.status == 2:
        return None
    if result.status != 0 or result.x is None or result.fun is None:
        raise SolverError(f"{purpose}: the linear program ended with: {result.message}")
    return LinearOptimum(np.asarray(result.x), float(result.fun))


class LinearAnswer(NamedTuple):
    """What HiGHS returned, unchecked: minimiser, and multipliers as rates of the minimum."""

    x: Floats
    upper: Floats
    """Multipliers of A x <= b, at most 0."""
    equal: Floats
    """Multipliers of E x = e."""


def attempt_linear(
    cost: Floats,
    *,
    upper: tuple[Matrix, Floats] | None,
    equal: tuple[Floats | Matrix, Floats],
    lo: Floats,
    hi: Floats,
) -> LinearAnswer | None:
    """What HiGHS has to say, unchecked; None when it has no optimum.

    Args:
        cost: shape (nx,).
        upper: (A, b), or None.
        equal: (E, e), possibly without rows.
        lo: bounds of the variables, shape (nx,).
        hi: likewise.
    """
    result = _linprog(cost, upper, equal, lo, hi, "highs")
    if result.status != 0 or result.x is None:
        return None
    return LinearAnswer(
        np.asarray(result.x),
        np.asarray(result.ineqlin.marginals) if upper is not None else np.zeros(0),
        np.asarray(result.eqlin.marginals) if equal[1].size else np.zeros(0),
    )


def _linprog(
    cost: Floats,
    upper: tuple[Any, Floats] | None,
    equal: tuple[Any, Floats] | None,
    lo: Floats | float,
    hi: Floats | float,
    method: Literal["highs", "highs-ipm"],
) -> Any:
    # The default tolerance, 1e-7, is wider than the gaps decided here.
    strict = 1e-10
    bounds = np.empty((cost.size, 2))
    bounds[:, 0], bounds[:, 1] = lo, hi
    A, b = upper if upper is not None else (None, None)
    E, e = equal if equal is not None and len(equal[1]) else (None, None)
    solve: Any = linprog  # the stubs know nothing of sparse matrices
    return solve(
        cost,
        A_ub=A,
        b_ub=b,
        A_eq=E,
        b_eq=e,
        bounds=bounds,
        method=method,
        options={"primal_feasibility_tolerance": strict, "dual_feasibility_tolerance": strict},
    )
