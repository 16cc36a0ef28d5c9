"""Where paths may end: points, and the boundary of goal regions, in parts that lie in one leaf."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners._polygons import (
    clip_polygon,
    counter_clockwise,
    counter_clockwise_rows,
    facet_corners,
    measure,
)
from hzmp_planners.constants import MEMBERSHIP_TOL
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from hzmp_planners.sets.hulls.nearest import nearest_of_hulls


@dataclass(frozen=True, eq=False)
class Target:
    """A point, segment or convex polygon, all of it in one leaf."""

    corners: Floats
    """In order, shape (k, n) [m]."""

    @property
    def centre(self) -> Floats:
        """Mean of the corners, shape (n,) [m]."""
        return np.asarray(self.corners.mean(axis=0))

    def farthest(self, x: Floats) -> float:
        """Distance from a point (n,) to the farthest one of the target [m]."""
        return float(np.linalg.norm(self.corners - x, axis=1).max())

    def nearest(self, x: Floats) -> Floats:
        """The point of the target nearest to a point (n,), shape (n,) [m]."""
        pair = nearest_of_hulls(self.corners, x[None])
        return self.centre if pair is None else pair[0]

    @property
    def measure(self) -> float:
        """Length or area [m or m^2]; 1 of what has none, such as a point."""
        return measure(self.corners) or 1.0

    def halves(self) -> tuple[Target, Target]:
        """The target cut in two across its longest axis."""
        offset = self.corners - self.centre
        _, _, axes = np.linalg.svd(offset, full_matrices=False)
        height = offset @ axes[0]
        return Target(clip_polygon(self.corners, height)), Target(
            clip_polygon(self.corners, -height)
        )


def entrances(space: FreeSpace, region: Polytope) -> list[Target]:
    """The free part of a region's boundary: where a path from outside enters it.

    A flat region is its own boundary.

    Args:
        space: the free space.
        region: convex and bounded; it may reach into obstacles and beyond the workspace.
    """
    low, high = region.interval_hull()
    lows, highs = space.leaf_boxes
    tol = MEMBERSHIP_TOL * space.scale
    near = (lows <= high + tol).all(axis=1) & (highs >= low - tol).all(axis=1)
    facets = _facets(region)
    found: dict[tuple[float, ...], Target] = {}
    for number in np.flatnonzero(near).tolist():
        leaf = space.leaf(number)
        for facet in facets:
            part = facet
            for normal, offset in zip(leaf.A, leaf.b, strict=True):
                height = part @ normal - offset
                part = clip_polygon(part, np.where(np.abs(height) <= tol, 0.0, height))
            if len(part):
                # On a shared face it comes once for each of the two leaves.
                place = tuple(np.round(part.mean(axis=0) / space.scale, 8).tolist())
                found.setdefault((*place, float(len(part))), Target(part))
    return list(found.values())


def _facets(region: Polytope) -> list[Floats]:
    """The facets of a bounded polytope, or a flat one itself, with their corners in order."""
    corners = region.vertices()
    if region.affine_dimension() < region.n:
        return [_in_order(corners)] if len(corners) else []
    if region.n == 2:
        ring = counter_clockwise(corners)
        return list(np.stack([ring, np.roll(ring, -1, axis=0)], axis=1))
    return [corners[rows] for _, rows in facet_corners(corners, region.A, region.incidence)]


def _in_order(corners: Floats) -> Floats:
    """Extreme points (k, n) of a point, segment or polygon."""
    if len(corners) < 3:
        return corners
    offset = corners - corners.mean(axis=0)
    _, _, axes = np.linalg.svd(offset, full_matrices=False)
    return np.asarray(corners[counter_clockwise_rows(offset @ axes[:2].T)])
