"""What the decomposition is asked for, each with what was measured."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from hzmp_sim.bench.scale.results import (
    EXACT,
    Fit,
    MovingResult,
    Target,
    WorldResult,
    worst_cover,
)

MOST_SECONDS = {
    ("turned", 1000): 6.0,
    ("boxes", 200): 0.4,
    ("flat", 35): 0.01,
    ("squares", 2401): 1.0,
}
"""Time of decomposition and leaf graph, by family and count [s]."""
MOST_MB = {("turned", 1000): 1000.0}
"""Peak memory [MB]."""
MOST_LEAVES = 0.6
"""Leaves of dense worlds, of the naive order's."""
MOST_UPDATE_S = 0.02
"""Update and leaf graph when 10 of 200 obstacles move, median [s]."""
MOST_EXPONENT = 1.15
"""Of time over count at constant density."""

_NAMES = {
    "turned": "turned obstacles in 3-D",
    "boxes": "boxes in 3-D",
    "flat": "boxes in 2-D",
    "squares": "squares on a grid",
}


def targets_of(
    worlds: Sequence[WorldResult], moving: Sequence[MovingResult], fits: Sequence[Fit]
) -> list[Target]:
    """All targets; those of worlds that were not measured say so."""
    known = {(world.family, world.obstacles): world for world in worlds}
    targets = []
    for (family, count), limit in MOST_SECONDS.items():
        world = known.get((family, count))
        total = None if world is None else world.total_s
        targets.append(_time(f"{count:,} {_NAMES[family]}, with leaf graph", limit, total))
    for (family, count), limit in MOST_MB.items():
        world = known.get((family, count))
        peak = None if world is None else world.peak_mb
        targets.append(Target(f"{count:,} {_NAMES[family]}: peak memory", limit, "MB", peak))
    ratios = [w.leaf_ratio for w in worlds if w.family == "dense" and w.obstacles == 233]
    worst = max((100.0 * ratio for ratio in ratios if ratio is not None), default=None)
    asked = "leaves of 233 dense boxes in 3-D, of the naive order's, worst world"
    targets.append(Target(asked, 100.0 * MOST_LEAVES, "%", worst))
    for row in moving:
        measured = row.obstacles == 200 and row.moved == 10
        for how, times in (
            ("on the space of the others", row.static_s),
            ("by their numbers", row.numbered_s),
        ):
            asked = f"10 of 200 {_NAMES[row.family]} move, with leaf graph: {how}"
            median = statistics.median(times) if measured and times else None
            targets.append(_time(asked, MOST_UPDATE_S, median))
    for fit in fits:
        asked = f"exponent of time over count, {_NAMES[fit.family]}"
        targets.append(Target(asked, MOST_EXPONENT, "", fit.exponent))
    asked = "leaves and union of obstacles fill the workspace: worst relative error"
    targets.append(Target(asked, EXACT, "", worst_cover(worlds, moving)))
    misplaced = float(sum(world.misplaced for world in worlds))
    return [*targets, Target("points on the wrong side, in all worlds", 0.0, "", misplaced)]


def _time(asked: str, limit: float, measured: float | None) -> Target:
    """A target in the unit that suits it."""
    if limit >= 0.1:
        return Target(asked, limit, "s", measured)
    return Target(asked, 1e3 * limit, "ms", None if measured is None else 1e3 * measured)
