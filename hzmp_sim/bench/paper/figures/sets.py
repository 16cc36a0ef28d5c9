"""Figures 2 and 3 of the paper: free spaces as hybrid zonotopes, and which leaves are adjacent."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from scipy.sparse import csr_array, hstack

from hzmp_planners._polygons import facet_corners
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import plan
from hzmp_planners.sets import HybridZonotope
from hzmp_sim.bench.paper.figures.canvas import (
    bare,
    draw_ends,
    draw_leaves,
    draw_obstacles,
    draw_path,
    new_figure,
    unclip,
)
from hzmp_sim.bench.paper.worlds import chain, one_obstacle
from hzmp_sim.output import palette

_IDS: tuple[int, ...] = (1, 4, 3, 2)  # of the leaves along the route, as in the paper's example 2
_HUES = (palette.SAMPLE, palette.GOAL, palette.BOUND, palette.INFORMED)


def hybrid_zonotope() -> Figure:
    """Figure 2: a map as a hybrid zonotope, with the pattern of its constraints."""
    world = one_obstacle()
    space = world.free_space()
    H = space.hybrid_zonotope()
    figure = new_figure(3.3)
    left, right = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
    draw_leaves(left, space)
    draw_obstacles(left, world)
    bare(left, world)
    left.plot(*space.vertices.T, "o", color=palette.INK, ms=6, clip_on=False, zorder=5)
    for k, leaf in enumerate(space.leaves):
        left.annotate(
            f"$\\beta = e_{k + 1}$", leaf.vertices().mean(axis=0), ha="center", va="center",
            color=palette.INK, fontsize=10,
        )  # fmt: skip
    left.set_title(f"{H.nb} leaves on {len(space.vertices)} vertices", loc="left", fontsize=10)
    _draw_pattern(right, H)
    figure.supxlabel(
        f"$n_g = 2 n_v = {H.ng}$,  $n_b = N = {H.nb}$,  $n_c = n_v + 2 = {H.nc}$", fontsize=10
    )
    return figure


def _draw_pattern(axes: Axes, H: HybridZonotope) -> None:
    """Which constraint has which factor."""
    pattern = hstack([csr_array(H.Ac), csr_array(H.Ab)]).toarray() != 0.0
    axes.spy(pattern, markersize=3.4, color=palette.PATH)
    axes.axvline(H.ng - 0.5, color=palette.GROWN, lw=1.2)
    axes.set_xticks([0, H.ng - 1, H.ng + H.nb - 1], ["1", f"{H.ng}", f"{H.ng + H.nb}"])
    axes.set_yticks([0, H.nc - 1], ["1", f"{H.nc}"])
    axes.xaxis.tick_bottom()
    axes.set_xlabel("factors, binary ones last", fontsize=9)
    axes.set_ylabel("constraints", fontsize=9)
    axes.set_title("non-zeros of $[A_c\\ |\\ A_b]$", loc="left", fontsize=10)


def four_leaves() -> Figure:
    """Figure 3: four leaves in space, their adjacency matrix, and the only route."""
    world = chain()
    space = world.free_space()
    path = plan(space, world.start, world.goal)
    ids = dict(zip(path.leaves.tolist(), _IDS, strict=True))
    figure = new_figure(3.5)
    grid = figure.add_gridspec(1, 2, width_ratios=[2.2, 1.0])
    axes: Any = figure.add_subplot(grid[0], projection="3d")
    axes.computed_zorder = False
    axes.set_axis_off()
    axes.set(xlim=(0, 4), ylim=(0, 2), zlim=(0, 2))
    axes.set_box_aspect((4, 2, 2), zoom=1.5)
    axes.view_init(elev=22, azim=-64)
    _draw_bodies(axes, space)
    draw_path(axes, path.waypoints, palette.PATH)
    draw_ends(axes, world)
    for leaf, number in ids.items():
        low, high = space.leaves[leaf].interval_hull()
        axes.text(
            *(0.5 * (low[:2] + high[:2])), high[2], str(number), fontsize=13, color=palette.INK,
            ha="center", va="center", zorder=9,
        )  # fmt: skip
    route = " → ".join(str(ids[leaf]) for leaf in path.leaves.tolist())
    axes.set_title(f"the only route: {route}", fontsize=10)
    unclip(axes)
    _draw_matrix(figure.add_subplot(grid[1]), space, ids)
    return figure


def _draw_bodies(axes: Any, space: FreeSpace) -> None:
    """Leaves as coloured bodies that can be seen through, shared faces solid."""
    for leaf, hue in zip(space.leaves, _HUES, strict=True):
        V = leaf.vertices()
        rings = [V[corners] for _, corners in facet_corners(V, leaf.A, leaf.incidence)]
        fill, edge = palette.rgba(hue, 0.2), palette.rgba(hue, 0.9)
        axes.add_collection3d(Poly3DCollection(rings, facecolor=fill, edgecolor=edge, lw=0.8))
    for face in space.graph.faces:
        solid = Poly3DCollection([face.vertices], facecolor=palette.GROWN, alpha=0.7)
        axes.add_collection3d(solid)


def _draw_matrix(axes: Axes, space: FreeSpace, ids: dict[int, int]) -> None:
    """Which leaves share a face, by their numbers from 1 on."""
    matrix = np.zeros((len(space), len(space)), dtype=np.int64)
    for i, j in space.graph.ends.tolist():
        matrix[ids[i] - 1, ids[j] - 1] = matrix[ids[j] - 1, ids[i] - 1] = 1
    axes.imshow(matrix, cmap="Blues", vmin=0, vmax=2.2)
    names = [str(k + 1) for k in range(len(space))]
    axes.set_xticks(range(len(space)), names)
    axes.set_yticks(range(len(space)), names)
    for (i, j), value in np.ndenumerate(matrix):
        axes.text(j, i, str(value), ha="center", va="center", color=palette.INK, fontsize=11)
    axes.set_title("adjacency matrix", fontsize=10)
    axes.tick_params(length=0)
