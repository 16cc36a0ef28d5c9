"""The figures of a run: time series here, the path in `path_figure`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hzmp_sim.output import palette
from hzmp_sim.output.headline import percent
from hzmp_sim.output.path_figure import path_figure
from hzmp_sim.output.style import WIDTH_IN, legend_above, plain, save

if TYPE_CHECKING:
    from hzmp_sim.replanning import FlightPlan
    from hzmp_sim.run import FlightLog, Run
    from hzmp_tracking import Trajectory


def write_figures(run: Run, directory: Path) -> list[Path]:
    """Write the figures that `run` has material for to `directory` as PNG; returns their paths.

    path.png (plan), search.png (cost and lower bound), trajectory.png (derivatives against their
    limits), flight.png (clearance and tracking error) and replanning.png (paths planned in flight,
    and their latency).
    """
    figures: dict[str, Figure] = {"path": path_figure(run)}
    if any(np.isfinite(row).all() for row in run.plan.history):
        figures["search"] = _search_figure(run)
    if run.trajectory is not None:
        figures["trajectory"] = _trajectory_figure(run.trajectory)
    if run.log is not None:
        figures["flight"] = _flight_figure(run, run.log)
    if run.flight_plan is not None and run.flight_plan.records:
        figures["replanning"] = _replanning_figure(run.flight_plan)
    paths = []
    for name, figure in figures.items():
        paths.append(directory / f"{name}.png")
        save(figure, paths[-1])
    return paths


def _new(height: float) -> Figure:
    figure = Figure(figsize=(WIDTH_IN, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _search_figure(run: Run) -> Figure:
    """Cost and lower bound over the planning time: the gap is the shaded band."""
    figure = _new(3.2)
    axes = figure.add_subplot()
    history = np.array(run.plan.history, dtype=np.float64)
    history = history[np.isfinite(history).all(axis=1)]
    time, cost, bound = 1e3 * history[:, 0], history[:, 1], history[:, 2]
    axes.fill_between(time, bound, cost, step="post", color=palette.PATH, alpha=0.12, lw=0)
    axes.step(time, cost, where="post", color=palette.PATH, marker="o", ms=4, label="cost")
    axes.step(time, bound, where="post", color=palette.BOUND, marker="o", ms=4, label="lower bound")
    axes.annotate(
        f"gap {percent(run.plan.gap)} %",
        (time[-1], cost[-1]),
        xytext=(-6, 8),
        textcoords="offset points",
        ha="right",
        color=palette.INK,
    )
    axes.set(xlabel="planning time [ms]", ylabel="path length [m]")
    axes.margins(y=0.15)
    legend_above(axes)
    plain(axes)
    return figure


def _trajectory_figure(trajectory: Trajectory) -> Figure:
    """Position and its derivatives over time, the limits dashed."""
    figure = _new(7.6)
    rows = figure.subplots(4, 1, sharex=True)
    # Both sides of every breakpoint: the jerk jumps there.
    edges = trajectory.breakpoints
    times = np.linspace(0.0, trajectory.duration, 800)
    times = np.unique(np.concatenate([times, edges, np.nextafter(edges[1:], 0.0)]))
    times = times[times < trajectory.duration]
    labels = ("position [m]", "velocity [m/s]", "acceleration [m/s²]", "jerk [m/s³]")
    bounds = (None, *trajectory.limits.per_axis(trajectory.n))
    norms = (np.inf, *trajectory.limits.norms)
    sample = trajectory.sample(times)
    for axes, label, values, limit, norm in zip(rows, labels, sample, bounds, norms, strict=True):
        for i in range(trajectory.n):
            axes.plot(times, values[:, i], color=palette.AXES[i], label="xyz"[i], lw=1.4)
        if np.isfinite(norm):
            size = np.linalg.norm(values, axis=1)
            axes.plot(times, size, color=palette.INK, label="norm", lw=1.0)
            axes.axhline(norm, color=palette.INK, lw=1.0, ls="--")
        # What a norm bounds more tightly than an axis is drawn once.
        for value in () if limit is None else np.unique(limit[limit < norm]):
            for side in (-value, value):
                axes.axhline(side, color=palette.GROWN, lw=1.0, ls="--")
        axes.set_ylabel(label)
        if limit is None:
            legend_above(axes)
        plain(axes)
    rows[-1].set_xlabel("time [s]")
    rows[-1].set_xlim(0.0, max(trajectory.duration, 1e-3))
    figure.align_ylabels()
    return figure


def _flight_figure(run: Run, log: FlightLog) -> Figure:
    """Measured clearance above its threshold, and tracking error, over time."""
    figure = _new(4.6)
    above, below = figure.subplots(2, 1, sharex=True)
    clear = np.where(np.isfinite(log.clearance), log.clearance, np.nan)
    above.plot(log.time, clear, color=palette.BOUND, label="clearance (MuJoCo)")
    above.axhline(
        run.scene.clearance, color=palette.INK, lw=1.0, ls="--",
        label=f"asked for: {run.scene.clearance:g} m",
    )  # fmt: skip
    above.axhline(0.0, color=palette.GROWN, lw=1.0, label="contact")
    if np.isfinite(clear).any():
        row = int(np.nanargmin(clear))
        name = run.scene.geom_name(int(log.nearest[row]))
        above.plot(log.time[row], clear[row], "o", color=palette.BOUND, ms=5)
        above.annotate(
            f"{clear[row]:.3f} m to {name}", (log.time[row], clear[row]),
            xytext=(0, 22), textcoords="offset points", ha="center", color=palette.INK,
            bbox={"fc": "white", "ec": "none", "alpha": 0.8, "pad": 1.5},
        )  # fmt: skip
    if log.collision.any():
        hits = log.time[log.collision]
        above.plot(hits, np.zeros_like(hits), "x", color=palette.GROWN, label="collision")
    above.set_ylabel("clearance [m]")
    legend_above(above)
    below.plot(log.time, 1e3 * log.tracking_error, color=palette.FLOWN)
    below.set(xlabel="time [s]", ylabel="tracking error [mm]")
    below.set_ylim(bottom=0.0)
    below.set_xlim(log.time[0], log.time[-1])
    for axes in (above, below):
        plain(axes)
    figure.align_ylabels()
    return figure


def _replanning_figure(planned: FlightPlan) -> Figure:
    """Path to the goal as planned, and latency of each decision by reason, over time."""
    figure = _new(5.2)
    above, axes = figure.subplots(2, 1, sharex=True)
    records = planned.records
    effect = np.array([record.effect for record in records])
    ways = np.array([[record.cost, record.lower_bound] for record in records])
    ways[~np.isfinite(ways).all(axis=1)] = np.nan
    above.step(effect, ways[:, 0], where="post", color=palette.PATH, label="path to the goal")
    above.step(effect, ways[:, 1], where="post", color=palette.BOUND, label="lower bound")
    for record, end in zip(records, [*effect[1:], effect[-1]], strict=True):
        if planned.proved_until(record) < end:
            above.axvspan(record.effect, end, color=palette.GROWN, alpha=0.25, lw=0)
    above.set_ylabel("length [m]")
    above.set_ylim(bottom=0.0)
    asked = [record.time for record in records]
    allowed = [1e3 * (record.effect - record.time) for record in records]
    axes.step(asked, allowed, where="post", color=palette.INK, lw=1.0, ls="--", label="allowed")
    for reason in dict.fromkeys(record.reason for record in records):
        chosen = [record for record in records if record.reason == reason]
        times, latency = [r.time for r in chosen], [1e3 * r.latency for r in chosen]
        axes.plot(times, latency, "o", ms=3, label=reason)
    axes.set(xlabel="time [s]", ylabel="latency [ms]")
    axes.set_ylim(bottom=0.0)
    for panel in (above, axes):
        legend_above(panel)
        plain(panel)
    figure.align_ylabels()
    return figure
