"""Numbers as words of a table; infinite ones too."""

from __future__ import annotations

import math

from hzmp_sim.bench.tables import seconds

NEVER = "inf"


def times(value: float) -> str:
    """A time [s]."""
    return NEVER if math.isinf(value) else seconds(value)


def costs(value: float, digits: int = 3) -> str:
    """A ratio, or a count: so many digits after the point, fewer for large ones."""
    if math.isinf(value):
        return NEVER
    if value >= 100.0:
        digits = 0
    elif value >= 10.0:
        digits = min(digits, 1)
    return f"{value:,.{digits}f}"
