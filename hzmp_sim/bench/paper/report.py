"""The results as tables."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence

from hzmp_sim.bench.paper.convergence import AFTER
from hzmp_sim.bench.paper.reported import (
    LEAST_COST,
    MAZE_COST,
    MAZE_ITERATIONS,
    MAZE_STARS,
    TABLE_1,
    Reported,
)
from hzmp_sim.bench.paper.results import BEST, PAPER, TITLES, Results, Run
from hzmp_sim.bench.tables import Table, percent, seconds

_UNKNOWN = "-"
_ROUND_OFF = 1e-12  # gaps below it are none


def tables_of(results: Results) -> list[Table]:
    """All tables."""
    return [_one_scene(results), _many_scenes(results), _experiments(results)]


def markdown(results: Results, figures: Sequence[str] = (), maker: str | None = None) -> str:
    """The tables, what they were measured on, and pictures, as Markdown.

    Args:
        results: what was measured.
        figures: paths of pictures, as they are to be linked.
        maker: the command that makes this text, if not the one that measured.
    """
    made = f"<!-- made by: {maker or results.command} -->"
    facts = results.machine
    versions = ", ".join(f"{name} {number}" for name, number in sorted(facts["versions"].items()))
    lines = [
        made,
        f"{facts['processor']}, {facts['cores']} cores, one thread used; load {facts['load']:g} "
        f"before the run; {facts['system']}, Python {facts['python']}; {versions}. "
        f"`{results.command}` took {results.seconds:,.0f} s.\n",
    ]
    lines += [table.markdown() for table in tables_of(results)]
    for figure in figures:
        name = figure.rsplit("/", 1)[-1].split(".")[0].removeprefix("paper_")
        lines += [f"{made}\n![Figure {name.replace('_', ' ')}]({figure})\n"]
    return "\n".join(lines)


def _one_scene(results: Results) -> Table:
    """Table 1 of the paper: the reported rows, and ours on one scene."""
    optimum = next(scene.optimum for scene in results.scenes if scene.seed == results.one)
    rows = [_reported(row) for row in TABLE_1]
    for planner in (PAPER, BEST):
        runs = [run for run in results.many_runs if run.planner == planner]
        costs = [run.final_cost for run in runs]
        rows.append(
            (
                TITLES[planner],
                _success(runs),
                _times([run.first_s for run in runs]),
                _lengths([run.first_cost for run in runs]),
                _lengths(costs),
                _lengths([cost / optimum for cost in costs], 4),
                f"{statistics.median(run.lower_bound for run in runs) / optimum:.4f}",
                _gap(runs),
                seconds(_median([run.decompose_s + run.first_s for run in runs])),
                seconds(_median([run.total_s for run in runs])),
            )
        )
    count = len(results.many_runs) // 2
    budget = seconds(results.settings["budget"])
    return Table(
        "Table 1: random rectangles in the plane, one scene",
        (
            "planner", "success", "first path after", "its cost", "final cost", "/ optimum c*",
            "bound / c*", "gap", "first path with decomposition", "stops after",
        ),
        rows,
        f"Least / median / greatest of {count} runs of {budget}. The rows (reported) are what "
        "the paper says of its own scene, which is not published; the least cost that anyone found "
        f"there is {LEAST_COST}. Our scene (seed {results.one}) is the one of our "
        f"draws whose optimum is closest to that: {optimum:.4f}, by a visibility graph. Times are "
        "those of a query on a free space that is there; then with its decomposition and leaf "
        "graph. The gap is to the planner's own lower bound: the paper has only the straight line.",
    )  # fmt: skip


def _reported(row: Reported) -> tuple[str, ...]:
    first = " / ".join(_UNKNOWN if t is None else seconds(t) for t in row.first_s)
    cost = " / ".join(_UNKNOWN if c is None else f"{c:.3f}" for c in row.cost)
    known = [
        f"{row.planner} (reported)",
        percent(row.success),
        first if any(row.first_s) else _UNKNOWN,
        _UNKNOWN if row.first_cost is None else f"- / {row.first_cost:.3f} / -",
        cost if any(row.cost) else _UNKNOWN,
    ]
    return (*known, *[_UNKNOWN] * 5)


def _many_scenes(results: Results) -> Table:
    optimum = {scene.seed: scene.optimum for scene in results.scenes}
    rows = []
    for planner in (PAPER, BEST):
        runs = [run for run in results.many_scenes if run.planner == planner]
        rows.append(
            (
                TITLES[planner],
                _success(runs),
                _times([run.first_s for run in runs]),
                _lengths([run.first_cost / optimum[run.scene] for run in runs], 4),
                _lengths([run.final_cost / optimum[run.scene] for run in runs], 4),
                _lengths([run.lower_bound / optimum[run.scene] for run in runs], 4),
                _gap(runs),
                _times([run.decompose_s for run in runs]),
                _times([run.total_s for run in runs]),
            )
        )
    count = len(results.scenes)
    return Table(
        f"Random rectangles, {count} scenes",
        (
            "planner", "success", "first path after", "its cost / c*", "final cost / c*",
            "bound / c*", "gap", "decomposition", "stops after",
        ),
        rows,
        f"One run in each of the first {count} draws in which the goal can be reached "
        f"({results.passed} draws were passed over): least / median / greatest.",
    )  # fmt: skip


def _experiments(results: Results) -> Table:
    rows = []
    for one in results.experiments:
        stars = [step.number for step in one.steps if step.adopted]
        rows.append(
            (
                f"{one.section} {one.world}, {one.n}-D",
                f"{one.obstacles} / {one.leaves} / {one.faces}",
                f"{one.optimum:.3f} {one.unit}",
                f"{one.straight / one.optimum:.3f}",
                *(_lengths([cost / one.optimum for cost in one.after[str(k)]], 4) for k in AFTER),
                ", ".join(map(str, stars)),
                f"{one.milliseconds:.1f} ms",
            )
        )
    runs = len(results.experiments[0].after[str(AFTER[0])])
    return Table(
        "Sections 4.1 to 4.3: cost over iterations",
        (
            "world", "convex obstacles / leaves / faces", "optimum c*", "straight line / c*",
            *(f"cost / c* after {k}" for k in AFTER), "improved in (first run)", "an iteration",
        ),
        rows,
        f"Least / median / greatest of {runs} runs with different seeds. c* is the length of a "
        "path whose optimality is proved up to 1e-6. The paper reports for its maze "
        f"{MAZE_COST} cm after {MAZE_ITERATIONS} iterations, improved in iterations "
        f"{', '.join(map(str, MAZE_STARS))}; it does not report the optimum.",
        [f"Made up in {one.section} ({one.world}): {one.made_up}." for one in results.experiments],
    )  # fmt: skip


def _success(runs: Sequence[Run]) -> str:
    return f"{100.0 * sum(run.cost is not None for run in runs) / len(runs):g} %"


def _median(values: Sequence[float]) -> float | None:
    """The median; None if it is infinite."""
    middle = statistics.median(values)
    return middle if math.isfinite(middle) else None


def _gap(runs: Sequence[Run]) -> str:
    """Median gap; round-off is none."""
    middle = _median([run.gap for run in runs])
    return percent(0.0 if middle is not None and middle < _ROUND_OFF else middle)


def _times(values: Sequence[float]) -> str:
    """Least / median / greatest."""
    three = (min(values), statistics.median(values), max(values))
    return " / ".join(seconds(value) if math.isfinite(value) else "inf" for value in three)


def _lengths(values: Sequence[float], digits: int = 3) -> str:
    """Least / median / greatest."""
    three = (min(values), statistics.median(values), max(values))
    return " / ".join(f"{value:.{digits}f}" for value in three)
