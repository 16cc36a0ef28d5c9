"""Numbers of several runs: a run without a path counts as one that never ends."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence

History = Sequence[Sequence[float]]
"""(time [s], cost [m]) each time the cost improved."""

_RESOLUTION = 0.01  # relative distance of times that `thinned` keeps apart
_Z = 1.959963984540054  # of the normal distribution, for 95 %


def wilson(successes: int, runs: int) -> tuple[float, float]:
    """Wilson's interval of a success rate, 95 %: sound for few runs, and near 0 and 1.

    Args:
        successes: of so many runs.
        runs: at least 1.
    """
    rate, z2 = successes / runs, _Z * _Z / runs
    middle = (rate + z2 / 2.0) / (1.0 + z2)
    reach = math.sqrt(rate * (1.0 - rate) * z2 + z2 * z2 / 4.0) / (1.0 + z2)
    low = 0.0 if successes == 0 else middle - reach
    return low, 1.0 if successes == runs else middle + reach


def median(values: Iterable[float]) -> float:
    """The median; infinite values are among the largest, and no values have an infinite one."""
    known = list(values)
    return statistics.median(known) if known else math.inf


def first_time(history: History) -> float:
    """When there was a path at all [s]; inf: never."""
    return history[0][0] if history else math.inf


def improvements(
    history: Iterable[tuple[float, float, float]], shift: float = 0.0
) -> tuple[list[list[float]], list[list[float]]]:
    """When the cost improved, and when the lower bound did.

    Args:
        history: (time [s], cost [m], lower bound [m]), as `Plan.history` has them.
        shift: what to add to the times [s].

    Returns:
        (time [s], cost [m]) and (time [s], lower bound [m]) of each improvement.
    """
    costs: list[list[float]] = []
    bounds: list[list[float]] = []
    for when, cost, bound in history:
        if math.isfinite(cost) and (not costs or cost < costs[-1][1]):
            costs.append([shift + when, cost])
        if math.isfinite(bound) and (not bounds or bound > bounds[-1][1]):
            bounds.append([shift + when, bound])
    return costs, bounds


def cost_at(history: History, time_s: float) -> float:
    """Cost at a time [m]; inf before the first path."""
    return min((cost for when, cost in history if when <= time_s), default=math.inf)


def time_to(history: History, cost: float) -> float:
    """When a cost was reached [s]; inf: never."""
    return next((when for when, reached in history if reached <= cost), math.inf)


def time_to_gap(history: History, bounds: History, gap: float) -> float:
    """When (cost - bound) / bound was at most a gap [s]; inf: never.

    Args:
        history: (time [s], cost [m]).
        bounds: (time [s], lower bound [m]).
        gap: relative.
    """
    for when in sorted(time for time, _ in (*history, *bounds)):
        bound = max((value for time, value in bounds if time <= when), default=0.0)
        if cost_at(history, when) - bound <= gap * bound:
            return when
    return math.inf


def thinned(history: History) -> list[list[float]]:
    """The first entry, and costs at times at least 1 % apart.

    What comes earlier than that counts for the time before: up to 1 % in favour of the planner.
    """
    kept = [list(entry) for entry in history[:1]]
    for when, cost in history[1:]:
        if len(kept) > 1 and when < kept[-1][0] * (1.0 + _RESOLUTION):
            kept[-1][1] = cost
        else:
            kept.append([when, cost])
    return kept


def ratio(one: float, two: float) -> float:
    """Quotient of two times; inf over inf is 1 (both failed)."""
    if math.isinf(one) and math.isinf(two):
        return 1.0
    return one / two
