"""The Minkowski sum of a shape and a mirrored one, by their support functions and nearest points.

    h(d) = h_A(d) + h_B(-d)   for A ⊕ (-B) = {a - b}.

The nearest point of the sum to x minimises |x - a + b|. Minimising over a and b in turn, by the
nearest points of A to x + b and of B to a - x, are alternating projections between A and B + x:
they converge to a closest pair (Cheney and Goldstein 1959). Stopped early, they give a point of the
sum all the same, so a distance is never too small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.scene.constants import MAX_SUM_PROJECTIONS, SUM_TOL
from hzmp_sim.scene.directions import prism_normals
from hzmp_sim.scene.shapes import Box, Capsule, Cylinder, Hull, Shape


@dataclass(frozen=True, eq=False)
class Difference:
    """{a - b : a in `shape`, b in `core`}: where a body's centre puts its core onto a shape."""

    shape: Shape
    core: Shape
    precision: float = SUM_TOL
    """A nearest point is found when its distance is known this well [m]."""

    @property
    def centre(self) -> Floats:
        return np.asarray(self.shape.centre - self.core.centre)

    def support(self, directions: Floats) -> Floats:
        return np.asarray(self.shape.support(directions) + self.core.support(-directions))

    def project(self, points: Floats) -> Floats:
        found = np.empty_like(points)
        rest, inner = np.arange(len(points)), np.broadcast_to(self.core.centre, points.shape)
        for _ in range(MAX_SUM_PROJECTIONS):
            asked = points[rest]
            outer = self.shape.project(asked + inner)
            inner = self.core.project(outer - asked)
            found[rest] = outer - inner
            # A supporting half-space on the way bounds the distance from below.
            away = asked - found[rest]
            distance = np.maximum(np.linalg.norm(away, axis=1), self.precision)
            least = ((away * asked).sum(axis=1) - self.support(away)) / distance
            far = distance > least + self.precision
            rest, inner = rest[far], inner[far]
            if not rest.size:
                break
        return found

    def normals(self, grow: float, tolerance: float) -> Floats:
        """Those of the shape, which enclose the sum, and the facets of the core."""
        normals = np.vstack([self.shape.normals(grow, tolerance), -_facets(self.core)])
        alike = np.tril(normals @ normals.T, -1) > 1.0 - 1e-9
        return np.asarray(normals[~alike.any(axis=1)])


def _facets(core: Shape) -> Floats:
    """Normals (m, n) of the few facets of a core that an outer polytope is begun with.

    A core with many is known by its width along the axes: cuts add what the tolerance asks for.
    """
    n = core.centre.size
    if isinstance(core, Box) or (isinstance(core, Hull) and len(core.equations) <= 2 * n):
        return core.normals(0.0, 0.0)
    if isinstance(core, Cylinder):
        return np.vstack([core.axis, -core.axis])
    if isinstance(core, Capsule):
        axis = core.ends[1] - core.ends[0]
        if n == 3 or not axis.any():
            return np.zeros((0, n))
        return prism_normals(axis / np.linalg.norm(axis), 0.0, 0.0)
    return np.vstack([np.eye(n), -np.eye(n)])
