"""Interval arithmetic on linear equations: cheap bounds that every solution satisfies."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from hzmp_planners._arrays import Bools, Floats
from hzmp_planners.constants import RESIDUAL_TOL

_MOST_ROUNDS = 50  # bounds may shrink for ever by less and less: any round's bounds are valid


def propagate(
    A: Floats | csr_array[np.float64],
    b: Floats,
    lo: Floats,
    hi: Floats,
    binary: Bools | None = None,
) -> tuple[Floats, Floats] | None:
    """Tighter bounds of the solutions of A xi = b with lo <= xi <= hi; None when there are none.

    From each row, xi_j = (b_i - sum over k != j of a_ik xi_k) / a_ij, evaluated on intervals, until
    no bound moves. Rows are expected to be scaled to unit size.

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
    strong = np.abs(values) > 1e-6  # smaller coefficients would magnify round-off
    for _ in range(_MOST_ROUNDS):
        ends = values * lo[columns], values * hi[columns]
        low, high = np.minimum(*ends), np.maximum(*ends)
        least = np.bincount(rows, low, len(b))
        most = np.bincount(rows, high, len(b))
        if (least > b + RESIDUAL_TOL).any() or (most < b - RESIDUAL_TOL).any():
            return None
        # Range of a_ij xi_j that row i leaves.
        rest_low = b[rows] - (most[rows] - high)
        rest_high = b[rows] - (least[rows] - low)
        with np.errstate(divide="ignore", invalid="ignore"):
            limits = rest_low / values, rest_high / values
        new_lo, new_hi = lo.copy(), hi.copy()
        np.maximum.at(new_lo, columns[strong], np.minimum(*limits)[strong])
        np.minimum.at(new_hi, columns[strong], np.maximum(*limits)[strong])
        if binary is not None:
            new_lo[binary & (new_lo > -1.0 + 1e-6)] = 1.0
            new_hi[binary & (new_hi < 1.0 - 1e-6)] = -1.0
        if (new_lo > new_hi + RESIDUAL_TOL).any():
            return None
        new_hi = np.maximum(new_lo, new_hi)
        moved = max(float((new_lo - lo).max(initial=0.0)), float((hi - new_hi).max(initial=0.0)))
        lo, hi = new_lo, new_hi
        if moved <= 1e-6:
            break
    return lo, hi
