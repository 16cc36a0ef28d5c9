"""What a planner in the loop pays: follow the moving obstacles, plan at once, grow the first cells.

Prints a table: CPU time of each step on one core, median and 99th percentile over the moves.
Every move starts from the space of the static obstacles; what a query prepares in an updated space
is paid for each time. The last path is offered as the old one.

    python benchmarks/replanning_update.py [--moves 200]
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import cyclopts
import numpy as np
from numpy.typing import NDArray

import hzmp_sim as hz

SIDE = 10.0
"""Of the workspace [m]."""
STATIC = {2: (60, 0.15, 0.4), 3: (200, 0.2, 0.5)}
"""For each dimension the number of static boxes and their least and greatest half side [m]."""
MOVING = {2: (3, 10, 20), 3: (1, 3, 10)}
"""Numbers of boxes that move, by dimension."""
SWEPT = 0.6
"""How far a moving box gets at the most while a plan is valid, along each axis [m]."""
CELLS = 6
"""Of the first segments, as many as a trajectory over the next second needs."""
NEAR = 0.3
"""Start and goal are this far from two opposite corners of the workspace, along each axis [m]."""

Floats = NDArray[np.float64]
Box = tuple[Floats, Floats]
T = TypeVar("T")


class Times(NamedTuple):
    """CPU time of the steps of one move [ms]."""

    update: float
    path: float
    cells: float


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """CPU time [ms] and result."""
    began = time.process_time()
    result = work()
    return 1e3 * (time.process_time() - began), result


def is_clear(box: Box, n: int) -> bool:
    """Whether a box leaves room around start and goal."""
    low, high = box
    return not any(
        ((low - NEAR < x) & (high + NEAR > x)).all()
        for x in (np.full(n, NEAR), np.full(n, SIDE - NEAR))
    )


def drawn(n: int, count: int, make: Callable[[], Box]) -> list[hz.Polytope]:
    """Boxes that leave room around start and goal."""
    boxes: list[Box] = []
    while len(boxes) < count:
        box = make()
        if is_clear(box, n):
            boxes.append(box)
    return [hz.Polytope.from_box(*box) for box in boxes]


def static_box(rng: np.random.Generator, n: int) -> Box:
    """A box that stays where it is."""
    _, least, greatest = STATIC[n]
    middle, half = rng.uniform(0.5, SIDE - 0.5, n), rng.uniform(least, greatest, n)
    return middle - half, middle + half


def swept_box(rng: np.random.Generator, n: int) -> Box:
    """What a box of 0.6 m covers on its way."""
    middle, way = rng.uniform(1.5, SIDE - 1.5, n), rng.uniform(-SWEPT, SWEPT, n)
    return np.minimum(middle, middle + way) - 0.3, np.maximum(middle, middle + way) + 0.3


def measure(n: int, moving: int, moves: int) -> list[Times]:
    """The times of each move in a random world."""
    rng = np.random.default_rng(n)
    static = drawn(n, STATIC[n][0], lambda: static_box(rng, n))
    space = hz.FreeSpace.decompose((np.zeros(n), np.full(n, SIDE)), static)
    start, goal = np.full(n, NEAR), np.full(n, SIDE - NEAR)
    old = hz.Planner(space, start, goal).first_path()
    found = []
    for _ in range(moves):
        obstacles = drawn(n, moving, lambda: swept_box(rng, n))
        update, now = timed(lambda: space.with_obstacles(obstacles))  # noqa: B023
        path, plan = timed(lambda: hz.Planner(now, start, goal, warm_start=old).first_path())  # noqa: B023
        cells, _ = timed(lambda: plan.cells(now, count=CELLS))  # noqa: B023
        found.append(Times(update, path, cells))
        old = plan if len(plan.waypoints) else old
    return found


def main(moves: int = 200) -> None:
    """Measure and print.

    Args:
        moves: of the moving obstacles, for each row.
    """
    print(
        f"| static + moving boxes | update [ms] | first path [ms] | {CELLS} cells [ms] | all [ms] |"
    )
    print("|---|---|---|---|---|")
    for n in STATIC:
        for moving in MOVING[n]:
            times = np.array(measure(n, moving, moves))
            columns = np.column_stack([times, times.sum(axis=1)]).T
            cells = [f"{np.median(x):.1f} / {np.quantile(x, 0.99):.1f}" for x in columns]
            print(f"| {n}-D, {STATIC[n][0]} + {moving} | {' | '.join(cells)} |")


if __name__ == "__main__":
    cyclopts.run(main)
