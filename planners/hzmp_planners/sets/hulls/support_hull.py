"""Vertices of a convex set from nothing but its support function."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull

from hzmp_planners._arrays import Floats
from hzmp_planners.constants import SET_TOL

if TYPE_CHECKING:
    from hzmp_planners.sets.base import Set


def support_hull(body: Set) -> Floats:
    """Points of a polytopal set whose convex hull it is, shape (k, n) [m]; (0, n) when empty.

    The hull of known points is a lower approximation. Each of its facets either supports the set,
    which proves it, or its support point is new. When every facet is proved the hull is the set;
    each facet ever tried costs one support evaluation.
    """
    if body.is_empty():
        return np.zeros((0, body.n))
    origin, basis, _, points = body.affine_hull()
    if len(basis) <= 1:
        return points
    # Each axis of the hull in units of its own extent: qhull's tolerances are absolute.
    extent = np.ptp((points - origin) @ basis.T, axis=0)
    proved: set[tuple[float, ...]] = set()
    while True:
        hull = ConvexHull((points - origin) @ basis.T / extent)
        points = points[hull.vertices]
        fresh: list[Floats] = []
        for equation in np.unique(np.round(hull.equations, 10), axis=0):
            key = tuple(equation.tolist())
            if key in proved:
                continue
            candidate = body.support_point((equation[:-1] / extent) @ basis)
            height = ((candidate - origin) @ basis.T / extent) @ equation[:-1] + equation[-1]
            if height > SET_TOL and not (candidate == points).all(axis=1).any():
                fresh.append(candidate)
            else:
                proved.add(key)
        if not fresh:
            return points
        points = np.unique(np.vstack([points, fresh]), axis=0)
