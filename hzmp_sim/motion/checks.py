"""Checks of what a script says: numbers, positions and switches, each refused in one line."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hzmp_planners.errors import QueryError


def items(name: str, value: Any) -> list[Any]:
    """The items of a list."""
    if isinstance(value, str) or not hasattr(value, "__iter__"):
        raise QueryError(f"{name} must be a list, got {value!r}")
    return list(value)


def number(name: str, value: Any) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise QueryError(f"{name} must be a number, got {value!r}")
    if not math.isfinite(value):
        raise QueryError(f"{name} must be finite, got {value!r}")
    return float(value)


def numbers(name: str, value: Any) -> tuple[float, ...]:
    """Finite numbers."""
    return tuple(number(f"{name}[{k}]", item) for k, item in enumerate(items(name, value)))


def position(name: str, value: Any) -> tuple[float, ...]:
    """Three finite numbers."""
    row = numbers(name, value)
    if len(row) != 3:
        raise QueryError(f"{name} must have 3 coordinates, got {len(row)}: {list(row)}")
    return row


def boolean(name: str, value: Any) -> None:
    """True or false."""
    if not isinstance(value, bool):
        raise QueryError(f"{name} must be true or false, got {value!r}")
