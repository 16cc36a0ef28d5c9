"""Figures 1 to 4 of the paper: how the method works, drawn by the method itself."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from scipy.sparse import csr_array, hstack

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._polygons import facet_corners
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.free_space.plot import leaf_colours
from hzmp_planners.planning import plan
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.planning.paper.breadth_first import Candidate, find_all_connected_paths
from hzmp_planners.planning.paper.informed_faces import compute_shared_faces, generate_samples
from hzmp_planners.planning.paper.optimize import PathTable, optimize_paths
from hzmp_planners.planning.paper.reachable import (
    Detours,
    ReachableSet,
    remaining_faces,
    update_reachable_set,
)
from hzmp_planners.planning.roadmap import Query
from hzmp_planners.sets import Activity, Ellipsotope, Polytope
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
from hzmp_sim.bench.paper.worlds import one_obstacle, overview
from hzmp_sim.output import palette

_SAMPLES = 6
_ROUTES = (palette.PATH, palette.FLOWN, palette.INFORMED)


class _Shown:
    """The first iteration of algorithm 1 in the world of figure 1, step by step."""

    def __init__(self) -> None:
        self.world = overview()
        self.space = self.world.free_space()
        graph, (s, g) = self.space.graph, (self.world.start, self.world.goal)
        self.query = Query(s, g, self.space.leaves_at(s), self.space.leaves_at(g))
        least, self.nearest = least_detour(graph.corners, s, g)
        found = find_all_connected_paths(graph, self.query, None, 10_000)
        assert found is not None
        rng = np.random.default_rng(0)
        self.samples = generate_samples(graph.corners, _SAMPLES, rng)
        whole = [self._best(path) for path in found]
        order = np.argsort([cost for cost, _ in whole], kind="stable").tolist()
        chosen: list[int] = []
        for k in order:  # the best ones that differ in two leaves at least
            if all(len(set(found[k].leaves) ^ set(found[j].leaves)) > 2 for j in chosen):
                chosen.append(k)
        self.routes = [whole[k] for k in chosen[: len(_ROUTES)]]
        self.cost = self.routes[0][0]
        self.reachable: ReachableSet = update_reachable_set(
            self.query, self.cost, Detours.of(self.space, self.query, least)
        )

    def _best(self, path: Candidate) -> tuple[float, Floats]:
        table = PathTable.of([path])
        s, g = self.query.start, self.query.goal
        cost, waypoints, _ = optimize_paths(s, g, self.samples[table.faces], table)
        return cost, waypoints

    @property
    def kept(self) -> Ints:
        """Leaves that are left."""
        return np.flatnonzero(self.reachable.leaves != Activity.INACTIVE)

    @property
    def parts(self) -> Floats:
        """What is left of the shared faces."""
        faces = remaining_faces(self.reachable)
        return compute_shared_faces(self.space.graph, faces, self.reachable, self.nearest)


def pipeline() -> Figure:
    """Figure 1: environment, leaves, candidate paths, ellipsotope, what it leaves."""
    shown = _Shown()
    world, space = shown.world, shown.space
    figure = new_figure(3.7)
    panels = figure.subplots(2, 3).ravel()
    titles = (
        "(a) obstacles, start, goal",
        f"(b) {len(space)} leaves, {len(space.graph)} shared faces",
        "(c) shortest paths over samples",
        f"(d) ellipsotope of cost {shown.cost:.2f} m",
        f"(e) {len(shown.kept)} leaves left, faces clipped",
    )
    for axes, title in zip(panels, titles, strict=False):
        axes.set_title(title, fontsize=9, loc="left")
        bare(axes, world)
        draw_obstacles(axes, world)
    for axes in panels[1:4]:
        draw_leaves(axes, space)
    draw_leaves(panels[4], space, shown.kept)
    draw_faces(panels[1], space.graph.corners)
    draw_faces(panels[4], shown.parts)
    panels[2].plot(*shown.samples.reshape(-1, 2).T, ".", color=palette.INK, ms=3.0, zorder=4)
    for (cost, way), colour in reversed(list(zip(shown.routes, _ROUTES, strict=True))):
        draw_path(panels[2], way, colour, f"{cost:.2f} m", 1.6)
    assert shown.reachable.informed is not None
    ring = outline(shown.reachable.informed)
    for axes in panels[3:5]:
        axes.plot(*ring.T, "--", color=palette.INK, lw=1.2, zorder=5, label="ellipsotope")
        draw_path(axes, shown.routes[0][1], palette.PATH, None, 1.6)
    for axes in panels[:5]:
        draw_ends(axes, world, 0.75)
    _legend(panels[5], panels[2], panels[3])
    return figure


def _legend(axes: Any, *others: Any) -> None:
    axes.axis("off")
    known: dict[str, Any] = {}
    for other in others:
        known |= dict(zip(*other.get_legend_handles_labels()[::-1], strict=True))
    axes.plot([], [], color=palette.GROWN, lw=2.0, label="shared faces")
    axes.plot([], [], ".", color=palette.INK, ms=5.0, label="samples")
    known |= dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    axes.legend(list(known.values()), list(known), loc="center", frameon=False, fontsize=9)


def hybrid_zonotope() -> Figure:
    """Figure 2: a map as a hybrid zonotope, with the pattern of its constraints."""
    world = one_obstacle()
    space = world.free_space()
    H = space.hybrid_zonotope()
    figure = new_figure(3.4)
    left, right = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
    draw_leaves(left, space)
    draw_obstacles(left, world)
    bare(left, world)
    left.plot(*space.vertices.T, "o", color=palette.INK, ms=4, zorder=4, clip_on=False)
    for k, leaf in enumerate(space.leaves):
        left.annotate(
            f"$\\beta = e_{k + 1}$", leaf.vertices().mean(axis=0), ha="center", va="center",
            color=palette.INK, fontsize=10,
        )  # fmt: skip
    left.set_title(f"{H.nb} leaves on {len(space.vertices)} vertices", loc="left", fontsize=10)
    right.spy(hstack([csr_array(H.Ac), csr_array(H.Ab)]), markersize=3.2, color=palette.PATH)
    right.axvline(H.ng - 0.5, color=palette.GROWN, lw=1.2)
    right.set(xticks=[0, H.ng - 1, H.ng + H.nb - 1], yticks=[0, H.nc - 1])
    right.set_xticklabels(["1", f"{H.ng}", f"{H.ng + H.nb}"])
    right.set_yticklabels(["1", f"{H.nc}"])
    right.xaxis.tick_bottom()
    right.set_title("non-zeros of $[A_c\\ |\\ A_b]$", loc="left", fontsize=10)
    figure.supxlabel(
        f"$n_g = 2 n_v = {H.ng}$,  $n_b = N = {H.nb}$,  $n_c = n_v + 2 = {H.nc}$", fontsize=10
    )
    return figure


def four_leaves() -> Figure:
    """Figure 3: four leaves in space, their adjacency matrix, and the only route."""
    boxes = [
        ((0, 0, 1), (1, 2, 2)),
        ((1, 1, 0), (2, 2, 2)),
        ((2, 0, 0), (3, 2, 1)),
        ((3, 0, 0), (4, 1, 2)),
    ]
    space = FreeSpace.decompose(
        ((0, 0, 0), (4, 2, 2)), [Polytope.from_box(lo, hi) for lo, hi in boxes]
    )
    start, goal = np.array([0.25, 1.6, 0.4]), np.array([3.75, 1.6, 0.4])
    path = plan(space, start, goal)
    figure = new_figure(3.9)
    grid = figure.add_gridspec(1, 2, width_ratios=[2.3, 1.0], wspace=0.12)
    axes: Any = figure.add_subplot(grid[0], projection="3d")
    _draw_boxes(axes, space)
    axes.set(xlim=(0, 4), ylim=(0, 2), zlim=(0, 2), xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set_box_aspect((4, 2, 2), zoom=1.05)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis.set_major_locator(MultipleLocator(1.0))
    axes.computed_zorder = False
    draw_path(axes, path.waypoints, palette.PATH)
    for k, leaf in enumerate(space.leaves):
        axes.text(
            *leaf.vertices().mean(axis=0), f"{k + 1}", fontsize=13, color=palette.INK, zorder=9
        )
    axes.view_init(elev=24, azim=-62)
    route = " → ".join(str(leaf + 1) for leaf in path.leaves)
    axes.set_title(f"the only route: {route}", fontsize=10)
    table = figure.add_subplot(grid[1])
    matrix = np.zeros((len(space), len(space)), dtype=np.int64)
    for i, j in space.graph.ends.tolist():
        matrix[i, j] = matrix[j, i] = 1
    table.imshow(matrix, cmap="Blues", vmin=0, vmax=2.2)
    names = [str(k + 1) for k in range(len(space))]
    table.set_xticks(range(len(space)), names)
    table.set_yticks(range(len(space)), names)
    for (i, j), value in np.ndenumerate(matrix):
        table.text(j, i, str(value), ha="center", va="center", color=palette.INK, fontsize=11)
    table.set_title("adjacency matrix", fontsize=10)
    table.tick_params(length=0)
    return figure


def _draw_boxes(axes: Any, space: FreeSpace) -> None:
    """Leaves as coloured bodies that can be seen through, shared faces solid."""
    for leaf, colour in zip(space.leaves, leaf_colours(space), strict=True):
        V = leaf.vertices()
        rings = [V[corners] for _, corners in facet_corners(V, leaf.A, leaf.incidence)]
        axes.add_collection3d(
            Poly3DCollection(rings, facecolor=(*colour, 0.22), edgecolor=(*colour, 0.9), lw=0.8)
        )
    for face in space.graph.faces:
        axes.add_collection3d(
            Poly3DCollection([face.vertices], facecolor=palette.GROWN, alpha=0.75)
        )


def ellipsotope() -> Figure:
    """Figure 4: the ellipsotope of the best path, and the leaves cut by its zonotope enclosure."""
    shown = _Shown()
    world, space = shown.world, shown.space
    informed: Ellipsotope | None = shown.reachable.informed
    assert informed is not None
    around = informed.enclosing_zonotope(12)
    figure = new_figure(2.7)
    left, right = figure.subplots(1, 2)
    for axes, title in (
        (left, f"(a) ellipsotope of cost {shown.cost:.2f} m"),
        (right, "(b) leaves ∩ constrained zonotope"),
    ):
        axes.set_title(title, loc="left", fontsize=10)
        bare(axes, world)
        draw_obstacles(axes, world)
        draw_leaves(axes, space, np.zeros(0, dtype=np.int64) if axes is right else None)
    for k, colour in enumerate(leaf_colours(space)):
        part = space.leaf(k) & around
        if not part.is_empty():
            part.plot(right, facecolor=colour, edgecolor="white", alpha=0.9, linewidth=1.0)
    around.plot(right, facecolor="none", edgecolor=palette.INFORMED, alpha=1.0, linewidth=1.5)
    for axes in (left, right):
        style = "-" if axes is left else ":"
        axes.plot(*outline(informed).T, style, color=palette.INK, lw=1.3, zorder=5)
        draw_path(axes, shown.routes[0][1], palette.PATH, "shortest path so far")
        draw_ends(axes, world)
        bare(axes, world)
    left.plot([], [], "-", color=palette.INK, lw=1.3, label="ellipsotope")
    left.plot([], [], color=palette.INFORMED, lw=1.5, label="its enclosure by 12 tangents")
    legend_below(figure, left, 5)
    return figure
