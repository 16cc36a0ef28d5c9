"""Pictures of free spaces on matplotlib axes: the leaves, whole or apart from each other."""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._polygons import counter_clockwise, facet_corners
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope

if TYPE_CHECKING:
    from hzmp_planners._solids import Solid
    from hzmp_planners.free_space.free_space import FreeSpace

Colour = tuple[float, float, float]

# Okabe-Ito, told apart by readers with any common colour vision; each half way to white.
_HUES = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#0072b2", "#d55e00")
_TINTS = (0.40, 0.70, 0.10)  # share of white for colours 0 to 6, 7 to 13, 14 to 20
_OBSTACLE: Colour = (0.36, 0.38, 0.42)
_FACE: Colour = (0.70, 0.10, 0.22)
_INK: Colour = (0.13, 0.15, 0.17)
_LABEL_ROOM = 0.012  # share of the workspace between a label and the sides of its leaf
_FILLED = np.array([0.84, 0.88])  # share of a picture's width and height for a box in 3-D
_ROUND = 30  # facets from which on edges would hide what they are drawn on


def plot_leaves(
    space: FreeSpace,
    ax: Any = None,
    *,
    explode: float = 0.0,
    faces: bool = False,
    labels: bool = False,
    alpha: float | None = None,
) -> Any:
    """Draw the leaves, so coloured that neighbours differ, and the obstacles in grey.

    With `explode` every leaf is drawn about its own centre at 1 / (1 + explode) of its size. But
    for the scale this is the picture of leaves moved apart by that share of the distances between
    them; here coordinates stay true, obstacles stay in place, and shared faces lie in the gaps.

    Args:
        space: what to draw.
        ax: axes to draw on, 3-D ones for a space in 3-D; new ones of pyplot when None.
        explode: 0 for leaves that touch; 0.2 shows what lies between them, 1 halves them.
        faces: draw the shared faces (doors, where leaves overlap).
        labels: write its number on each leaf that has room for it.
        alpha: opacity of the leaves, in [0, 1]; when None as it suits the picture: leaves in 3-D
            can be seen through unless they are apart.

    Returns:
        The axes, with limits, equal scales and units.

    Raises:
        ShapeError: 2-D axes for a space in 3-D, or the other way round.
        QueryError: explode is negative or not finite.
    """
    if not (math.isfinite(explode) and explode >= 0.0):
        raise QueryError(f"explode must be a number of at least 0, got {explode}")
    if ax is None:
        import matplotlib.pyplot as plt

        layout = {"projection": "3d"} if space.n == 3 else {}
        ax = plt.figure(layout="constrained").add_subplot(**layout)
    elif (ax.name == "3d") != (space.n == 3):
        given = 3 if ax.name == "3d" else 2
        raise ShapeError(f"a space in {space.n}-D cannot be drawn on {given}-D axes")
    colours = leaf_colours(space)
    if space.n == 2:
        _draw_flat(space, ax, colours, explode, faces, alpha)
    else:
        _draw_solid(space, ax, colours, explode, faces, alpha)
    _frame(space, ax)
    # Empty lines carry the entries of a legend.
    ax.plot(*[[]] * space.n, "s", color=_OBSTACLE, markersize=8, label="obstacles")
    if faces:
        style = "-" if space.n == 2 else "s"
        name = "shared faces" if space.disjoint else "doors"
        ax.plot(*[[]] * space.n, style, color=_FACE, markersize=8, label=name)
    if labels:
        room = _LABEL_ROOM * float(np.max(space.bounds[1] - space.bounds[0]))
        for number, leaf in enumerate(space.leaves):
            place = leaf.vertices().mean(axis=0)
            if leaf.violation(place)[0] < -room * (1.0 + explode):
                ax.text(*place, str(number), ha="center", va="center", fontsize=7, color=_INK)
    return ax


def shrunk(vertices: Floats, explode: float) -> Floats:
    """Points (k, n) about their mean, at 1 / (1 + explode) of their distances."""
    centre = vertices.mean(axis=0)
    return np.asarray(centre + (vertices - centre) / (1.0 + explode))


def leaf_colours(space: FreeSpace) -> list[Colour]:
    """A colour for each leaf, (red, green, blue) in [0, 1]: neighbours have different ones.

    Greedy colouring, the leaf with the fewest uncoloured neighbours last (Matula and Beck 1983):
    few colours, at most 6 where the leaf graph is planar. Only beyond 21 would some repeat.
    """
    return [_colour(number) for number in greedy_colouring(space.graph.ends, len(space)).tolist()]


def greedy_colouring(ends: Ints, count: int) -> Ints:
    """Numbers from 0 for the nodes of a graph, shape (count,); no edge has the same at both ends.

    Args:
        ends: nodes at the ends of each edge, shape (m, 2); repeated edges are one.
        count: number of nodes.
    """
    beside: list[set[int]] = [set() for _ in range(count)]
    for i, j in ends.tolist():
        beside[i].add(j)
        beside[j].add(i)
    degree = [len(nodes) for nodes in beside]
    queue = [(degree[i], i) for i in range(count)]
    heapq.heapify(queue)
    gone = [False] * count
    order = []
    while queue:
        known, i = heapq.heappop(queue)
        if gone[i] or known != degree[i]:
            continue
        gone[i] = True
        order.append(i)
        for j in beside[i]:
            if not gone[j]:
                degree[j] -= 1
                heapq.heappush(queue, (degree[j], j))
    numbers = np.full(count, -1)
    for i in reversed(order):
        taken = {int(numbers[j]) for j in beside[i]}
        numbers[i] = next(k for k in range(len(taken) + 1) if k not in taken)
    return numbers


