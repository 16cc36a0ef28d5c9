"""The convex set that stands for the moving body: a core and a ball, about the body's centre."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope
from hzmp_sim.scene.directions import round_normals
from hzmp_sim.scene.shapes import Box, Shape

ShapeKind = Literal["ball", "hull", "cylinder"]
ShapeChoice = Literal["auto", "ball", "hull", "cylinder"]
"""How to choose it; "auto": whichever keeps most free space, the ball when that is nearly as small.
"""


@dataclass(frozen=True, eq=False)
class BodyShape:
    """core ⊕ ball: holds the body in every orientation that it may take on its way.

    The centre must not be where this set, put there, meets an obstacle: in the Minkowski sum of the
    obstacle and the set mirrored at the centre.
    """

    kind: ShapeKind
    """"ball": whatever the orientation; "hull": in the orientation that the body keeps; "cylinder":
    upright, with rounded rims, at any yaw and any tilt up to `max_tilt`."""
    core: Shape
    """Relative to the centre, in 2-D for a planar body."""
    radius: float
    """Of the ball (disc in 2-D) that is added to the core [m]."""
    excess: float = 0.0
    """How far a hull reaches beyond that of the body [m]: curved geoms among several."""
    max_tilt: float | None = None
    """Largest angle between the vertical and the body's z axis that a cylinder is for [rad]."""

    def support(self, directions: Floats) -> Floats:
        """h(d) = max of d.x over the set for directions (k, n); shape (k,) [m]."""
        lengths = np.linalg.norm(directions, axis=1)
        return np.asarray(self.core.support(directions) + self.radius * lengths)

    @property
    def extent(self) -> tuple[Floats, Floats]:
        """Corners (lo, hi) of the box around it, each (n,) [m], relative to the centre."""
        axes = np.eye(self.core.centre.size)
        return -self.support(-axes), self.support(axes)

    @property
    def volume(self) -> float:
        """Of a polytope around it [m^n]: to compare shapes with, not their exact volume."""
        normals = round_normals(self.core.centre.size)
        return Polytope.from_halfspaces(normals, self.support(normals)).volume()

    def mitre_radius(self, clearance: float) -> float:
        """Radius of the ball whose box stands out of it as far as that of this shape [m].

        Both with the clearance: the corners of the box around a ball of radius r stand out by
        (sqrt(n) - 1) r, and an axis-aligned obstacle that keeps its facets by as much.
        """
        low, high = self.extent
        half = 0.5 * (high - low) + clearance
        corners = Box(0.5 * (low + high), np.eye(low.size), half).corners
        distance = np.linalg.norm(corners - self.core.project(corners), axis=1)
        excess = float(distance.max()) - self.radius - clearance
        return excess / (math.sqrt(low.size) - 1.0)

    def describe(self) -> str:
        """It in words, to follow "the body is"."""
        low, high = self.extent
        size = " x ".join(f"{value:.3g}" for value in high - low)
        if self.kind == "hull":
            return f"its convex hull as it stands, {size} m"
        if self.max_tilt is None:
            return (
                f"a {'disc' if low.size == 2 else 'ball'} of {self.radius:.3g} m about its centre"
            )
        return (
            f"an upright cylinder of radius {high[0]:.3g} m and {high[2] - low[2]:.3g} m high, "
            f"which holds it at any yaw and any tilt up to {self.max_tilt:.3g} rad "
            f"({math.degrees(self.max_tilt):.0f} deg)"
        )

    def growth(self, clearance: float) -> str:
        """What obstacles are grown by, in words."""
        if self.kind == "ball":
            return f"body radius + clearance = {self.radius + clearance:.3g} m"
        return f"the body's {self.kind} and the clearance of {clearance:.3g} m"

    def as_dict(self) -> dict[str, Any]:
        """What it is, as JSON-ready values."""
        low, high = self.extent
        return {
            "kind": self.kind,
            "lowest_m": low.tolist(),
            "highest_m": high.tolist(),
            "rounding_m": self.radius,
            "excess_m": self.excess,
            "max_tilt_rad": self.max_tilt,
        }
