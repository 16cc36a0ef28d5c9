"""Finding shared faces: facets of leaves on the two sides of one plane, where they overlap."""

from __future__ import annotations

from typing import Literal

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints, frozen
from hzmp_planners._ragged import (
    counts_of,
    distinct,
    extents,
    owners_of,
    reduced,
    runs_of,
    spans,
    starts_of,
)
from hzmp_planners.constants import FACE_TOL
from hzmp_planners.free_space.cells import clip
from hzmp_planners.free_space.complexes import Complex
from hzmp_planners.free_space.leaf_graph import LeafGraph
from hzmp_planners.free_space.outlines import outlines
from hzmp_planners.free_space.planes import PlaneTable
from hzmp_planners.free_space.polygons import Polygons
from hzmp_planners.free_space.rectangles import are_rectangles, common_rectangles


def build_leaf_graph(
    whole: Complex, table: PlaneTable, scale: float, fresh: Bools | None = None
) -> LeafGraph:
    """Overlay the facets that leaves have on each plane, those below against those above.

    Args:
        whole: leaves with disjoint interiors.
        table: the planes of their facets.
        scale: unit of the tolerances [m].
        fresh: only faces of these leaves are looked for, shape (N,); all when not given.
    """
    tol = FACE_TOL * scale
    owner, codes = whole.facet_owner, whole.facets
    opposed = _opposed(codes, None if fresh is None else fresh[owner], len(table.offsets))
    rows, planes = opposed.nonzero()[0], codes >> 1
    plane, owner, is_below = planes[rows], owner[rows], (codes[rows] & 1).astype(np.bool_)
    polygons = outlines(whole, table.normals[planes], rows)
    dropped = np.abs(table.normals[plane]).argmax(axis=1)
    below, above = _candidates(polygons, plane, is_below, dropped, tol)
    if fresh is not None:
        wanted = fresh[owner[below]] | fresh[owner[above]]
        below, above = below[wanted], above[wanted]
    normals, offsets = table.normals[plane[below]], table.offsets[plane[below]]
    if whole.n == 2:
        corners, starts, found = _common_segments(polygons, below, above, 1 - dropped[below])
        kept = found & wide(corners, starts, normals, tol)
    else:
        # Counter-clockwise in the chart (y, z), (x, z) or (x, y) is about +n, -n or +n.
        facing = table.normals[plane]
        turn = np.where(dropped == 1, -1.0, 1.0) * np.sign(facing[np.arange(len(plane)), dropped])
        charts = dropped, facing * turn[:, None]
        corners, starts, kept = _common_outlines(polygons, below, above, *charts, tol)
    rows = kept.nonzero()[0]
    sizes = counts_of(starts)[rows]
    ends = np.column_stack([owner[below], owner[above]])
    return LeafGraph.from_lists(
        len(whole),
        ends[rows],
        corners[spans(starts[rows], sizes)],
        starts_of(sizes),
        normals[rows],
        offsets[rows],
    )


def _opposed(codes: Ints, fresh: Bools | None, planes: int) -> Bools:
    """Which facets have another on the other side of their plane, one of the two fresh."""
    known = np.zeros(2 * planes, dtype=np.bool_)
    known[codes] = True
    opposed = known[codes ^ 1]
    if fresh is not None:
        known[:] = False
        known[codes[fresh]] = True
        opposed &= fresh | known[codes ^ 1]
    return np.asarray(opposed)


def _candidates(
    polygons: Polygons, plane: Ints, is_below: Bools, dropped: Ints, tol: float
) -> tuple[Ints, Ints]:
    """Facets below and above one plane whose bounds overlap in its chart by more than `tol`.

    Of two intervals that overlap, the one that starts later starts inside the other.
    """
    if not len(polygons):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    low, high = polygons.bounds
    start, stop = _intervals(low, high, plane, tol)
    lower, upper = (
        side[start[side].argsort()] for side in (is_below.nonzero()[0], (~is_below).nonzero()[0])
    )
    first_below, later_above = _starting_inside(start, stop, lower, upper, "left")
    first_above, later_below = _starting_inside(start, stop, upper, lower, "right")
    below = np.concatenate([first_below, later_below])
    above = np.concatenate([later_above, first_above])
    overlap = np.minimum(high[below], high[above]) - np.maximum(low[below], low[above])
    overlap[np.arange(len(below)), dropped[below]] = np.inf
    kept = np.all(overlap > tol, axis=1)
    below, above = below[kept], above[kept]
    order = ((plane[below] * len(plane)) + below).argsort(kind="stable")
    return below[order], above[order]


