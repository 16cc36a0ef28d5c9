"""The smallest upright cylinder with rounded rims around a body that yaws freely and tilts.

Turned about every axis that the limit allows, a point at distance R from the centre and at angle
alpha from the body's z axis reaches, in a direction at angle beta from the vertical,

    h(beta) = max over |beta' - beta| <= tilt of R cos(beta' - alpha)
            = R cos(max(0, |beta - alpha| - tilt)),

which is the support function of what it sweeps. The body's is the maximum over its points.
"""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.scene.shapes import Cylinder

_ANGLES = 7200
"""Directions at which the cylinder is compared with what the body sweeps."""


def upright_cylinder(points: Floats, radii: Floats, max_tilt: float) -> tuple[Cylinder, float]:
    """A cylinder and a ball whose Minkowski sum holds balls about points of a turning body.

    Args:
        points: centres of the balls in the body's frame, shape (k, 3) [m].
        radii: of the balls, shape (k,) [m].
        max_tilt: largest angle between the body's z axis and the vertical [rad].
    """
    across = np.linalg.norm(points[:, :2], axis=1)
    alpha, distance = np.arctan2(across, points[:, 2]), np.hypot(across, points[:, 2])
    beta = np.linspace(0.0, np.pi, _ANGLES + 1)
    reach = np.full(beta.size, -np.inf)
    for a, r, ball in zip(alpha.tolist(), distance.tolist(), radii.tolist(), strict=True):
        turned = np.maximum(np.abs(beta - a) - max_tilt, 0.0)
        reach = np.maximum(reach, r * np.cos(turned) + ball)
    # Between two directions half a step away, either side changes by less than its size times that.
    half_step = 0.5 * np.pi / _ANGLES
    slack = half_step * 3.0 * float((distance + radii).max())
    radius = float(reach[_ANGLES // 2]) + slack
    middle, half = 0.5 * float(reach[0] - reach[-1]), 0.5 * float(reach[0] + reach[-1]) + slack
    sharp = radius * np.sin(beta) + half * np.abs(np.cos(beta)) + middle * np.cos(beta)
    spare, rim = sharp - reach - slack, np.sin(beta) + np.abs(np.cos(beta)) - 1.0
    rounded = rim > 1e-9
    rounding = float((spare[rounded] / rim[rounded]).min(initial=min(radius, half)))
    rounding = min(max(rounding, 0.0), radius, half)
    core = Cylinder(
        np.array([0.0, 0.0, middle]), np.array([0.0, 0.0, 1.0]), radius - rounding, half - rounding
    )
    return core, rounding
