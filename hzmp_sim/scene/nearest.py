"""Nearest points of segments and triangles."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats


def nearest_on_segments(points: Floats, start: Floats, end: Floats) -> Floats:
    """Nearest point on each of f segments for each of k points; shape (k, f, n)."""
    along = end - start
    square = np.maximum((along**2).sum(axis=1), 1e-300)
    t = ((points[:, None, :] - start) * along).sum(axis=2) / square
    return np.asarray(start + np.clip(t, 0.0, 1.0)[..., None] * along)


def nearest_on_triangles(points: Floats, corners: Floats) -> Floats:
    """Nearest point on each of f triangles (f, 3, 3) for each of k points; shape (k, f, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v = b - a, c - a
    uu, uv, vv = (u * u).sum(axis=1), (u * v).sum(axis=1), (v * v).sum(axis=1)
    det = np.maximum(uu * vv - uv**2, 1e-300)
    offset = points[:, None, :] - a
    pu, pv = (offset * u).sum(axis=2), (offset * v).sum(axis=2)
    s, t = (vv * pu - uv * pv) / det, (uu * pv - uv * pu) / det
    best = a + s[..., None] * u + t[..., None] * v
    over = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0)
    distance = np.where(over, np.linalg.norm(best - points[:, None, :], axis=2), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        foot = nearest_on_segments(points, start, end)
        length = np.linalg.norm(foot - points[:, None, :], axis=2)
        closer = length < distance
        best = np.where(closer[..., None], foot, best)
        distance = np.where(closer, length, distance)
    return np.asarray(best)