def _intervals(low: Floats, high: Floats, plane: Ints, tol: float) -> tuple[Floats, Floats]:
    """The facets of all planes on one line: where each starts and stops.

    Those of plane p lie in [3 p, 3 p + 1], along the axis of the world on which they are shortest
    for their spread: it separates them best.
    """
    order = plane.argsort(kind="stable")
    runs = runs_of(plane[order])
    group = np.empty_like(plane)
    group[order] = owners_of(runs)
    base = reduced(np.minimum, low[order], runs)
    width = reduced(np.maximum, high[order], runs) - base
    total = reduced(np.add, (high - low)[order], runs)
    crowding = np.where(width > tol, total / np.maximum(width, tol), np.inf)
    axis = crowding.argmin(axis=1)[group]
    rows = np.arange(len(plane))
    shift, unit = base[group, axis], np.maximum(width[group, axis], tol)
    return (
        3.0 * group + (low[rows, axis] - shift) / unit,
        3.0 * group + (high[rows, axis] - shift) / unit,
    )


def _starting_inside(
    start: Floats, stop: Floats, outer: Ints, inner: Ints, side: Literal["left", "right"]
) -> tuple[Ints, Ints]:
    """Pairs of intervals of which the second, one of `inner`, starts inside the first.

    With `side` left it may also start where the first does. Both lists are sorted by start.
    """
    begin = np.searchsorted(start[inner], start[outer], side=side)
    count = np.maximum(np.searchsorted(start[inner], stop[outer]) - begin, 0)
    return outer.repeat(count), inner[spans(begin, count)]


def _common_segments(
    polygons: Polygons, one: Ints, two: Ints, axis: Ints
) -> tuple[Floats, Ints, Bools]:
    """Overlaps of pairs of segments on one line, both ascending along an axis."""
    ends = polygons.vertices.reshape(-1, 2, 2)
    rows = np.arange(len(one))
    a, b = ends[one], ends[two]
    later = a[rows, 0, axis] >= b[rows, 0, axis]
    sooner = a[rows, 1, axis] <= b[rows, 1, axis]
    start = np.where(later[:, None], a[:, 0], b[:, 0])
    stop = np.where(sooner[:, None], a[:, 1], b[:, 1])
    found = start[rows, axis] < stop[rows, axis]
    corners = np.stack([start, stop], axis=1).reshape(-1, 2)
    return corners, 2 * np.arange(len(one) + 1), found


def _common_outlines(
    polygons: Polygons, one: Ints, two: Ints, dropped: Ints, normals: Floats, tol: float
) -> tuple[Floats, Ints, Bools]:
    """Overlaps of pairs of polygons on one plane that their bounds do not exclude.

    Args:
        polygons: counter-clockwise about their normals.
        one: a polygon of each pair.
        two: the other.
        dropped: the axis that each polygon's normal is nearest to, shape (m,).
        normals: of each polygon, shape (m, 3).
        tol: overlaps narrower than this are none [m].

    Returns:
        Corners end to end, where each pair's begin, and which pairs have any.
    """
    flat = are_rectangles(polygons, dropped, 1e-4 * tol)
    plain = flat[one] & flat[two]
    quick, slow = plain.nonzero()[0], (~plain).nonzero()[0]
    corners, parts, found = _common_polygons(polygons, one[slow], two[slow], normals, 1e-4 * tol)
    found &= wide(corners, parts, normals[one[slow]], tol)
    kept = plain.copy()
    kept[slow] = found
    sizes = np.full(len(one), 4)
    sizes[slow] = counts_of(parts)
    starts = starts_of(sizes)
    both = np.empty((int(starts[-1]), 3))
    both[spans(starts[slow], sizes[slow])] = corners
    rectangles = common_rectangles(polygons, one[quick], two[quick], dropped[one[quick]])
    both[spans(starts[quick], sizes[quick])] = rectangles.reshape(-1, 3)
    return both, starts, kept


