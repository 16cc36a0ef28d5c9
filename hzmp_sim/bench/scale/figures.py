"""The results as pictures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from hzmp_sim.bench.scale.fits import SERIES, series
from hzmp_sim.bench.scale.results import Results, WorldResult
from hzmp_sim.bench.scale.targets import MOST_MB, MOST_SECONDS
from hzmp_sim.output import palette
from hzmp_sim.output.style import WIDTH_IN, legend_above, plain, save

FIGURES = ("time.png", "leaves.png", "memory.png")
_HEIGHT_IN = 3.8
_COLOURS: dict[str, str] = dict(
    zip(SERIES, (palette.PATH, palette.FLOWN, palette.BOUND), strict=True)
)


def write_figures(results: Results, folder: Path, prefix: str = "") -> list[Path]:
    """Write time.png, leaves.png and memory.png to a folder; returns their paths."""
    paths = [folder / (prefix + name) for name in FIGURES]
    for draw, path in zip((_time, _leaves, _memory), paths, strict=True):
        save(draw(results), path)
    return paths


def _time(results: Results) -> Figure:
    """Time over count, both logarithmic, with the fitted power laws and the targets."""
    figure, axes = _new()
    _lines(axes, results, lambda world: world.total_s)
    for fit in results.fits:
        N = np.array(fit.counts, dtype=np.float64)
        logs = np.log([point.total_s for point in series(results.worlds, fit.family)])
        law = np.exp((logs - fit.exponent * np.log(N)).mean()) * N**fit.exponent
        axes.plot(N, law, "--", color=_COLOURS[fit.family], lw=1.0)
        axes.annotate(
            f"N$^{{{fit.exponent:.2f}}}$", (N[-1], law[-1]), xytext=(8, 0),
            textcoords="offset points", va="center", color=_COLOURS[fit.family],
        )  # fmt: skip
    _targets(axes, MOST_SECONDS)
    axes.set(yscale="log", ylabel="leaves and graph [s]")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    return _done(figure, axes, results)


def _leaves(results: Results) -> Figure:
    """Leaves per obstacle over count: ours, and the two naive orders."""
    figure, axes = _new()
    _lines(axes, results, lambda world: world.leaves / world.obstacles)
    for name, label, style in (
        ("naive", "naive", "s:"),
        ("naive_reach", "greatest reach first", "^-."),
    ):
        for family in SERIES:
            points = [w for w in series(results.worlds, family) if getattr(w, name)]
            axes.plot(
                [point.obstacles for point in points],
                [getattr(point, name) / point.obstacles for point in points],
                style, color=_COLOURS[family], lw=1.0, ms=4, mfc="white",
            )  # fmt: skip
        axes.plot([], [], style, color=palette.INK, lw=1.0, ms=4, mfc="white", label=label)
    axes.set(ylabel="leaves per obstacle")
    axes.set_ylim(bottom=0.0)
    return _done(figure, axes, results)


def _memory(results: Results) -> Figure:
    """Peak memory over count, the target, and what the process had before."""
    figure, axes = _new()
    _lines(axes, results, lambda world: world.peak_mb)
    _targets(axes, MOST_MB)
    base = [world.base_mb for world in results.worlds]
    axes.axhline(float(np.median(base)), color=palette.OBSTACLE, lw=1.0, label="before")
    axes.set(ylabel="peak resident memory [MB]")
    axes.set_ylim(bottom=0.0)
    return _done(figure, axes, results)


def _lines(axes: Axes, results: Results, value: Callable[[WorldResult], float]) -> None:
    for family in SERIES:
        points = series(results.worlds, family)
        if points:
            axes.plot(
                [point.obstacles for point in points],
                [value(point) for point in points],
                "o-", color=_COLOURS[family], ms=4, lw=1.5, label=points[0].title,
            )  # fmt: skip


def _targets(axes: Axes, most: dict[tuple[str, int], float]) -> None:
    """Mark what the worlds of the series may take at most."""
    for (family, count), value in most.items():
        if family in _COLOURS:
            axes.plot(count, value, "v", color=_COLOURS[family], ms=8, mfc="none", mew=1.5)
    axes.plot([], [], "v", color=palette.INK, ms=8, mfc="none", mew=1.5, label="target")


def _new() -> tuple[Figure, Axes]:
    figure = Figure(figsize=(WIDTH_IN, _HEIGHT_IN), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.add_subplot()


def _done(figure: Figure, axes: Axes, results: Results) -> Figure:
    """Counts along a logarithmic axis, each with its number."""
    counts = sorted({w.obstacles for w in results.worlds if w.family in SERIES})
    axes.set(xscale="log", xlabel="obstacles N")
    axes.set_xticks(counts, [f"{count:,}" for count in counts])
    axes.xaxis.set_minor_formatter(NullFormatter())
    legend_above(axes)
    plain(axes)
    return figure
