"""Figure 6 of the paper: cost over iterations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MultipleLocator, NullFormatter

from hzmp_sim.bench.paper.figures.canvas import new_figure, percent_label
from hzmp_sim.bench.paper.results import Convergence
from hzmp_sim.output import palette
from hzmp_sim.output.style import plain

_DECADES = 2.0  # a scale over fewer has ticks between powers of ten


def costs_over_iterations(experiments: Sequence[Convergence]) -> Figure:
    """Cost of each iteration and of the best path, above the optimum."""
    figure = new_figure(2.9)
    panels = figure.subplots(1, len(experiments), squeeze=False)[0]
    for axes, one in zip(panels, experiments, strict=True):
        number = np.array([step.number for step in one.steps])
        cost = np.array([step.cost for step in one.steps]) / one.optimum - 1.0
        best = np.array([step.best for step in one.steps]) / one.optimum - 1.0
        stars = np.array([step.adopted for step in one.steps])
        axes.plot(number, best, color=palette.BOUND, lw=1.4, drawstyle="steps-post", label="best")
        axes.plot(number, cost, "o", color=palette.PATH, ms=3.5, label="this iteration's")
        axes.plot(number[stars], cost[stars], "*", color=palette.BOUND, mec=palette.INK, mew=0.5,
                  ms=11, label="adopted")  # fmt: skip
        axes.set_title(f"{one.section} {one.world}", fontsize=10, loc="left")
        axes.set(yscale="log", xlabel="iteration")
        narrow = np.log10(cost.max() / best.min()) < _DECADES
        subs = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0) if narrow else (1.0,)
        axes.yaxis.set_major_locator(LogLocator(subs=subs))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda part, _: percent_label(part)))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.xaxis.set_major_locator(MultipleLocator(8))
        plain(axes)
    panels[0].set(ylabel="cost above the optimum")
    handles, names = panels[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    return figure
