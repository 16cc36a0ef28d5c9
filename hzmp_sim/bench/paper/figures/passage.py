"""Figure 7 of the paper: shrinking ellipsotopes in the 3-D passage of section 4.2."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from hzmp_planners._polygons import facet_corners
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.paper import Iteration
from hzmp_planners.sets import Ellipsotope
from hzmp_sim.bench.paper.convergence import iterations
from hzmp_sim.bench.paper.figures.canvas import (
    draw_ends,
    draw_path,
    legend_below,
    new_figure,
    outline,
    unclip,
)
from hzmp_sim.bench.paper.worlds import PaperWorld, passage
from hzmp_sim.output import palette
from hzmp_sim.output.style import plain

_SAMPLES = 4  # per face: so few that single improvements can be seen
_ITERATIONS = 40
_COLOURS = (palette.SAMPLE, palette.INFORMED, palette.FLOWN, palette.PATH)
"""Of paths in the order in which they were found."""
_SIDE = [0, 2]  # x and z


def passage_in_space() -> Figure:
    """Paths of some iterations with their ellipsotopes, in space and from the side."""
    world = passage()
    space = world.free_space()
    made = iterations(world, space, _ITERATIONS, samples=_SAMPLES)
    found = [one for one in made if one.adopted]
    picked = [found[k] for k in _spread(len(found), len(_COLOURS))]
    figure = new_figure(6.6)
    grid = figure.add_gridspec(2, 1, height_ratios=[1.75, 1.0])
    axes: Any = figure.add_subplot(grid[0], projection="3d")
    _set_up(axes, world)
    _draw_walls(axes, space)
    side = figure.add_subplot(grid[1])
    _draw_section(side, world, space)
    for one, colour in zip(picked, _COLOURS[-len(picked) :], strict=True):
        informed = Ellipsotope.informed(world.start, world.goal, one.best)
        if one in (picked[0], picked[-1]):
            _draw_shell(axes, informed, world, colour)
        draw_path(axes, one.waypoints, colour, _label(one), 1.6)
        side.plot(*outline(informed, _SIDE).T, "--", color=colour, lw=1.0)
        draw_path(side, one.waypoints[:, _SIDE], colour, None, 1.6)
    draw_ends(axes, world)
    draw_ends(side, world, seen=_SIDE)
    unclip(axes)
    legend_below(figure, axes, 3)
    return figure


def _label(one: Iteration) -> str:
    return f"iteration {one.number}: {one.best:.2f} m"


def _spread(count: int, wanted: int) -> list[int]:
    """So many of the first `count` numbers, first and last included."""
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, wanted))})


def _set_up(axes: Any, world: PaperWorld) -> None:
    """Limits, view, and an open box around the workspace."""
    axes.computed_zorder = False
    (x0, y0, z0), (x1, y1, z1) = world.lo, world.hi
    axes.set(xlim=(x0, x1), ylim=(y0, y1), zlim=(z0, z1))
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set_box_aspect((x1 - x0, y1 - y0, 2.0 * (z1 - z0)), zoom=1.65)  # z stretched by 2
    axes.view_init(elev=24, azim=-68)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis.set_major_locator(MultipleLocator(5.0))


def _draw_walls(axes: Any, space: FreeSpace) -> None:
    for body in space.obstacles:
        V = body.vertices()
        rings = [V[corners] for _, corners in facet_corners(V, body.A, body.incidence)]
        walls = Poly3DCollection(
            rings, facecolor=palette.OBSTACLE, edgecolor="white", alpha=0.3, lw=0.4
        )
        axes.add_collection3d(walls)


def _draw_shell(axes: Any, informed: Ellipsotope, world: PaperWorld, colour: str) -> None:
    """What of an ellipsoid is in the workspace, as a veil."""
    polar, around = np.meshgrid(np.linspace(0, np.pi, 49), np.linspace(0, 2 * np.pi, 49))
    ball = np.stack([np.cos(polar), np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around)])
    U, half, _ = np.linalg.svd(informed.G)  # the longest axis first: poles near start and goal
    shell = np.moveaxis(np.einsum("ij,jkl->ikl", U * half, ball), 0, -1) + informed.c
    x, y, z = np.moveaxis(np.clip(shell, world.lo, world.hi), -1, 0)
    axes.plot_surface(x, y, z, color=colour, alpha=0.10, linewidth=0, shade=False)


def _draw_section(axes: Axes, world: PaperWorld, space: FreeSpace) -> None:
    """The workspace from the side, walls as they are on the way from door to door."""
    (x0, _, z0), (x1, _, z1) = world.lo, world.hi
    across = 0.5 * (world.start[1] + world.goal[1])  # through the doors, and over the middle wall
    for body in space.obstacles:
        low, high = body.interval_hull()
        if low[1] < across < high[1]:
            axes.fill_between([low[0], high[0]], low[2], high[2], color=palette.OBSTACLE, zorder=1)
    axes.set(xlim=(x0, x1), ylim=(z0, z1), xlabel="x [m]", ylabel="z [m]")
    plain(axes)
