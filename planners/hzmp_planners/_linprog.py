"""The one place that talks to HiGHS for linear programs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SolverError


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
    count = cost.size
    low, high = np.broadcast_to(lo, count).tolist(), np.broadcast_to(hi, count).tolist()
    bounds = list(zip(low, high, strict=True))
    A, b = upper if upper is not None else (None, None)
    E, e = equal if equal is not None and len(equal[1]) else (None, None)
    # Simplex first; where planes nearly coincide it may end without a verdict that the interior
    # point method has. The default tolerance, 1e-7, is wider than the gaps decided here.
    strict = 1e-10
    for method in ("highs", "highs-ipm"):
        result = linprog(
            cost,
            A_ub=A,
            b_ub=b,
            A_eq=E,
            b_eq=e,
            bounds=bounds,
            method=method,
            options={"primal_feasibility_tolerance": strict, "dual_feasibility_tolerance": strict},
        )
        if result.status in (0, 2):
            break
    if result.status == 2:
        return None
    if result.status != 0 or result.x is None or result.fun is None:
        raise SolverError(f"{purpose}: the linear program ended with: {result.message}")
    return LinearOptimum(np.asarray(result.x), float(result.fun))
