"""Figures 5 to 8 of the paper: its experiments of sections 4.1 to 4.3, run by our code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MultipleLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from hzmp_planners._polygons import facet_corners
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import plan
from hzmp_planners.planning.paper import Iteration, PaperSettings
from hzmp_planners.sets import Ellipsotope
from hzmp_sim.bench.paper.canvas import (
    bare,
    draw_ends,
    draw_faces,
    draw_leaves,
    draw_obstacles,
    draw_path,
    legend_below,
    new_figure,
    outline,
)
from hzmp_sim.bench.paper.reported import MAZE_ITERATIONS
from hzmp_sim.bench.paper.results import Convergence
from hzmp_sim.bench.paper.worlds import PaperWorld, enclosure, maze, passage
from hzmp_sim.output import palette
from hzmp_sim.output.style import plain

_LEAST = 1e-8  # lower end of the costs that are drawn
_LONG = 60.0  # [s]: iterations end a run, not the clock
_SHADES = (palette.SAMPLE, palette.INFORMED, palette.FLOWN, palette.PATH)
"""Of paths in the order in which they were found."""
_FEW = 4  # samples per face: so few that single improvements can be seen


def _adopted(world: PaperWorld, space: FreeSpace, count: int, samples: int) -> list[Iteration]:
    """The improvements in so many iterations."""
    seen: list[Iteration] = []
    method = PaperSettings(iterations=count, samples=samples, observe=seen.append)
    plan(space, world.start, world.goal, gap=0.0, time_limit=_LONG, method=method)
    return [one for one in seen if one.adopted]


def _informed(world: PaperWorld, one: Iteration) -> Ellipsotope:
    return Ellipsotope.informed(world.start, world.goal, one.best)


def maze_path() -> Figure:
    """Figure 5: the maze, its leaves, and the path after as many iterations as in the paper."""
    world = maze()
    space = world.free_space()
    last = _adopted(world, space, MAZE_ITERATIONS, PaperSettings().samples)[-1]
    figure = new_figure(6.2)
    axes = figure.add_subplot()
    draw_leaves(axes, space, np.flatnonzero(last.leaves))
    draw_obstacles(axes, world)
    axes.plot(*outline(_informed(world, last)).T, "--", color=palette.INK, lw=1.2, zorder=5,
              label="ellipsotope")  # fmt: skip
    label = f"path after {MAZE_ITERATIONS} iterations, {last.best:.1f} cm"
    draw_path(axes, last.waypoints, palette.PATH, label)
    draw_ends(axes, world)
    bare(axes, world)
    axes.set(xticks=range(-100, 801, 100), yticks=range(-100, 601, 100))
    axes.set(xlabel="x [cm]", ylabel="y [cm]")
    axes.tick_params(labelsize=9, colors=palette.INK)
    axes.plot([], [], "s", color="#eceef1", ms=9, label="pruned leaves")
    legend_below(figure, axes, 5)
    return figure


def convergence(experiments: Sequence[Convergence]) -> Figure:
    """Figure 6: cost of each iteration and of the best path, above the optimum."""
    figure = new_figure(2.9)
    panels = figure.subplots(1, len(experiments), sharey=True, squeeze=False)[0]
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
        axes.xaxis.set_major_locator(MultipleLocator(8))
        axes.yaxis.set_major_formatter(FuncFormatter(_percent))
        plain(axes)
    panels[0].set(ylabel="cost above the optimum", ylim=(0.5 * _LEAST, 0.1))
    handles, names = panels[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    return figure


def _percent(value: float, _: Any) -> str:
    return f"{100.0 * value:.7f}".rstrip("0").rstrip(".") + " %"


def passage_ellipsotopes() -> Figure:
    """Figure 7: paths and shrinking ellipsotopes in the 3-D passage, in space and from the side."""
    world = passage()
    space = world.free_space()
    found = _adopted(world, space, 40, _FEW)
    picked = [found[k] for k in _spread(len(found), len(_SHADES))]
    figure = new_figure(6.4)
    grid = figure.add_gridspec(2, 1, height_ratios=[1.5, 1.0])
    axes: Any = figure.add_subplot(grid[0], projection="3d")
    axes.computed_zorder = False
    for body in space.obstacles:
        V = body.vertices()
        rings = [V[corners] for _, corners in facet_corners(V, body.A, body.incidence)]
        axes.add_collection3d(
            Poly3DCollection(
                rings, facecolor=palette.OBSTACLE, edgecolor="white", alpha=0.3, lw=0.4
            )
        )
    for one, colour in zip(picked, _SHADES[-len(picked) :], strict=True):
        label = f"iteration {one.number}: {one.best:.2f} m"
        if one in (picked[0], picked[-1]):
            _draw_shell(axes, _informed(world, one), colour)
        draw_path(axes, one.waypoints, colour, label, 1.6)
    draw_ends(axes, world)
    axes.set(xlim=(-15, 15), ylim=(0, 15), zlim=(0, 5), xlabel="x [m]", ylabel="y [m]")
    axes.set_box_aspect((30, 15, 10), zoom=1.5)
    axes.view_init(elev=28, azim=-66)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis.set_major_locator(MultipleLocator(5.0))
    side = figure.add_subplot(grid[1])
    walls = [(0.0, 0.0, 4.0)]
    walls += [(x, *part) for x in (-7.0, 7.0) for part in ((0.0, 1.5), (3.5, 5.0))]
    for x, low, high in walls:
        side.fill_between([x - 0.15, x + 0.15], low, high, color=palette.OBSTACLE, zorder=1)
    for one, colour in zip(picked, _SHADES[-len(picked) :], strict=True):
        side.plot(*outline(_informed(world, one), (0, 2)).T, "--", color=colour, lw=1.0)
        draw_path(side, one.waypoints[:, [0, 2]], colour, None, 1.6)
    for point, colour, marker, size in (
        (world.start, palette.START, "s", 7),
        (world.goal, palette.GOAL, "*", 13),
    ):
        side.plot(point[0], point[2], marker, color=colour, mec=palette.INK, ms=size, zorder=8)
    side.set(xlim=(-15, 15), ylim=(0, 5), xlabel="x [m]", ylabel="z [m]")
    plain(side)
    legend_below(figure, axes, 3)
    return figure


def _spread(count: int, wanted: int) -> list[int]:
    """So many of the first `count` numbers, first and last included."""
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, wanted))})


def _draw_shell(axes: Any, informed: Ellipsotope, colour: str) -> None:
    """An ellipsoid as a wire frame, what is outside of the picture left out."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, 65), np.linspace(0, 2 * np.pi, 49))
    ball = np.stack([np.cos(polar), np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around)])
    shell = informed.c[:, None, None] + np.einsum("ij,jkl->ikl", _along(informed), ball)
    outside = (shell[2] < 0.0) | (shell[2] > 5.0) | (shell[1] < 0.0) | (shell[1] > 15.0)
    shell[:, outside] = np.nan
    grid = np.moveaxis(shell, 0, -1)
    for line in (*grid[::6], *grid.transpose(1, 0, 2)[::8]):
        axes.plot(*line.T, color=colour, lw=0.8, alpha=0.7, zorder=3)


