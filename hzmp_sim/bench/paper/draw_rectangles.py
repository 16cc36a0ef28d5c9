"""Figure 9 of the paper: success and cost over time on random rectangles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from scipy.stats import beta, binom

from hzmp_planners._arrays import Floats
from hzmp_sim.bench.paper.canvas import new_figure
from hzmp_sim.bench.paper.results import BEST, PAPER, TITLES, Results, Run
from hzmp_sim.output import palette
from hzmp_sim.output.style import plain

_COLOURS = {PAPER: palette.FLOWN, BEST: palette.PATH}
_CONFIDENCE = 0.99  # of the bands, as in the paper
_LEAST = 1e-6  # costs nearer to the optimum are drawn there


def rectangles(results: Results) -> Figure:
    """Success rate above, median cost below: one scene with many seeds, and many scenes."""
    optimum = {scene.seed: scene.optimum for scene in results.scenes}
    groups = (
        (f"one scene, {len(_of(results.many_runs, PAPER))} seeds", results.many_runs),
        (f"{len(results.scenes)} scenes", results.many_scenes),
    )
    budget = results.settings["budget"]
    grid = np.geomspace(1e-3, budget, 160)
    figure = new_figure(4.8)
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    for (title, runs), (above, below) in zip(groups, panels.T, strict=True):
        for planner, colour in _COLOURS.items():
            mine = _of(runs, planner)
            ratios = np.array([_ratio_over_time(run, optimum[run.scene], grid) for run in mine])
            _success(above, grid, ratios, colour, planner)
            _cost(below, grid, ratios, colour)
        above.set_title(title, loc="left", fontsize=10)
        below.set(xscale="log", xlabel="time [s]", xlim=(grid[0], budget))
    panels[0, 0].set(ylabel="runs with a path", ylim=(-0.03, 1.03))
    panels[0, 0].yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{100 * share:.0f} %"))
    panels[1, 0].set(ylabel="cost above the optimum", yscale="log", ylim=(0.6 * _LEAST, 0.2))
    panels[1, 0].yaxis.set_major_formatter(FuncFormatter(_percent))
    for axes in panels.flat:
        plain(axes)
    handles, names = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=2, frameon=False, fontsize=9)
    return figure


def _percent(part: float, _: Any) -> str:
    return f"{'≤ ' if part <= _LEAST else ''}{100.0 * part:g} %"


def _of(runs: Sequence[Run], planner: str) -> list[Run]:
    return [run for run in runs if run.planner == planner]


def _ratio_over_time(run: Run, optimum: float, grid: Floats) -> list[float]:
    """Cost over the optimum at each time; inf before the first path."""
    return [
        min((cost for when, cost in run.history if when <= t), default=math.inf) / optimum
        for t in grid.tolist()
    ]


def _success(axes: Axes, grid: Floats, ratios: Floats, colour: str, planner: str) -> None:
    """Part of the runs that have a path, with Clopper and Pearson's interval."""
    count = len(ratios)
    solved = np.isfinite(ratios).sum(axis=0)
    tail = (1.0 - _CONFIDENCE) / 2.0
    low = np.where(solved > 0, beta.ppf(tail, np.maximum(solved, 1), count - solved + 1), 0.0)
    most = np.where(solved < count, solved, count - 1)
    high = np.where(solved < count, beta.ppf(1.0 - tail, most + 1, count - most), 1.0)
    axes.fill_between(grid, low, high, color=colour, alpha=0.15, lw=0)
    axes.plot(grid, solved / count, color=colour, lw=1.6, label=TITLES[planner].replace("`", ""))


def _cost(axes: Axes, grid: Floats, ratios: Floats, colour: str) -> None:
    """Median, with the order statistics that hold the true one with the confidence asked for."""
    count = len(ratios)
    tail = (1.0 - _CONFIDENCE) / 2.0
    rank = max(int(binom.ppf(tail, count, 0.5)) - 1, 0)
    ordered = np.sort(ratios, axis=0)
    rows = (ordered[rank], ordered[count - 1 - rank], ordered[(count - 1) // 2])
    low, high, middle = (
        np.maximum(np.where(np.isfinite(row), row, np.nan) - 1.0, _LEAST) for row in rows
    )
    axes.fill_between(grid, low, np.where(np.isnan(high), 1.0, high), where=~np.isnan(low),
                      color=colour, alpha=0.15, lw=0)  # fmt: skip
    axes.plot(grid, middle, color=colour, lw=1.6)
