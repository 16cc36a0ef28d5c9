"""Interval arithmetic on linear equations: cheap bounds that every solution satisfies."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from hzmp_planners._arrays import Bools, Floats
from hzmp_planners.constants import RESIDUAL_TOL

_MOST_ROUNDS = 50  # bounds may shrink for ever by less and less: any round's bounds are valid
_STEP = 1e-6
"""Smaller gains are left alone, and so are fixed variables. A bound that is computed again from
bounds that it gave itself would multiply round-off by a row's coefficients with each round."""


def propagate(
    A: Floats | csr_array[np.float64],
    b: Floats,
    lo: Floats,
    hi: Floats,
    binary: Bools | None = None,
) -> tuple[Floats, Floats] | None:
    """Tighter bounds of the solutions of A xi = b with lo <= xi <= hi; None when there are none.

    From each row, xi_j = (b_i - sum over k != j of a_ik xi_k) / a_ij, evaluated on intervals, until
    no bound moves. Rows are expected to be scaled to unit size; None needs a contradiction of more
    than `_STEP`, and what is closer is left to a program.

    Args:
        A: shape (m, k), dense or sparse.
        b: shape (m,).
        lo: shape (k,).
        hi: shape (k,).
        binary: which variables take only the values -1 and 1, shape (k,).
    """
    matrix = csr_array(A)
    lo, hi = lo.copy(), hi.copy()
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    columns, values = matrix.indices, matrix.data
    strong = np.abs(values) > 1e-4  # smaller coefficients would magnify round-off
    for _ in range(_MOST_ROUNDS):
        ends = values * lo[columns], values * hi[columns]
        low, high = np.minimum(*ends), np.maximum(*ends)
        least = np.bincount(rows, low, len(b))
        most = np.bincount(rows, high, len(b))
        if (least > b + _STEP).any() or (most < b - _STEP).any():
            return None
        # Range of a_ij xi_j that row i leaves.
        rest_low = b[rows] - (most[rows] - high)
        rest_high = b[rows] - (least[rows] - low)
        with np.errstate(divide="ignore", invalid="ignore"):
            limits = rest_low / values, rest_high / values
        above, below = lo.copy(), hi.copy()
        np.maximum.at(above, columns[strong], np.minimum(*limits)[strong])
        np.minimum.at(below, columns[strong], np.maximum(*limits)[strong])
        if binary is not None:
            above[binary & (above > -1.0 + _STEP)] = 1.0
            below[binary & (below < 1.0 - _STEP)] = -1.0
        if (above > below + _STEP).any():
            return None
        raised = (above > lo + _STEP) & (hi > lo)
        lowered = (below < hi - _STEP) & (hi > lo)
        lo, hi = np.where(raised, above, lo), np.where(lowered, below, hi)
        crossed = lo > hi
        lo[crossed] = hi[crossed] = (lo + hi)[crossed] / 2.0
        close = hi - lo <= RESIDUAL_TOL
        lo[close] = hi[close] = (lo + hi)[close] / 2.0
        if not (raised | lowered).any():
            break
    return lo, hi
