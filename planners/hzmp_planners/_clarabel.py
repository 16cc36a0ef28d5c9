"""The one place that talks to Clarabel."""

from __future__ import annotations

from dataclasses import dataclass

import clarabel
import numpy as np
from scipy.sparse import csc_array, csc_matrix

from hzmp_planners._arrays import Floats


@dataclass(frozen=True, eq=False)
class ConicSolution:
    """What the solver returned; nothing in it is trusted without recomputation."""

    x: Floats
    """Primal variables."""
    z: Floats
    """Dual variables, one a row."""
    solved: bool
    """Whether the solver met its tolerances."""


def solve_socp(
    cost: Floats,
    A: csc_array[np.float64],
    b: Floats,
    cones: list[tuple[str, int]],
    time_limit: float,
) -> ConicSolution:
    """Minimise cost.x subject to b - A x in a product of cones (Goulart and Chen 2024).

    Args:
        cost: shape (nx,).
        A: shape (m, nx).
        b: shape (m,).
        cones: ("zero" | "nonnegative" | "second_order", rows) in the order of the rows; a run of
            second-order cones of one size is written once per cone.
        time_limit: [s]; when it is reached the best iterate so far is returned, `solved` False.
    """
    kinds = {
        "zero": clarabel.ZeroConeT,
        "nonnegative": clarabel.NonnegativeConeT,
        "second_order": clarabel.SecondOrderConeT,
    }
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.time_limit = max(time_limit, 1e-3)
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-9
    nx = cost.size
    solver = clarabel.DefaultSolver(
        csc_matrix((nx, nx)),
        cost,
        csc_matrix(A),
        b,
        [kinds[kind](rows) for kind, rows in cones],
        settings,
    )
    solution = solver.solve()
    x, z = np.array(solution.x), np.array(solution.z)
    finite = bool(np.isfinite(x).all() and np.isfinite(z).all())
    solved = finite and str(solution.status) in ("Solved", "AlmostSolved")
    return ConicSolution(x, z, solved)
