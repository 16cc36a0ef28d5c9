"""The results as tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hzmp_sim.bench.machine import hardware, software
from hzmp_sim.bench.page import page_text
from hzmp_sim.bench.paper.convergence import AFTER
from hzmp_sim.bench.paper.figures.all_figures import CAPTIONS
from hzmp_sim.bench.paper.reported import (
    LEAST_COST,
    MAZE_COST,
    MAZE_ITERATIONS,
    MAZE_STARS,
    TABLE_1,
    Reported,
)
from hzmp_sim.bench.paper.results import BEST, PAPER, TITLES, Results, Run
from hzmp_sim.bench.statistics import median
from hzmp_sim.bench.tables import Table, percent, seconds
from hzmp_sim.bench.words import costs, times

_UNKNOWN = "-"
_QUALITY = ("final cost / c*", "bound / c*", "gap")
_TIMES = ("decomposition", "first path with it", "planner stops after")


def tables_of(results: Results) -> list[Table]:
    """All tables."""
    tables = [_one_scene(results), _many_scenes(results), _experiments(results)]
    if results.defects:
        tables.append(Table("Wrong answers", (), (), remarks=results.defects))
    return tables


def markdown(results: Results, figures: Sequence[str] = (), maker: str | None = None) -> str:
    """The tables, what they were measured on, and pictures, as Markdown.

    Args:
        results: what was measured.
        figures: paths of pictures, as they are to be linked.
        maker: the command that makes this text, if not the one that measured.
    """
    facts = results.machine
    introduction = (
        f"{hardware(facts)}; {software(facts)}. `{results.command}` took {results.seconds:,.0f} s."
    )
    tables = tables_of(results)
    return page_text(maker or results.command, introduction, tables, figures, CAPTIONS)


def _one_scene(results: Results) -> Table:
    """Table 1 of the paper: the reported rows, and ours on one scene."""
    optimum = results.optima[results.chosen]
    rows = [_reported(row) for row in TABLE_1]
    for planner in (PAPER, BEST):
        runs = _of(results.many_runs, planner)
        rows.append(
            (
                *_first(planner, runs),
                _lengths([run.first_cost for run in runs]),
                _lengths([run.final_cost for run in runs]),
                *_quality(runs, results.optima),
                *_times(runs),
            )
        )
    count = len(_of(results.many_runs, PAPER))
    budget = seconds(results.settings["budget"])
    return Table(
        "Table 1: random rectangles in the plane, one scene",
        (
            "planner", "success", "first path after", "its cost", "final cost", *_QUALITY, *_TIMES,
        ),
        rows,
        f"Least / median / greatest of {count} runs of {budget}; a run without a path counts as "
        "infinite. The rows (reported) are what the paper says of its own scene, which is not "
        f"published; the least cost that anyone found there is {LEAST_COST}. Our scene (seed "
        f"{results.chosen}) is the one of our draws whose optimum c* is closest to that: "
        f"{optimum:.4f}, by a visibility graph. Times are those of the process on a processor: of "
        "a query on a free space that is there, then with the decomposition and its leaf graph. "
        "Bound and gap are the planner's own; the paper's algorithm has only the straight line.",
    )  # fmt: skip


def _many_scenes(results: Results) -> Table:
    """One run on each scene, as ratios to the optimum."""
    optima = results.optima
    rows = []
    for planner in (PAPER, BEST):
        runs = _of(results.many_scenes, planner)
        first = _lengths([run.first_cost / optima[run.scene] for run in runs], 4)
        row = (*_first(planner, runs), first, *_quality(runs, optima), *_times(runs))
        rows.append(row)
    count = len(results.scenes)
    return Table(
        f"Random rectangles, {count} scenes",
        ("planner", "success", "first path after", "its cost / c*", *_QUALITY, *_TIMES),
        rows,
        f"One run in each of the first {count} draws in which the goal can be reached "
        f"({results.passed} draws were passed over): least / median / greatest.",
    )


def _of(runs: Sequence[Run], planner: str) -> list[Run]:
    return [run for run in runs if run.planner == planner]


def _reported(row: Reported) -> tuple[str, ...]:
    """A row of the paper's table; the rest of our columns it does not have."""
    first = " / ".join(_UNKNOWN if t is None else seconds(t) for t in row.first_s)
    cost = " / ".join(_UNKNOWN if c is None else f"{c:.3f}" for c in row.cost)
    known = (
        f"{row.planner} (reported)",
        percent(row.success),
        first if any(row.first_s) else _UNKNOWN,
        _UNKNOWN if row.first_cost is None else f"- / {row.first_cost:.3f} / -",
        cost if any(row.cost) else _UNKNOWN,
    )
    return (*known, *[_UNKNOWN] * len((*_QUALITY, *_TIMES)))


def _first(planner: str, runs: Sequence[Run]) -> tuple[str, ...]:
    """Name, success, and time of the first path."""
    success = sum(run.cost is not None for run in runs) / len(runs)
    return TITLES[planner], percent(success), _spread_times([run.first_s for run in runs])


def _quality(runs: Sequence[Run], optima: dict[int, float]) -> tuple[str, ...]:
    """The cells under `_QUALITY`."""
    gap = median(run.gap for run in runs)
    return (
        _lengths([run.final_cost / optima[run.scene] for run in runs], 4),
        _lengths([run.lower_bound / optima[run.scene] for run in runs], 4),
        percent(gap if math.isfinite(gap) else None),
    )


def _times(runs: Sequence[Run]) -> tuple[str, ...]:
    """The cells under `_TIMES`."""
    return (
        times(median(run.decompose_s for run in runs)),
        times(median(run.decompose_s + run.first_s for run in runs)),
        times(median(run.total_s for run in runs)),
    )


def _experiments(results: Results) -> Table:
    """Sections 4.1 to 4.3."""
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
                seconds(one.iteration_s),
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
        "path of the default planner whose optimality is proved up to 1e-6, and verified. The "
        f"paper reports for its maze {MAZE_COST} cm after {MAZE_ITERATIONS} iterations, improved "
        f"in iterations {', '.join(map(str, MAZE_STARS))}; it does not report the optimum.",
        [f"Made up in {one.section} ({one.world}): {one.made_up}." for one in results.experiments],
    )  # fmt: skip


def _spread_times(values: Sequence[float]) -> str:
    """Least / median / greatest time [s]."""
    return " / ".join(map(times, (min(values), median(values), max(values))))


def _lengths(values: Sequence[float], digits: int = 3) -> str:
    """Least / median / greatest length or ratio."""
    three = (min(values), median(values), max(values))
    return " / ".join(costs(value, digits) for value in three)
