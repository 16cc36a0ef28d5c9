"""The results as pictures: cost and success over time, one panel for each group of scenes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hzmp_sim.bench.peers.analysis import Timed, effort, groups, timed
from hzmp_sim.bench.peers.planners import PLANNERS
from hzmp_sim.bench.peers.results import COLD, WARM, Results
from hzmp_sim.bench.statistics import cost_at, median
from hzmp_sim.output.style import WIDTH_IN, plain, save

FIGURES = ("cost_exact.png", "success_exact.png", "cost_states.png", "success_states.png")
_PANEL_IN = 2.6  # height of a panel
_COLUMNS = 2
_EARLIEST = 3e-4  # left end of the time axis [s]
_LEAST_EXCESS = 1e-5  # costs nearer to the best are drawn there


def write_figures(results: Results, folder: Path, prefix: str = "") -> list[Path]:
    """Write the figures of the checks that were measured; returns their paths."""
    paths = []
    for check in effort(results)["checks"]:
        for kind, draw in (("cost", _cost), ("success", _success)):
            path = folder / f"{prefix}{kind}_{check}.png"
            save(_panels(results, check, draw), path)
            paths.append(path)
    return paths


Draw = Callable[[Axes, Sequence[Timed], Sequence[float], str, str], None]


def _panels(results: Results, check: str, draw: Draw) -> Figure:
    """One panel for each group, a line for each planner, one legend."""
    names = groups(results)
    rows = math.ceil(len(names) / _COLUMNS)
    figure = Figure(figsize=(WIDTH_IN, 0.7 + _PANEL_IN * rows), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, _COLUMNS, squeeze=False, sharex=True)
    latest = 3.0 * effort(results)["budget"]
    grid = np.geomspace(_EARLIEST, latest, 200).tolist()
    for name, axes in zip(names, panels.flat, strict=False):
        for planner in PLANNERS:
            runs = timed(results, planner.name, check, name)
            if runs:
                draw(axes, runs, grid, planner.colour, planner.title)
                width = 2.2 if planner.name in (WARM, COLD) else 1.2
                axes.lines[-1].set_linewidth(width)
        axes.set_title(name, loc="left", fontsize=10)
        axes.set(xscale="log", xlim=(_EARLIEST, latest))
        plain(axes)
    for axes in panels.flat[len(names) :]:
        axes.set_visible(False)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    # The planners of all panels: some are not in all.
    lines = {line.get_label(): line for axes in panels.flat for line in axes.lines}
    figure.legend(list(lines.values()), [str(name) for name in lines], loc="outside upper center",
                  ncols=5, frameon=False, fontsize=8)  # fmt: skip
    return figure


def _cost(
    axes: Axes, runs: Sequence[Timed], grid: Sequence[float], colour: str, title: str
) -> None:
    """Median cost over the best path, less 1, both axes logarithmic."""
    found = [median(cost_at(run.history, when) for run in runs) - 1.0 for when in grid]
    shown = [max(value, _LEAST_EXCESS) if math.isfinite(value) else math.nan for value in found]
    axes.plot(grid, shown, color=colour, label=title, drawstyle="steps-post")
    axes.set(yscale="log", ylim=(0.7 * _LEAST_EXCESS, 3.0), ylabel="cost / best - 1")


def _success(
    axes: Axes, runs: Sequence[Timed], grid: Sequence[float], colour: str, title: str
) -> None:
    """Part of the runs that have a path."""
    found = [float(np.mean([cost_at(run.history, t) < math.inf for run in runs])) for t in grid]
    axes.plot(grid, found, color=colour, label=title, drawstyle="steps-post")
    axes.set(ylim=(-0.03, 1.03), ylabel="success rate")