def _common_polygons(
    polygons: Polygons, one: Ints, two: Ints, normals: Floats, tol: float
) -> tuple[Floats, Ints, Bools]:
    """Overlaps of pairs of polygons on one plane: the first clipped by the second's sides.

    Args:
        polygons: counter-clockwise about their normals.
        one: a polygon of each pair.
        two: the other.
        normals: of each polygon, shape (m, 3).
        tol: of the clipping [m].
    """
    count, others = len(one), polygons.take(two)
    A, b = _sides(others, normals[two])
    rows = np.flatnonzero(A.any(axis=1))
    lists = starts_of(np.bincount(others.vertex_owner[rows], minlength=count))
    faces, kept = clip(polygons.take(one), A[rows], b[rows], rows, lists, tol)
    found = np.zeros(count, dtype=np.bool_)
    found[kept] = True
    sizes = np.zeros(count, dtype=np.int64)
    sizes[kept] = counts_of(faces.vertex_starts)
    return faces.vertices, starts_of(sizes), found


def _sides(polygons: Polygons, normals: Floats) -> tuple[Floats, Floats]:
    """The half-spaces A x <= b of the sides of polygons, corners counter-clockwise about normals.

    A side without length has zeros instead of a unit normal.

    Args:
        polygons: in space.
        normals: of each polygon's plane, shape (m, 3).
    """
    edge = polygons.vertices.take(polygons.following, axis=0) - polygons.vertices
    outward = _cross(edge, normals.take(polygons.vertex_owner, axis=0))
    length = np.sqrt(np.einsum("ij,ij->i", outward, outward))
    outward /= np.where(length > 0.0, length, 1.0)[:, None]
    return outward, np.einsum("ij,ij->i", outward, polygons.vertices)


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products of rows; np.cross is several times slower."""
    x, y, z = a.T
    u, v, w = b.T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=1)


def wide(corners: Floats, starts: Ints, normals: Floats, tol: float) -> Bools:
    """Which faces have room: their smallest width exceeds the tolerance.

    Args:
        corners: of all faces, end to end.
        starts: where each face's begin, shape (F + 1,).
        normals: of each face's plane, shape (F, n).
        tol: [m].
    """
    sizes = counts_of(starts)
    roomy = sizes >= corners.shape[1]
    if corners.shape[1] == 2:
        ends = corners.reshape(-1, 2, 2)
        return np.asarray(roomy & (np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) > tol))
    rows = roomy.nonzero()[0]
    faces = Polygons.of(corners, starts, np.zeros(len(corners), dtype=np.int64)).take(rows)
    A, b = _sides(faces, normals[rows])
    lowest, highest = extents(faces.vertices, faces.vertex_starts, faces.vertex_owner, A)
    reach = np.maximum(highest - b, b - lowest)  # whichever way the corners turn
    thin = np.zeros(len(rows), dtype=np.bool_)
    thin[faces.vertex_owner[A.any(axis=1) & (reach <= tol)]] = True
    roomy[rows[thin]] = False
    return np.asarray(roomy)


def update_leaf_graph(
    graph: LeafGraph, number: Ints, whole: Complex, table: PlaneTable, scale: float
) -> LeafGraph:
    """The graph after some leaves were cut: faces between kept leaves are taken over.

    Args:
        graph: of the leaves before.
        number: what each of them is called now, -1 for those that were cut.
        whole: the leaves now, the kept ones first.
        table: the planes of their facets.
        scale: unit of the tolerances [m].
    """
    ends = number[graph.ends]
    one, two = ends[:, 0] >= 0, ends[:, 1] >= 0
    kept = (one & two).nonzero()[0]
    beside = distinct(ends[one ^ two].max(axis=1))
    first = int(number.max(initial=-1)) + 1
    nearby = np.concatenate([beside, np.arange(first, len(whole))])
    fresh = build_leaf_graph(whole.take(nearby), table, scale, nearby >= first)
    width = max(graph.corners.shape[1], fresh.corners.shape[1])
    corners = np.empty((len(kept) + len(fresh), width, whole.n))
    for part, rows in (
        (corners[: len(kept)], graph.corners.take(kept, axis=0)),
        (corners[len(kept) :], fresh.corners),
    ):
        size = rows.shape[1]
        part[:, :size], part[:, size:] = rows, rows[:, -1:]
    return LeafGraph(
        len(whole),
        frozen(np.concatenate([ends[kept], nearby[fresh.ends]])),
        frozen(corners),
        frozen(np.concatenate([graph.sizes[kept], fresh.sizes])),
        frozen(np.concatenate([graph.normals[kept], fresh.normals])),
        frozen(np.concatenate([graph.offsets[kept], fresh.offsets])),
    )
