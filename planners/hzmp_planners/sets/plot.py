"""Pictures of sets on matplotlib axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import ConvexHull

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.convex_set import ConvexSet
from hzmp_planners.sets.hulls.sampling import spread_directions

if TYPE_CHECKING:
    from matplotlib.artist import Artist

    from hzmp_planners.sets.base import Set


def plot(body: Set, ax: Any, style: dict[str, Any]) -> list[Artist]:
    """Draw every convex part; see `Set.plot`. The first artist carries the label."""
    if body.n not in (2, 3):
        raise ShapeError(f"only sets in 2 or 3 dimensions can be drawn, got {body.n}")
    style = {"alpha": 0.4} | style
    coloured = style.keys() & {"color", "facecolor", "fc"}
    artists: list[Artist] = []
    for part in body.convex_parts():
        if part.is_empty():
            continue
        drawn = len(ax.patches) + len(ax.lines) + len(ax.collections)
        own = style if coloured else {"color": f"C{drawn}"} | style  # the next of the colour cycle
        artists.append((_draw_2d if body.n == 2 else _draw_3d)(part, ax, own))
        style.pop("label", None)
    ax.autoscale_view()
    return artists


def _outline(part: ConvexSet) -> Floats:
    """Vertices, or support points in many directions where the set is curved."""
    if part.form.is_polytopal:
        return part.hull_points()
    directions = spread_directions(part.n, 180 if part.n == 2 else 600)
    return np.array([part.support_point(d) for d in directions])


def _draw_2d(part: ConvexSet, ax: Any, style: dict[str, Any]) -> Artist:
    points = _outline(part)
    dimension = part.affine_dimension()
    if dimension == 2:
        return ax.fill(*points[ConvexHull(points).vertices].T, **style)[0]  # type: ignore[no-any-return]
    return ax.plot(*points.T, **_line_style(style, dimension))[0]  # type: ignore[no-any-return]


def _draw_3d(part: ConvexSet, ax: Any, style: dict[str, Any]) -> Artist:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    points = _outline(part)
    hull = part.affine_hull()
    if len(hull.basis) < 2:
        return ax.plot(*points.T, **_line_style(style, len(hull.basis)))[0]  # type: ignore[no-any-return]
    if len(hull.basis) == 2:
        flat = ConvexHull((points - hull.point) @ hull.basis.T)
        polygons = [points[flat.vertices]]
    else:
        polygons = [_facet(points, facet) for facet in _coplanar(ConvexHull(points))]
    lo, hi = points.min(axis=0), points.max(axis=0)
    ax.auto_scale_xyz(*np.array([lo, hi]).T)
    # add_collection3d would, up to matplotlib 3.11, also scale to memory that it pads facets with.
    return ax.add_collection(Poly3DCollection(polygons, **style), autolim=False)  # type: ignore[no-any-return]


def _line_style(style: dict[str, Any], dimension: int) -> dict[str, Any]:
    """What of a polygon's style a segment or a point can wear."""
    kept = {"color", "alpha", "label", "linewidth", "lw", "linestyle", "ls", "zorder"}
    line = {name: value for name, value in style.items() if name in kept}
    fill = style.get("facecolor", style.get("fc"))
    line |= {"color": fill} if fill is not None else {}
    return line | ({"marker": "o"} if dimension == 0 else {})


def _coplanar(hull: ConvexHull) -> list[Ints]:
    """Vertex indices of each facet, its triangles taken together."""
    _, groups = np.unique(np.round(hull.equations, 8), axis=0, return_inverse=True)
    groups = groups.ravel()
    return [
        np.unique(hull.simplices[groups == k]).astype(np.int64) for k in range(groups.max() + 1)
    ]


def _facet(points: Floats, facet: Ints) -> Floats:
    """Corners of a planar facet in order."""
    corners = points[facet]
    offset = corners - corners.mean(axis=0)
    axes = np.linalg.svd(offset)[2][:2]
    flat = offset @ axes.T
    return np.asarray(corners[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))])
