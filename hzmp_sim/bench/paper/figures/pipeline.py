"""Figures 1 and 4 of the paper: how the method goes on, and its ellipsotope."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space.plot import leaf_colours
from hzmp_sim.bench.paper.figures.canvas import (
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
from hzmp_sim.bench.paper.figures.first_iteration import ROUTES, FirstIteration
from hzmp_sim.output import palette

_COLOURS = (palette.PATH, palette.FLOWN, palette.INFORMED)[:ROUTES]
_TANGENTS = 12  # of the constrained zonotope around the ellipsotope
_NO_LEAVES = np.zeros(0, dtype=np.int64)


def pipeline() -> Figure:
    """Figure 1: environment, leaves, candidate paths, ellipsotope, what it leaves."""
    shown = FirstIteration.run()
    world, space, best = shown.world, shown.space, shown.routes[0]
    figure = new_figure(3.35)
    panels = figure.subplots(2, 3).ravel()
    titles = (
        "(a) obstacles, start, goal",
        f"(b) {len(space)} leaves, {len(space.graph)} shared faces",
        "(c) shortest paths over samples",
        f"(d) ellipsotope of cost {best[0]:.2f} m",
        f"(e) {len(shown.kept)} leaves left, faces clipped",
    )
    for axes, title in zip(panels, titles, strict=False):
        axes.set_title(title, fontsize=9, loc="left")
        bare(axes, world)
        draw_obstacles(axes, world)
        draw_ends(axes, world, 0.75)
    for axes in panels[1:4]:
        draw_leaves(axes, space)
    draw_leaves(panels[4], space, shown.kept)
    draw_faces(panels[1], space.graph.corners)
    draw_faces(panels[4], shown.parts)
    panels[2].plot(*shown.samples.reshape(-1, 2).T, ".", color=palette.INK, ms=3.0, zorder=4)
    for (cost, waypoints), colour in reversed(list(zip(shown.routes, _COLOURS, strict=True))):
        draw_path(panels[2], waypoints, colour, f"path of {cost:.2f} m", 1.6)
    for axes in panels[3:5]:
        _draw_outline(axes, outline(shown.informed), "--")
        draw_path(axes, best[1], palette.PATH, None, 1.6)
    _legend(panels[5], panels[2], panels[3])
    return figure


def _legend(axes: Axes, *others: Axes) -> None:
    """What the other panels show, in the place of a sixth one."""
    axes.axis("off")
    axes.plot([], [], color=palette.GROWN, lw=2.0, label="shared faces")
    axes.plot([], [], ".", color=palette.INK, ms=5.0, label="samples")
    known: dict[str, Any] = {}
    for one in (*others, axes):
        handles, labels = one.get_legend_handles_labels()
        known |= dict(zip(labels, handles, strict=True))
    axes.legend(list(known.values()), list(known), loc="center", frameon=False, fontsize=9)


def ellipsotope() -> Figure:
    """Figure 4: the ellipsotope of the best path, and the leaves cut by its zonotope enclosure."""
    shown = FirstIteration.run()
    world, space, (cost, waypoints) = shown.world, shown.space, shown.routes[0]
    around = shown.informed.enclosing_zonotope(_TANGENTS)
    figure = new_figure(2.75)
    left, right = figure.subplots(1, 2)
    left.set_title(f"(a) ellipsotope of cost {cost:.2f} m", loc="left", fontsize=10)
    right.set_title("(b) leaves ∩ constrained zonotope", loc="left", fontsize=10)
    draw_leaves(left, space)
    draw_leaves(right, space, _NO_LEAVES)
    for leaf, colour in zip(range(len(space)), leaf_colours(space), strict=True):
        part = space.leaf(leaf) & around
        if not part.is_empty():
            part.plot(right, facecolor=colour, edgecolor="white", alpha=0.9, linewidth=1.0)
    around.plot(right, facecolor="none", edgecolor=palette.INFORMED, alpha=1.0, linewidth=1.5)
    for axes, style in ((left, "-"), (right, ":")):
        _draw_outline(axes, outline(shown.informed), style)
        draw_obstacles(axes, world)
        draw_path(axes, waypoints, palette.PATH, "shortest path so far")
        draw_ends(axes, world)
        bare(axes, world)
    left.plot([], [], color=palette.INFORMED, lw=1.5, label=f"{_TANGENTS} tangents around it")
    legend_below(figure, left, 5)
    return figure


def _draw_outline(axes: Axes, ring: Floats, style: str) -> None:
    axes.plot(*ring.T, style, color=palette.INK, lw=1.2, zorder=5, label="ellipsotope")