def _along(informed: Ellipsotope) -> Any:
    """Generators with the longest axis first."""
    U, half, _ = np.linalg.svd(informed.G)
    return U * half


def enclosure_path() -> Figure:
    """Figure 8: into the enclosure through the leaf between its door's jambs."""
    world = enclosure()
    space = world.free_space()
    found = _adopted(world, space, 8, PaperSettings().samples)
    last = found[-1]
    figure = new_figure(5.4)
    axes = figure.add_subplot()
    draw_leaves(axes, space)
    draw_obstacles(axes, world)
    draw_faces(axes, [face.vertices for face in space.graph.faces])
    axes.plot(*outline(_informed(world, last)).T, "--", color=palette.INK, lw=1.2, zorder=5,
              label="ellipsotope")  # fmt: skip
    for k, leaf in enumerate(space.leaves):
        place = leaf.vertices().mean(axis=0)
        if np.linalg.norm(place - world.start) < 1.0:
            place += np.array([0.0, 1.5])
        axes.annotate(str(k), place, ha="center", va="center", fontsize=11,
                      color=palette.INK, zorder=4)  # fmt: skip
    draw_path(axes, last.waypoints, palette.PATH, f"path, {last.best:.3f} m")
    draw_ends(axes, world)
    bare(axes, world)
    axes.plot([], [], color=palette.GROWN, lw=1.8, label="shared faces")
    legend_below(figure, axes, 5)
    return figure
