"""Sparse matrices at the door, and blocks of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array, csc_array, sparray

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.errors import ShapeError

Matrix = csc_array[np.float64]
MatrixLike = ArrayLike | sparray
"""Dense or sparse."""


def as_sparse(value: Any, name: str) -> Matrix:
    """A finite, read-only compressed copy of a dense or sparse matrix.

    Raises:
        ShapeError: not a matrix of finite numbers.
    """
    if isinstance(value, csc_array) and not value.data.flags.writeable:
        return csc_array(value, dtype=np.float64)  # one of ours: checked before
    try:
        matrix = csc_array(value).astype(np.float64)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{name} must be a matrix of numbers: {error}") from error
    if matrix.ndim != 2:
        raise ShapeError(f"{name} must have 2 axes, got {matrix.ndim}")
    if not np.isfinite(matrix.data).all():
        raise ShapeError(f"{name} must be finite")
    matrix.sum_duplicates()
    matrix.sort_indices()
    return frozen_matrix(matrix)


def frozen_matrix(matrix: Matrix) -> Matrix:
    """The same matrix, made read-only."""
    for part in (matrix.data, matrix.indices, matrix.indptr):
        part.setflags(write=False)
    return matrix


def zeros(rows: int, columns: int) -> Matrix:
    """A matrix of zeros."""
    return csc_array((rows, columns), dtype=np.float64)


def ones(rows: int, columns: int) -> Matrix:
    """A matrix of ones."""
    return csc_array(np.ones((rows, columns)))


def stack(blocks: list[list[Any]]) -> Matrix:
    """Blocks of dense or sparse matrices as one, read-only.

    One conversion for all of them: scipy's `block_array` makes several of each, which is most of
    the time of an operation on a small set.
    """
    rows: list[Ints] = []
    columns: list[Ints] = []
    values: list[Floats] = []
    top = left = 0
    for line in blocks:
        left = 0
        for block in line:
            entries: Any = block.tocoo() if hasattr(block, "tocoo") else coo_array(block)
            rows.append(entries.coords[0] + top)
            columns.append(entries.coords[1] + left)
            values.append(entries.data)
            left += entries.shape[1]
        top += np.shape(line[0])[0]
    where = np.concatenate(rows), np.concatenate(columns)
    return frozen_matrix(csc_array((np.concatenate(values), where), shape=(top, left)))
