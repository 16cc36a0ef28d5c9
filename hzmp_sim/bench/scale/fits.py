"""How the time grows with the number of obstacles."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hzmp_sim.bench.scale.results import Fit, WorldResult

SERIES = ("turned", "boxes", "flat")
"""Families that are measured at several counts."""


def series(worlds: Sequence[WorldResult], family: str) -> list[WorldResult]:
    """The worlds of a family, by count."""
    return sorted((w for w in worlds if w.family == family), key=lambda w: w.obstacles)


def fits_of(worlds: Sequence[WorldResult]) -> list[Fit]:
    """Exponents of all series with at least two counts."""
    found = []
    for family in SERIES:
        points = series(worlds, family)
        if len(points) < 2:
            continue
        counts = [point.obstacles for point in points]
        times = [point.total_s for point in points]
        slope = float(np.polyfit(np.log(counts), np.log(times), 1)[0])
        last = math.log(times[-1] / times[-2]) / math.log(counts[-1] / counts[-2])
        found.append(Fit(family, points[0].title, counts, slope, last))
    return found
