"""One door to Clarabel for the linear and second-order cone programs of this package."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import clarabel
import numpy as np
from scipy import sparse

from hzmp_planners._arrays import Floats


def solve(
    cost: Floats, rows: sparse.csc_array, offsets: Floats, cones: Sequence[Any]
) -> Floats | None:
    """Minimise cost.x subject to offsets - rows x in the product of cones; None if not solved."""
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.presolve_enable = False
    quadratic = sparse.csc_array((cost.size, cost.size))
    solution = clarabel.DefaultSolver(quadratic, cost, rows, offsets, cones, settings).solve()
    solved = (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved)
    if solution.status not in solved:
        return None
    x = np.array(solution.x)
    return x if bool(np.isfinite(x).all()) else None
