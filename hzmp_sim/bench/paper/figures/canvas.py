"""What the drawings of worlds have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._polygons import counter_clockwise
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.free_space.plot import leaf_colours, within
from hzmp_planners.sets import Ellipsotope
from hzmp_sim.bench.paper.worlds import PaperWorld
from hzmp_sim.output import palette
from hzmp_sim.output.style import WIDTH_IN

PALE = 0.55  # share of white in the colours of leaves, so that paths stand out
PRUNED = "#eceef1"
"""Of leaves that are pruned."""


def new_figure(height: float) -> Figure:
    """A figure of the common width."""
    figure = Figure(figsize=(WIDTH_IN, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def bare(axes: Axes, world: PaperWorld) -> None:
    """Equal scales, the workspace's limits, a thin frame, no ticks."""
    axes.set(xlim=(world.lo[0], world.hi[0]), ylim=(world.lo[1], world.hi[1]), aspect="equal")
    axes.set(xticks=[], yticks=[])
    for side in axes.spines.values():
        side.set_color("#c9cdd3")


def draw_obstacles(axes: Axes, world: PaperWorld) -> None:
    """What of the obstacles is in the workspace."""
    parts = [within(block, world.lo, world.hi).vertices() for block in world.obstacles]
    rings = [counter_clockwise(part) for part in parts if len(part) > 2]
    axes.add_collection(PolyCollection(rings, color=palette.OBSTACLE, linewidths=0.6, zorder=2))


def draw_leaves(axes: Axes, space: FreeSpace, kept: Ints | None = None) -> None:
    """Leaves in pale colours, neighbours in different ones; those not in `kept` in grey."""
    rings = [counter_clockwise(leaf.vertices()) for leaf in space.leaves]
    fills: list[Any] = [
        tuple((1.0 - PALE) * part + PALE for part in colour) for colour in leaf_colours(space)
    ]
    if kept is not None:
        known = set(kept.tolist())
        fills = [fill if k in known else PRUNED for k, fill in enumerate(fills)]
    axes.add_collection(
        PolyCollection(rings, facecolors=fills, edgecolors="white", linewidths=1.0, zorder=1)
    )


def draw_faces(axes: Axes, segments: Any, colour: str = palette.GROWN) -> None:
    """Shared faces, or parts of them."""
    axes.add_collection(
        LineCollection(list(segments), colors=colour, linewidths=1.8, zorder=3, capstyle="round")
    )


def draw_path(
    axes: Any, waypoints: Floats, colour: str, label: str | None = None, width: float = 2.0
) -> None:
    """A path with its waypoints."""
    axes.plot(
        *waypoints.T, "o-", color=colour, lw=width, ms=2.2 + 0.6 * width, mec="white", mew=0.5,
        label=label, zorder=6,
    )  # fmt: skip


def draw_ends(
    axes: Any, world: PaperWorld, size: float = 1.0, seen: Sequence[int] | None = None
) -> None:
    """Start and goal; of their coordinates only some, if the picture shows only those."""
    kept = list(range(len(world.lo)) if seen is None else seen)
    for name, point, colour, marker, big in (
        ("start", world.start, palette.START, "s", 7.0),
        ("goal", world.goal, palette.GOAL, "*", 13.0),
    ):
        axes.plot(
            *point[kept, None], marker, color=colour, mec=palette.INK, mew=0.8, ms=size * big,
            ls="", label=name, zorder=8,
        )  # fmt: skip


def unclip(axes: Any) -> None:
    """Let a picture in 3-D use the room that its zoom asks for: axes clip to a square else.

    Layouts must not make room for it.
    """
    for artist in (*axes.lines, *axes.collections, *axes.texts):
        artist.set_clip_on(False)
        artist.set_in_layout(False)


def outline(informed: Ellipsotope, seen: Sequence[int] = (0, 1)) -> Floats:
    """Outline of an ellipsoid in two of its coordinates, shape (181, 2)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    rows = informed.G[list(seen)]
    shadow = np.linalg.cholesky(rows @ rows.T + 1e-12 * np.eye(2))
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) @ shadow.T
    return np.asarray(informed.c[list(seen)] + ring)


def legend_below(figure: Figure, axes: Any, columns: int) -> None:
    """One legend for the figure, without repetitions."""
    handles, labels = axes.get_legend_handles_labels()
    known = dict(zip(labels, handles, strict=True))
    figure.legend(
        list(known.values()), list(known), loc="outside lower center", ncols=columns,
        frameon=False, fontsize=9,
    )  # fmt: skip


def percent_label(part: float) -> str:
    """A tick of a logarithmic scale in percent, in full."""
    return f"{100.0 * part:.9f}".rstrip("0").rstrip(".") + " %"
