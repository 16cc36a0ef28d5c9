"""One-sided lower bounds of the way from start to goal over a piece, and what pairs lead to."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.planning.detour import least_detour


def detour_bounds(corners: Floats, s: Floats, g: Floats) -> Floats:
    """Tangent-plane lower bounds of min |x - s| + |x - g| over each face or segment, shape (F,).

    The function is convex, so f(x0) + f'(x0).(v - x0) at the vertices v bounds it for any x0.

    Args:
        corners: shape (F, k, n) [m].
        s: start, shape (n,) [m].
        g: goal, shape (n,) [m].
    """
    _, x = least_detour(corners, s, g)
    away_s, away_g = x - s, x - g
    size_s = np.linalg.norm(away_s, axis=1, keepdims=True)
    size_g = np.linalg.norm(away_g, axis=1, keepdims=True)
    slope = away_s / np.maximum(size_s, 1e-300) + away_g / np.maximum(size_g, 1e-300)
    rise = np.einsum("fkn,fn->fk", corners - x[:, None], slope).min(axis=1)
    return np.asarray((size_s + size_g)[:, 0] + rise)


def short_part(ends: Floats, s: Floats, g: Floats, limit: float) -> tuple[float, float] | None:
    """Where |x - s| + |x - g| <= limit on a segment (2, 3), as shares of it; None: nowhere.

    There |x - s| <= (limit^2 + |x - s|^2 - |x - g|^2) / (2 limit), which is linear along the
    segment: a quadratic inequality.
    """
    along = ends[1] - ends[0]
    from_s, from_g = ends[0] - s, ends[0] - g
    level = (limit * limit + from_s @ from_s - from_g @ from_g) / (2.0 * limit)
    slope = along @ (g - s) / limit
    a = along @ along - slope * slope
    b, c = along @ from_s - level * slope, from_s @ from_s - level * level
    if a <= 0.0:  # a point: s and g are less than the limit apart, so other segments are steeper
        return (0.0, 1.0) if c <= 0.0 else None
    room = b * b - a * c
    if room < 0.0:
        return None
    first, last = max(0.0, (-b - room**0.5) / a), min(1.0, (-b + room**0.5) / a)
    return (first, last) if first <= last else None


def reached(pairs: Ints, root: int, nodes: int) -> Bools:
    """Nodes that the directed pairs (E, 2) lead to from the root, shape (nodes,)."""
    seen = np.zeros(nodes, dtype=np.bool_)
    seen[root] = True
    while True:
        fresh = pairs[seen[pairs[:, 0]] & ~seen[pairs[:, 1]], 1]
        if not len(fresh):
            return seen
        seen[fresh] = True
