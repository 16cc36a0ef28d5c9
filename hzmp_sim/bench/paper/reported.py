"""What the paper reports (arXiv 2507.09309 v4), to be quoted beside what is measured here.

Its laptop has a processor of 1.5 GHz and runs MATLAB; the planners beside it are OMPL's in C++.
Only the numbers of table 1 that we could check against its text are here.
"""

from __future__ import annotations

from dataclasses import dataclass

MAZE_ITERATIONS = 8
MAZE_STARS = (1, 2, 5, 8)
"""Iterations at which a better path was found, figure 6."""
MAZE_COST = 698.603
"""Final cost in the maze of section 4.1 [cm]; its optimum is not reported."""


@dataclass(frozen=True)
class Reported:
    """A row of table 1: defaultRandomRectangles2D, 100 runs of 0.1 s; None: not quoted here."""

    planner: str
    success: float
    first_s: tuple[float | None, float | None, float | None]
    """Time of the first path [s]: least, median, greatest."""
    first_cost: float | None
    """Its cost, median."""
    cost: tuple[float | None, float | None, float | None]
    """Final cost: least, median, greatest."""


TABLE_1 = (
    Reported("Informed RRT*", 0.12, (None, None, None), None, (None, None, None)),
    Reported("BIT*", 0.62, (None, None, None), None, (None, None, None)),
    Reported("AIT*", 0.71, (None, None, None), None, (None, None, None)),
    Reported("EIT*", 1.00, (0.021, 0.028, 0.123), 1.056, (0.819, 0.858, None)),
    Reported("HZ-MP", 1.00, (0.002, None, 0.003), None, (1.007, 1.007, 1.007)),
)
LEAST_COST = 0.819
"""The shortest path that anyone found in the paper's scene."""
