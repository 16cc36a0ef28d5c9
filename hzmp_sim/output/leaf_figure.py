"""The free space of a scene: obstacles and leaves, whole or apart from each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hzmp_planners.free_space.plot import plot_leaves
from hzmp_sim.output import palette
from hzmp_sim.output.artifacts import OutputError, whole_file
from hzmp_sim.output.style import WIDTH_IN, save

if TYPE_CHECKING:
    from hzmp_planners.free_space import FreeSpace
    from hzmp_sim.scene import Scene


def write_leaf_picture(scene: Scene, space: FreeSpace, path: Path, explode: float = 0.0) -> None:
    """Draw the free space of a scene into a file; the name's ending says in which format.

    Args:
        scene: gives start, goal, and what the obstacles are grown by.
        space: of the scene.
        path: file to write.
        explode: how far apart the leaves are, see `plot_leaves`.

    Raises:
        OutputError: the file cannot be written, or is of no format that can be drawn.
        QueryError: explode is negative or not finite.
    """
    formats = sorted(FigureCanvasAgg.get_supported_filetypes())
    kind = path.suffix.removeprefix(".").lower()
    if kind not in formats:
        raise OutputError(f"picture {path} must end in one of {', '.join(formats)}")
    figure = leaf_figure(scene, space, explode)
    with whole_file(path) as partial:
        save(figure, partial)


def leaf_figure(scene: Scene, space: FreeSpace, explode: float = 0.0) -> Figure:
    """Leaves, obstacles, start and goal of a scene; see `plot_leaves`."""
    lo, hi = space.bounds
    flat = space.n == 2
    ratio = float((hi - lo)[1] / (hi - lo)[0]) if flat else 0.62
    figure = Figure(figsize=(WIDTH_IN, min(9.0, 1.3 + WIDTH_IN * ratio)), layout="constrained")
    FigureCanvasAgg(figure)
    axes: Any = figure.add_subplot(**({} if flat else {"projection": "3d"}))
    plot_leaves(space, axes, explode=explode, faces=flat and explode > 0.0)
    if not flat:
        axes.computed_zorder = False  # start and goal are in front of the leaves they lie in
    for name, point, colour, marker, size in (
        ("start", scene.start, palette.START, "s", 8),
        ("goal", scene.goal, palette.GOAL, "*", 14),
    ):
        axes.plot(
            *point[:, None], marker, color=colour, mec=palette.INK, mew=0.8, ms=size, ls="",
            label=name, zorder=7, clip_on=flat, in_layout=flat,
        )  # fmt: skip
    ball = scene.shape.kind == "ball"
    grown_by = f"the body's {f'radius, {1e3 * scene.radius:.0f} mm' if ball else scene.shape.kind}"
    figure.suptitle(
        f"{len(space.obstacles)} obstacles, {len(space)} leaves, {len(space.graph)} shared faces\n"
        f"Obstacles are grown by {grown_by}, and the clearance, {1e3 * scene.clearance:.0f} mm.",
        fontsize=10,
    )
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    return figure
