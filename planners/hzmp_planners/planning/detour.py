"""Shortest detours s -> face -> g in closed form: the informed set without an ellipsoid test.

f*(F) = min over x in F of |x - s| + |x - g| does not depend on the incumbent cost c. A face meets
the informed ellipsotope of cost c iff f*(F) <= c (Lemma 3.6 of the HZ-MP paper), so one evaluation
per query classifies every face for every later cost by a comparison.
"""

from __future__ import annotations

import math

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._links import component_labels


def least_detour(corners: Floats, s: Floats, g: Floats) -> tuple[Floats, Floats]:
    """f* and where it is attained, for many segments or convex polygons (3-D) at once.

    The minimum of the convex function |x - s| + |x - g| over a plane is where the mirror image of
    s sees g; if that point is outside the polygon the minimum is on an edge, and over a line it is
    where s, turned about the line to the far side of g, sees g.

    Args:
        corners: shape (F, k, n) [m]: the ends of segments (k = 2), or polygons in order, padded by
            repeating the last vertex.
        s: start points, shape (n,) or (F, n) [m].
        g: goal points, shape (n,) or (F, n) [m].

    Returns:
        f* (F,) [m] and the minimising points (F, n) [m].
    """
    count, k, n = corners.shape
    start = np.broadcast_to(s, (count, n))[:, None]
    goal = np.broadcast_to(g, (count, n))[:, None]
    flat = k == 2
    origins = corners[:, :1] if flat else corners
    edge = corners[:, 1:] - origins if flat else corners[:, _following(k)] - origins
    length = _norm(edge)
    direction = edge / np.where(length > 0.0, length, 1.0)[..., None]
    s_along, s_off = _along_and_off(start - origins, direction)
    g_along, g_off = _along_and_off(goal - origins, direction)
    reach = s_off + g_off
    along = np.where(
        reach > 0.0,
        (s_along * g_off + g_along * s_off) / np.where(reach > 0.0, reach, 1.0),
        s_along,
    )
    points = origins + np.minimum(np.maximum(along, 0.0), length)[..., None] * direction
    detours = _norm(points - start) + _norm(points - goal)
    best = detours.argmin(axis=1)
    rows = np.arange(count)
    least, where = detours[rows, best], points[rows, best]
    if not flat and count:
        crossing, inside = _plane_crossing(corners, edge, start[:, 0], goal[:, 0])
        through = _norm(crossing - start[:, 0]) + _norm(crossing - goal[:, 0])
        better = inside & (through < least)
        least = np.where(better, through, least)
        where = np.where(better[:, None], crossing, where)
    return least, where


def _plane_crossing(corners: Floats, edge: Floats, s: Floats, g: Floats) -> tuple[Floats, Bools]:
    """Where the mirrored s sees g through each polygon's plane, and whether inside the polygon."""
    base = corners[:, 0]
    spokes = corners - base[:, None]
    area = _cross(spokes, spokes[:, _following(corners.shape[1])]).sum(axis=1)
    normal = area / np.maximum(_norm(area), 1e-300)[:, None]
    s_height, g_height = _dot(s - base, normal), _dot(g - base, normal)
    reach = np.abs(s_height) + np.abs(g_height)
    share = np.where(reach > 0.0, np.abs(s_height) / np.where(reach > 0.0, reach, 1.0), 0.0)
    s_foot, g_foot = s - s_height[:, None] * normal, g - g_height[:, None] * normal
    crossing = s_foot + share[:, None] * (g_foot - s_foot)
    # The area vector orients the polygon, so inside is on the left of every edge.
    turn = _dot(_cross(normal[:, None], edge), crossing[:, None] - corners)
    return crossing, np.asarray((turn >= 0.0).all(axis=1))


def _along_and_off(offset: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """Length of vectors along unit vectors, and of what is left of them."""
    along = _dot(offset, direction)
    return along, _norm(offset - along[..., None] * direction)


def _following(k: int) -> Ints:
    """Number of the corner that comes after each."""
    return np.arange(1, k + 1) % k


# For vectors of three entries numpy's own sums and cross products take several times as long, and
# einsum adds in an order that depends on the processor: the same faces would not give the same
# bits on every machine.
def _dot(a: Floats, b: Floats) -> Floats:
    products = a * b
    total = products[..., 0] + products[..., 1]
    return total if products.shape[-1] == 2 else total + products[..., 2]


def _norm(a: Floats) -> Floats:
    return np.asarray(np.sqrt(_dot(a, a)))


def _cross(a: Floats, b: Floats) -> Floats:
    ahead, back = [1, 2, 0], [2, 0, 1]
    return np.asarray(a[..., ahead] * b[..., back] - a[..., back] * b[..., ahead])


def bottleneck_bound(detours: Floats, ends: Ints, leaves: int, s: Ints, g: Ints) -> float:
    """Least cost c at which the faces with f* <= c connect a start leaf with a goal leaf.

    Every path crosses some face that no cheaper set of faces can do without, and a path through
    a face F is at least f*(F) long: a valid lower bound before any search.

    Args:
        detours: f* of each face, shape (F,).
        ends: leaves on both sides of each face, shape (F, 2).
        leaves: number of leaves.
        s: indices of the leaves that hold the start.
        g: indices of the leaves that hold the goal.

    Returns:
        The bound [m]; inf when all faces together do not connect.
    """
    order = np.argsort(detours, kind="stable")
    joined = np.concatenate(
        [
            np.column_stack([np.full(len(s), leaves), s]),
            np.column_stack([np.full(len(g), leaves + 1), g]),
        ]
    )

    def connects(count: int) -> bool:
        labels = component_labels(np.concatenate([joined, ends[order[:count]]]), leaves + 2)
        return bool(labels[leaves] == labels[leaves + 1])

    if connects(0):
        return 0.0
    if not connects(len(order)):
        return math.inf
    low, high = 0, len(order)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if connects(middle) else (middle, high)
    return float(detours[order[high - 1]])