def _colour(number: int) -> Colour:
    tier, place = divmod(number, len(_HUES))
    white = _TINTS[tier % len(_TINTS)]
    red, green, blue = (int(_HUES[place][i : i + 2], 16) / 255 for i in (1, 3, 5))
    return tuple((1.0 - white) * part + white for part in (red, green, blue))  # type: ignore[return-value]


def _draw_flat(
    space: FreeSpace,
    ax: Any,
    colours: list[Colour],
    explode: float,
    faces: bool,
    alpha: float | None,
) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    shade = alpha if alpha is not None else 1.0 if space.disjoint else 0.35
    rings = [shrunk(counter_clockwise(leaf.vertices()), explode) for leaf in space.leaves]
    fills = [(*colour, shade) for colour in colours]
    edge = "white" if space.disjoint else (*_INK, 0.6)
    ax.add_collection(
        PolyCollection(rings, facecolors=fills, edgecolors=edge, linewidths=0.8, zorder=1)
    )
    blocks = [counter_clockwise(block.vertices()) for block in _blocks(space)]
    ax.add_collection(
        PolyCollection(blocks, facecolors=_OBSTACLE, edgecolors="white", linewidths=0.8, zorder=2)
    )
    if faces:
        segments = [shrunk(face.vertices, explode) for face in space.graph.faces]
        ax.add_collection(
            LineCollection(segments, colors=[_FACE], linewidths=1.4, zorder=3, capstyle="round")
        )


def _draw_solid(
    space: FreeSpace,
    ax: Any,
    colours: list[Colour],
    explode: float,
    faces: bool,
    alpha: float | None,
) -> None:
    from hzmp_planners._solids import Solid, Solids

    shade = alpha if alpha is not None else 0.08 if explode == 0.0 else 1.0
    solids = []
    for leaf, colour in zip(space.leaves, colours, strict=True):
        edge = (*_INK, 0.7) if shade == 1.0 else (*(0.6 * part for part in colour), 0.5)
        solids.append(_solid(leaf, (*colour, shade), edge, explode))  # type: ignore[arg-type]
    for block in _blocks(space):
        solids.append(_solid(block, (*_OBSTACLE, 1.0), (*_INK, 1.0)))
    for face in space.graph.faces if faces else ():
        corners = shrunk(face.vertices, explode)
        normals = np.array([face.normal, -face.normal])
        solids.append(Solid([corners, corners[::-1]], normals, (*_FACE, 1.0), (*_INK, 0.7)))
    solids = [solid for solid in solids if solid.facets]
    # Axes in 3-D clip to a square; the zoom uses more, and layouts must not make room for it.
    drawn = Solids(solids, linewidths=0.5, clip_on=False, in_layout=False)
    ax.add_collection(drawn, autolim=False)


def _solid(
    body: Polytope,
    fill: tuple[float, float, float, float],
    edge: tuple[float, float, float, float],
    explode: float = 0.0,
) -> Solid:
    from hzmp_planners._solids import Solid

    points = shrunk(body.vertices(), explode)
    facets = facet_corners(points, body.A, body.incidence)
    rows = [row for row, _ in facets]
    return Solid(
        [points[corners] for _, corners in facets],
        body.A[rows],
        fill,
        edge if len(facets) <= _ROUND else (*fill[:3], 0.0),
    )


def within(polytope: Polytope, lo: Floats, hi: Floats) -> Polytope:
    """The part of a polytope in the box [lo, hi]; empty when there is none."""
    low, high = polytope.interval_hull()
    if (low >= lo).all() and (high <= hi).all():
        return polytope
    box = Polytope.from_box(lo, hi)
    return Polytope(np.vstack([polytope.A, box.A]), np.concatenate([polytope.b, box.b]))


def _blocks(space: FreeSpace) -> list[Polytope]:
    """What of the obstacles is in the workspace."""
    parts = [within(block, *space.bounds) for block in space.obstacles]
    return [part for part in parts if len(part.vertices()) > space.n]


def _frame(space: FreeSpace, ax: Any) -> None:
    from matplotlib.ticker import MaxNLocator

    lo, hi = space.bounds
    ax.set(xlim=(lo[0], hi[0]), ylim=(lo[1], hi[1]), xlabel="x [m]", ylabel="y [m]")
    if space.n == 2:
        ax.set_aspect("equal")
        return
    ax.set(zlim=(lo[2], hi[2]), zlabel="z [m]")
    ax.view_init(elev=24, azim=-58)
    ax.set_box_aspect(hi - lo)
    ax.set_box_aspect(hi - lo, zoom=_zoom(lo, hi, ax))
    for axis, size in zip((ax.xaxis, ax.yaxis, ax.zaxis), hi - lo, strict=True):
        ticks = max(2, round(6 * size / np.max(hi - lo)))
        axis.set_major_locator(MaxNLocator(ticks, steps=[1, 2, 5, 10]))
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis.labelpad = 7.0


def _zoom(lo: Floats, hi: Floats, ax: Any) -> float:
    """How much larger the box can be drawn: 3-D axes use but a square of their room."""
    corners = np.array(np.meshgrid(*zip(lo, hi, strict=True))).reshape(3, -1)
    points = ax.get_proj() @ np.vstack([corners, np.ones(8)])
    extent = np.ptp(ax.transLimits.transform((points[:2] / points[3]).T), axis=0)
    room = ax.get_position(original=True).size * ax.figure.get_size_inches()
    return float(np.min(_FILLED * room / room.min() / extent))
