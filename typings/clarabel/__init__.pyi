# Just the calls used. Cones multiply as in Clarabel: A x + s = b, s in the product of the cones.
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csc_matrix

class DefaultSettings:
    direct_solve_method: str
    max_iter: int
    max_threads: int
    presolve_enable: bool
    iterative_refinement_enable: bool
    time_limit: float
    tol_feas: float
    tol_gap_abs: float
    tol_gap_rel: float
    verbose: bool
    def __init__(self) -> None: ...

class DefaultSolution:
    iterations: int
    obj_val: float
    obj_val_dual: float
    r_dual: float
    r_prim: float
    s: list[float]
    solve_time: float
    status: SolverStatus
    x: list[float]
    z: list[float]

class DefaultSolver:
    def __init__(
        self,
        P: csc_array[np.float64] | csc_matrix[np.float64],
        q: NDArray[np.float64],
        A: csc_array[np.float64] | csc_matrix[np.float64],
        b: NDArray[np.float64],
        cones: Sequence[_Cone],
        settings: DefaultSettings,
    ) -> None: ...
    def solve(self) -> DefaultSolution: ...

class NonnegativeConeT(_Cone):
    def __init__(self, dim: int) -> None: ...

class PowerConeT(_Cone):
    def __init__(self, alpha: float) -> None: ...

class SecondOrderConeT(_Cone):
    def __init__(self, dim: int) -> None: ...

class SolverStatus:  # not an enum.Enum: str(status) is its name
    AlmostDualInfeasible: ClassVar[SolverStatus]
    AlmostPrimalInfeasible: ClassVar[SolverStatus]
    AlmostSolved: ClassVar[SolverStatus]
    CallbackTerminated: ClassVar[SolverStatus]
    DualInfeasible: ClassVar[SolverStatus]
    InsufficientProgress: ClassVar[SolverStatus]
    MaxIterations: ClassVar[SolverStatus]
    MaxTime: ClassVar[SolverStatus]
    NumericalError: ClassVar[SolverStatus]
    PrimalInfeasible: ClassVar[SolverStatus]
    Solved: ClassVar[SolverStatus]
    Unsolved: ClassVar[SolverStatus]

class ZeroConeT(_Cone):
    def __init__(self, dim: int) -> None: ...

class _Cone: ...
