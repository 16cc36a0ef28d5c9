"""Figure 9 of the paper: success and cost over time on random rectangles."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from scipy.stats import beta, binom

from hzmp_planners._arrays import Floats
from hzmp_sim.bench.paper.figures.canvas import new_figure, percent_label
from hzmp_sim.bench.paper.results import BEST, PAPER, TITLES, Results, Run
from hzmp_sim.bench.statistics import cost_at, median
from hzmp_sim.output import palette
from hzmp_sim.output.style import plain

_COLOURS = {PAPER: palette.FLOWN, BEST: palette.PATH}
_TAIL = 0.5 * (1.0 - 0.99)  # beyond each end of the bands: 99 % confidence, as in the paper
_EARLIEST = 1e-3  # left end of the time axis [s]
_LEAST, _MOST = 1e-6, 0.2  # excess over the optimum that is drawn; less is drawn as the least


def success_and_cost(results: Results) -> Figure:
    """Success rate above, median cost below: one scene with many seeds, and many scenes."""
    groups = (
        (f"one scene, {len(results.many_runs) // 2} seeds", results.many_runs),
        (f"{len(results.scenes)} scenes, one run each", results.many_scenes),
    )
    budget = results.settings["budget"]
    grid = np.geomspace(_EARLIEST, budget, 240)
    figure = new_figure(4.8)
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    for (title, runs), (above, below) in zip(groups, panels.T, strict=True):
        for planner, colour in _COLOURS.items():
            mine = [run for run in runs if run.planner == planner]
            excess = np.array([_excess(run, results.optima[run.scene], grid) for run in mine])
            _draw_success(above, grid, excess, colour, TITLES[planner].replace("`", ""))
            _draw_cost(below, grid, excess, colour)
            _draw_first(below, mine, results.optima, colour)
        above.set_title(title, loc="left", fontsize=10)
        below.set(xscale="log", xlabel="time [ms]", xlim=(grid[0], budget))
        below.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        below.xaxis.set_major_formatter(FuncFormatter(lambda time, _: f"{1e3 * time:g}"))
        below.xaxis.set_minor_formatter(NullFormatter())
    panels[0, 0].set(ylabel="runs with a path", ylim=(-0.03, 1.03))
    panels[0, 0].yaxis.set_major_formatter(FuncFormatter(lambda part, _: percent_label(part)))
    panels[1, 0].set(ylabel="cost above the optimum", yscale="log", ylim=(0.6 * _LEAST, _MOST))
    panels[1, 0].yaxis.set_major_formatter(FuncFormatter(_excess_label))
    for axes in panels.flat:
        plain(axes)
    handles, names = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=2, frameon=False, fontsize=9)
    return figure


def _excess_label(part: float, _: object) -> str:
    return ("≤ " if part <= _LEAST else "") + percent_label(part)


def _excess(run: Run, optimum: float, grid: Floats) -> list[float]:
    """Cost above the optimum at each time, relative; inf before the first path."""
    return [cost_at(run.history, when) / optimum - 1.0 for when in grid.tolist()]


def _draw_success(axes: Axes, grid: Floats, excess: Floats, colour: str, title: str) -> None:
    """Part of the runs that have a path, with Clopper and Pearson's interval."""
    count = len(excess)
    solved = np.isfinite(excess).sum(axis=0)
    low = np.where(solved > 0, beta.ppf(_TAIL, np.maximum(solved, 1), count - solved + 1), 0.0)
    most = np.minimum(solved, count - 1)
    high = np.where(solved < count, beta.ppf(1.0 - _TAIL, most + 1, count - most), 1.0)
    axes.fill_between(grid, low, high, step="post", color=colour, alpha=0.15, lw=0)
    rate = solved / count
    axes.plot(grid, rate, color=colour, lw=1.6, drawstyle="steps-post", label=title)


def _draw_cost(axes: Axes, grid: Floats, excess: Floats, colour: str) -> None:
    """Median, with the order statistics that hold the true one with the confidence asked for."""
    count = len(excess)
    rank = max(int(binom.ppf(_TAIL, count, 0.5)) - 1, 0)
    ordered = np.sort(excess, axis=0)
    low, middle, high = (
        np.maximum(ordered[row], _LEAST) for row in (rank, (count - 1) // 2, count - 1 - rank)
    )
    known = np.isfinite(low)
    high = np.minimum(high, _MOST)
    axes.fill_between(
        grid[known], low[known], high[known], step="post", color=colour, alpha=0.15, lw=0
    )
    known = np.isfinite(middle)
    axes.plot(grid[known], middle[known], color=colour, lw=1.6, drawstyle="steps-post")


def _draw_first(axes: Axes, runs: Sequence[Run], optima: dict[int, float], colour: str) -> None:
    """Medians of the first path's time and cost."""
    when = median(run.first_s for run in runs)
    excess = median(run.first_cost / optima[run.scene] - 1.0 for run in runs)
    if math.isfinite(when) and math.isfinite(excess):
        axes.plot(when, max(excess, _LEAST), "o", color=colour, mec="white", ms=7, zorder=5)
