"""Trajectories planned again in flight: the table of docs/trajectories.md, section control loop.

Corridors of 3 to 8 cells are cut from plans through random worlds of boxes; those whose path does
not bend are left out, and half of them get cells of up to 25 facets. Each is timed from rest, then
from states anywhere on that trajectory, with and without the rest of it as `previous`.

    python benchmarks/replanning.py
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator
from typing import NamedTuple

import cyclopts
import numpy as np
from numpy.typing import NDArray

import hzmp_sim as hz

LIMITS = hz.Limits(velocity=2.0, acceleration=4.0, jerk=30.0)
SIZE = 10.0
"""Side of the worlds [m]."""
BOXES = {2: (70, 0.3, 0.7), 3: (150, 0.5, 1.0)}
"""By dimension: their number, and the range of their half sides [m]."""


class Corridor(NamedTuple):
    """What is timed."""

    waypoints: NDArray[np.float64]
    cells: list[hz.Polytope]


class Trial(NamedTuple):
    """One call."""

    duration: float | None
    """[s]; None when no trajectory was found."""
    cpu: float
    """[ms]"""


def corridors(n: int, count: int, rng: np.random.Generator) -> Iterator[Corridor]:
    """Corridors in n dimensions."""
    made = 0
    boxes, low, high = BOXES[n]
    while made < count:
        centres = rng.uniform(0.05 * SIZE, 0.95 * SIZE, (boxes, n))
        sides = rng.uniform(low, high, (2, boxes, n))
        obstacles = [
            hz.Polytope.from_box(c - a, c + b)
            for c, a, b in zip(centres, sides[0], sides[1], strict=True)
        ]
        space = hz.FreeSpace.decompose((np.zeros(n), np.full(n, SIZE)), obstacles)
        for _ in range(10):
            ends = rng.uniform(0.0, SIZE, (2, n))
            if (space.leaf_of(ends) < 0).any():
                continue
            plan = hz.plan(space, ends[0], ends[1], time_limit=0.3)
            cells = plan.cells(space) if len(plan.leaves) >= 3 else ()
            if made == count or not cells:
                continue
            length = min(len(cells), int(rng.integers(3, 9)))
            first = int(rng.integers(0, len(cells) - length + 1))
            points = plan.waypoints[first : first + length + 1]
            if _turn(points) > 0.5:
                made += 1
                chain = list(cells[first : first + length])
                yield Corridor(points, _cut(points, chain, rng) if made % 2 else chain)


def _turn(points: NDArray[np.float64]) -> float:
    """Sum of the changes of direction."""
    sides = np.diff(points, axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    ahead = sides[lengths > 1e-6] / lengths[lengths > 1e-6, None]
    return float(np.linalg.norm(np.diff(ahead, axis=0), axis=1).sum())


def _cut(
    points: NDArray[np.float64], cells: list[hz.Polytope], rng: np.random.Generator
) -> list[hz.Polytope]:
    """The cells with further facets, at 5 to 80 cm from the path."""
    cut = []
    for k, cell in enumerate(cells):
        more = max(int(rng.integers(5, 26)) - cell.b.size, 0)
        A = rng.normal(size=(more, cell.n))
        A /= np.linalg.norm(A, axis=1)[:, None]
        b = (A @ points[k : k + 2].T).max(axis=1) + rng.uniform(0.05, 0.8, more)
        cut.append(hz.Polytope(np.vstack([cell.A, A]), np.concatenate([cell.b, b])))
    return cut


def timed(corridor: Corridor, **options: object) -> tuple[Trial, hz.Trajectory | None]:
    """One call of `time_parameterize`, checked."""
    began = time.process_time()
    try:
        found = hz.time_parameterize(corridor.waypoints, corridor.cells, LIMITS, **options)  # type: ignore[arg-type]
        proved = found.containment <= 0.0 and found.limit_usage.max() <= 1.0 + 1e-9
    except hz.HzmpError:
        found, proved = None, False
    spent = 1e3 * (time.process_time() - began)
    if found is None or not proved:
        return Trial(None, spent), None
    return Trial(found.duration, spent), found


def report(name: str, pairs: list[tuple[Trial, float]]) -> None:
    """A row: trials beside the durations that they are compared with."""
    ratios = [trial.duration / other for trial, other in pairs if trial.duration and other > 0.3]
    spent = [trial.cpu for trial, _ in pairs]
    failed = sum(trial.duration is None for trial, _ in pairs)
    print(
        f"| {name} | {len(pairs)} | {failed} | {statistics.median(ratios):.3f} | "
        f"{np.quantile(ratios, 0.95):.3f} | {statistics.median(spent):.1f} | "
        f"{np.quantile(spent, 0.95):.1f} | {max(spent):.1f} |"
    )


def main(*, count: int = 60, states: int = 5, seed: int = 0) -> None:
    """Print a Markdown table.

    Args:
        count: corridors in each of 2-D and 3-D.
        states: starts in motion for each corridor and kind of trajectory.
        seed: of worlds, corridors and states.
    """
    columns = (
        "start", "calls", "nothing found", "duration / reference", "95 %",
        "CPU [ms]", "95 %", "most",
    )  # fmt: skip
    print("| " + " | ".join(columns) + " |")
    print("|---" * len(columns) + "|")
    for n in (2, 3):
        rng = np.random.default_rng(seed)
        resting: list[tuple[Trial, float]] = []
        moving: list[tuple[Trial, float]] = []
        known: list[tuple[Trial, float]] = []
        for corridor in corridors(n, count, rng):
            thorough = timed(corridor)[1]
            trial, quick = timed(corridor, quick=True)
            if thorough is not None:
                resting.append((trial, thorough.duration))
            for flown in (thorough, quick):
                for t in rng.uniform(0.0, 1.0, states) * (flown.duration if flown else 0.0):
                    if flown is None:
                        continue
                    rest = flown.part(t, flown.duration)
                    at = flown.sample(t)
                    piece = int(np.searchsorted(flown.breakpoints, t, side="right")) - 1
                    cell = int(flown.piece_cells[piece])
                    points = np.vstack([at.position, corridor.waypoints[cell + 1 :]])
                    ahead = Corridor(points, corridor.cells[cell:])
                    state = {
                        "quick": True,
                        "start_velocity": at.velocity[0],
                        "start_acceleration": at.acceleration[0],
                    }
                    moving.append((timed(ahead, **state)[0], rest.duration))
                    known.append((timed(ahead, previous=rest, **state)[0], rest.duration))
        report(f"{n}-D, at rest", resting)
        report(f"{n}-D, in motion", moving)
        report(f"{n}-D, in motion, old way known", known)


if __name__ == "__main__":
    cyclopts.run(main)
