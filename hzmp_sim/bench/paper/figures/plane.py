"""Figures 5 and 8 of the paper: paths in the maze of section 4.1 and the enclosure of 4.3."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hzmp_planners._arrays import Ints
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.paper import Iteration
from hzmp_planners.sets import Ellipsotope
from hzmp_sim.bench.paper.convergence import iterations
from hzmp_sim.bench.paper.figures.canvas import (
    PRUNED,
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
from hzmp_sim.bench.paper.worlds import PaperWorld, enclosure, maze
from hzmp_sim.output import palette

_LABEL = np.array([0.5, 0.8])  # place of a number in its leaf: above the path


def maze_path() -> Figure:
    """Figure 5: the maze, its leaves, and the path after as many iterations as in the paper."""
    world = maze()
    space = world.free_space()
    best = _best_of_first(world, space)
    figure = new_figure(6.2)
    axes = figure.add_subplot()
    _draw(axes, world, space, best, np.flatnonzero(best.leaves))
    axes.set(xticks=range(-100, 801, 100), yticks=range(-100, 601, 100))
    axes.set(xlabel="x [cm]", ylabel="y [cm]")
    axes.tick_params(labelsize=9, colors=palette.INK)
    axes.plot([], [], "s", color=PRUNED, mec=palette.OBSTACLE, mew=0.5, ms=9, label="pruned leaves")
    legend_below(figure, axes, 5)
    return figure


def enclosure_path() -> Figure:
    """Figure 8: into the enclosure through the leaf between its door's jambs."""
    world = enclosure()
    space = world.free_space()
    figure = new_figure(5.6)
    axes = figure.add_subplot()
    _draw(axes, world, space, _best_of_first(world, space))
    draw_faces(axes, space.graph.corners)
    for k, leaf in enumerate(space.leaves):
        low, high = leaf.interval_hull()
        x, y = (low + _LABEL * (high - low)).tolist()
        axes.text(x, y, str(k), ha="center", va="center", fontsize=11, color=palette.INK)
    axes.plot([], [], color=palette.GROWN, lw=1.8, label="shared faces")
    legend_below(figure, axes, 5)
    return figure


def _best_of_first(world: PaperWorld, space: FreeSpace) -> Iteration:
    """The last improvement in as many iterations as the paper's maze took."""
    return [one for one in iterations(world, space, MAZE_ITERATIONS) if one.adopted][-1]


def _draw(
    axes: Axes, world: PaperWorld, space: FreeSpace, best: Iteration, kept: Ints | None = None
) -> None:
    """Leaves, obstacles, and the best path with its ellipsotope."""
    draw_leaves(axes, space, kept)
    draw_obstacles(axes, world)
    ring = outline(Ellipsotope.informed(world.start, world.goal, best.best))
    axes.plot(*ring.T, "--", color=palette.INK, lw=1.2, zorder=5, label="ellipsotope")
    label = f"path after {MAZE_ITERATIONS} iterations, {best.best:.4g} {world.unit}"
    draw_path(axes, best.waypoints, palette.PATH, label)
    draw_ends(axes, world)
    bare(axes, world)
