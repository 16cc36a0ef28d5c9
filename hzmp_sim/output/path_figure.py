"""The path among obstacles and leaves: a plan view in 2-D, a scene and two views in 3-D."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from scipy.spatial import ConvexHull, QhullError

from hzmp_planners._polygons import counter_clockwise
from hzmp_planners.free_space.plot import within
from hzmp_sim.output import palette
from hzmp_sim.output.meshes import geom_points, hull_triangles, polytope_outline
from hzmp_sim.output.poses import pose_at_start
from hzmp_sim.output.style import WIDTH_IN, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hzmp_planners._arrays import Floats
    from hzmp_sim.run import Run

_FLOWN_POINTS = 600


def path_figure(run: Run) -> Figure:
    """Obstacles, the leaves that the path uses, the informed set, path and flight."""
    return _plan_view(run) if run.scene.n == 2 else _space_view(run)


def _plan_view(run: Run) -> Figure:
    lo, hi = run.scene.workspace
    width, height = hi - lo
    figure = _new(min(9.0, 1.0 + WIDTH_IN * float(height / width)))
    axes = figure.add_subplot()
    leaves = [counter_clockwise(leaf.vertices()) for leaf in run.space.leaves]
    axes.add_collection(_polygons(leaves, "none", palette.LEAF, 0.5, "leaves"))
    used = [counter_clockwise(run.space.leaf(i).vertices()) for i in np.unique(run.plan.leaves)]
    if used:
        axes.add_collection(
            _polygons(used, palette.CORRIDOR, palette.SAMPLE, 0.8, "leaves of the path")
        )
    _flat_obstacles(axes, run, (0, 1), grown=True)
    _informed(axes, run)
    _ways(axes, run, (0, 1))
    _frame(axes, run, (0, 1))
    _legend(figure, axes)
    return figure


def _space_view(run: Run) -> Figure:
    figure = _new(9.0)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.5, 1.0])
    axes: Any = figure.add_subplot(grid[0, :], projection="3d")
    lo, hi = run.scene.workspace
    for obstacle in run.scene.obstacles:
        part = within(obstacle, lo, hi)
        vertices, triangles = hull_triangles(part.vertices())
        faces = Poly3DCollection(list(vertices[triangles]), facecolor=palette.OBSTACLE, alpha=0.10)
        axes.add_collection3d(faces)
        edges = polytope_outline(part)
        if len(edges) <= 60:  # a rounded obstacle would be nothing but edges
            axes.add_collection3d(Line3DCollection(edges, colors=palette.OBSTACLE, lw=0.5))
    for index in np.unique(run.plan.leaves):
        edges = polytope_outline(run.space.leaf(index))
        axes.add_collection3d(Line3DCollection(edges, colors=palette.SAMPLE, lw=0.4))
    _ways(axes, run, (0, 1, 2))
    axes.set(xlim=(lo[0], hi[0]), ylim=(lo[1], hi[1]), zlim=(lo[2], hi[2]))
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set_box_aspect(hi - lo, zoom=1.0)
    axes.view_init(elev=22, azim=-58)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis._axinfo["grid"].update(color="#e3e6ea", linewidth=0.6)
    above, beside = (figure.add_subplot(grid[1, column]) for column in (0, 1))
    for view, plane, title in ((above, (0, 1), "from above"), (beside, (0, 2), "from the side")):
        _flat_obstacles(view, run, plane, grown=False)
        _ways(view, run, plane)
        _frame(view, run, plane)
        view.set_title(title, fontsize=10)
    _legend(figure, above)
    return figure


def _new(height: float) -> Figure:
    figure = Figure(figsize=(WIDTH_IN, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _flat_obstacles(axes: Axes, run: Run, plane: tuple[int, int], *, grown: bool) -> None:
    """Outlines of the obstacle geoms seen along an axis and, in 2-D, what the centre must avoid."""
    scene = run.scene
    if grown:
        polygons = [counter_clockwise(obstacle.vertices()) for obstacle in scene.obstacles]
        axes.add_collection(
            _polygons(polygons, "#f6e3e0", palette.GROWN, 0.8, "grown by radius and clearance")
        )
    data = mujoco.MjData(scene.model)
    pose_at_start(scene, data)
    mujoco.mj_kinematics(scene.model, data)
    outlines = _outlines(run, data, scene.obstacle_geoms, plane)
    alpha = 1.0 if grown else 0.35
    axes.add_collection(
        _polygons(outlines, palette.OBSTACLE, palette.OBSTACLE, 0.6, "obstacles", alpha)
    )
    if scene.moving:
        moving = _outlines(run, data, [item.geom for item in scene.moving], plane)
        axes.add_collection(
            _polygons(moving, "none", palette.INK, 1.0, "what moves, at the start", alpha=0.7)
        )


def _outlines(
    run: Run, data: mujoco.MjData, geoms: Iterable[int], plane: tuple[int, int]
) -> list[Floats]:
    """Outlines of geoms seen along an axis, each (k, 2) [m]; `data` with their poses."""
    outlines = []
    for geom in dict.fromkeys(geoms):
        points = geom_points(run.scene.model, data, geom)
        if points is None:
            continue
        try:
            outlines.append(points[:, plane][ConvexHull(points[:, plane]).vertices])
        except QhullError:
            continue
    return outlines


def _informed(axes: Axes, run: Run) -> None:
    if not run.plan.informed:
        return
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    rings = [informed.c + circle @ informed.G.T for informed in run.plan.informed]
    axes.add_collection(LineCollection(rings[:-1], colors=palette.INFORMED, lw=0.7, alpha=0.45))
    axes.plot(*rings[-1].T, color=palette.INFORMED, lw=1.2, ls="--", label="informed set")


def _ways(axes: Any, run: Run, coordinates: Sequence[int]) -> None:
    """Path, flown way, start and goal, in the given coordinates."""
    order = list(coordinates)
    scene = run.scene
    if len(run.plan.waypoints):
        way = run.plan.waypoints[:, order]
        axes.plot(*way.T, "o-", color=palette.PATH, lw=1.6, ms=3.5, label="path", zorder=5)
    if run.log is not None:
        every = max(1, len(run.log.time) // _FLOWN_POINTS)
        flown = run.log.position[::every, order]
        axes.plot(*flown.T, color=palette.FLOWN, lw=1.6, label="flown", zorder=6)
    for name, point, colour, marker in (
        ("start", scene.start, palette.START, "s"),
        ("goal", scene.goal, palette.GOAL, "*"),
    ):
        axes.plot(
            *point[order][:, None], marker, color=colour, mec=palette.INK, mew=0.6,
            ms=8 if marker == "s" else 13, ls="", label=name, zorder=7,
        )  # fmt: skip


def _polygons(
    polygons: list[Floats], fill: str, edge: str, width: float, label: str, alpha: float = 1.0
) -> PolyCollection:
    return PolyCollection(
        polygons, facecolor=fill, edgecolor=edge, lw=width, label=label, alpha=alpha
    )


def _frame(axes: Axes, run: Run, plane: tuple[int, int]) -> None:
    lo, hi = (corner[list(plane)] for corner in run.scene.workspace)
    axes.set(xlim=(lo[0], hi[0]), ylim=(lo[1], hi[1]), aspect="equal")
    axes.set(xlabel=f"{'xyz'[plane[0]]} [m]", ylabel=f"{'xyz'[plane[1]]} [m]")
    plain(axes)


def _legend(figure: Figure, axes: Any) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
