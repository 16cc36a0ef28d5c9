"""Convex polygons given by their corners in order."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats


def clip_polygon(corners: Floats, height: Floats) -> Floats:
    """The part of a segment or convex polygon where height <= 0 (Sutherland and Hodgman 1974).

    Args:
        corners: shape (k, n); two are the ends of a segment.
        height: values of an affine function at the corners, shape (k,).

    Returns:
        Corners in order, shape (m, n); (0, n) when nothing is left.
    """
    kept: list[Floats] = []
    for i in range(len(corners)):
        if len(corners) > 2 or i > 0:
            h, g = height[i - 1], height[i]
            if (h < 0.0 < g) or (g < 0.0 < h):
                kept.append(corners[i - 1] + (h / (h - g)) * (corners[i] - corners[i - 1]))
        if height[i] <= 0.0:
            kept.append(corners[i])
    return np.array(kept).reshape(-1, corners.shape[1])
