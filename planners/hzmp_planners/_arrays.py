"""Checks at the door: arrays come in as anything array-like and leave as read-only float64."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hzmp_planners.errors import ShapeError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def frozen(array: NDArray[Any]) -> NDArray[Any]:
    """The same array, made read-only."""
    array.setflags(write=False)
    return array


def as_floats(value: ArrayLike, name: str, ndim: int) -> Floats:
    """A finite, read-only float copy of `value` with `ndim` axes.

    Raises:
        ShapeError: not numeric, another number of axes, or an entry that is not finite.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{name} must be an array of numbers: {error}") from error
    if array.ndim != ndim:
        raise ShapeError(f"{name} must have {ndim} axes, got shape {array.shape}")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ShapeError(f"{name} must be finite, but entry {where} is {array[where]}")
    frozen(array)
    return array


def as_point(value: ArrayLike, name: str, n: int) -> Floats:
    """A finite read-only point of shape (n,)."""
    point = as_floats(value, name, 1)
    if point.shape != (n,):
        raise ShapeError(f"{name} must have {n} coordinates, got {point.shape[0]}")
    return point


def as_points(value: ArrayLike, name: str, n: int) -> Floats:
    """Finite read-only points of shape (k, n); one point of shape (n,) is taken as (1, n)."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{name} must be an array of numbers: {error}") from error
    points = as_floats(array[None, :] if array.ndim == 1 and array.size else array, name, 2)
    if points.shape[1] != n:
        raise ShapeError(f"{name} must have {n} columns, got shape {points.shape}")
    return points


def finite(value: float) -> float | None:
    """The number, or None where JSON has none for it: inf and nan."""
    return value if math.isfinite(value) else None


def as_count(value: int, name: str) -> int:
    """A number of things, 0 or more."""
    if not isinstance(value, int | np.integer) or value < 0:
        raise ShapeError(f"{name} must be an integer of at least 0, got {value!r}")
    return int(value)
