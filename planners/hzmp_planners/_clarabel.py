"""The one place that talks to Clarabel."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import clarabel
import numpy as np
from scipy.sparse import csc_array, csc_matrix

from hzmp_planners._arrays import Floats

Cone = tuple[Literal["zero", "nonnegative", "second_order"], int] | tuple[Literal["power"], float]
"""Kind and number of rows; of a power cone (three rows) the exponent."""

_KINDS = {
    "zero": clarabel.ZeroConeT,
    "nonnegative": clarabel.NonnegativeConeT,
    "second_order": clarabel.SecondOrderConeT,
}


def _cone(cone: Cone) -> Any:
    if cone[0] == "power":
        return clarabel.PowerConeT(cone[1])
    return _KINDS[cone[0]](cone[1])


def second_order_cones(rows: int, count: int) -> list[Cone]:
    """`count` second-order cones of one size."""
    return [("second_order", rows) for _ in range(count)]


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
    A: csc_array[np.float64] | csc_matrix[np.float64],
    b: Floats,
    cones: Sequence[Cone],
    time_limit: float = math.inf,
    tolerance: float = 1e-9,
    refine: bool = True,
) -> ConicSolution:
    """Minimise cost.x subject to b - A x in a product of cones (Goulart and Chen 2024).

    Args:
        cost: shape (nx,).
        A: shape (m, nx).
        b: shape (m,).
        cones: kind and number of rows of each cone, in the order of the rows; without rows it is
            left out. A power cone holds (x, y, z) with x^a y^(1-a) >= |z|, a its exponent.
        time_limit: [s]; before an iteration that would run over it the last iterate is returned,
            `solved` False. Setting up takes about as long as three iterations.
        tolerance: of feasibility and gap, where iterations stop.
        refine: the solutions of linear systems. A third of the time, for accuracy that loose
            tolerances do not need.
    """
    last = time.perf_counter()
    deadline = last + time_limit
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1  # the same result on every machine
    settings.presolve_enable = False  # it only looks for infinite offsets
    settings.iterative_refinement_enable = refine
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    nx = cost.size
    solver: Any = clarabel.DefaultSolver(
        csc_matrix((nx, nx)),
        cost,
        csc_matrix(A),
        b,
        [_cone(cone) for cone in cones if cone[1]],
        settings,
    )

    def late(_info: object) -> bool:
        nonlocal last
        before, last = last, time.perf_counter()
        return 2.0 * last - before > deadline

    if math.isfinite(time_limit):
        solver.set_termination_callback(late)
    solution = solver.solve()
    x, z = np.array(solution.x), np.array(solution.z)
    finite = bool(np.isfinite(x).all() and np.isfinite(z).all())
    solved = finite and str(solution.status) in ("Solved", "AlmostSolved")
    return ConicSolution(x, z, solved)
