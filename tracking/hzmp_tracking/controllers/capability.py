"""What the rotors of a body can give, from mass, inertia, allocation and thrust limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import as_floats, as_point
from hzmp_tracking.flatness import RotorLimits

REFERENCE_SHARE = 0.8
"""Of what rotors have, what a reference may use: the rest is for feedback."""


def rotor_limits(
    mass: float,
    inertia: ArrayLike,
    allocation: ArrayLike,
    thrust_limits: tuple[ArrayLike, ArrayLike],
    gravity: ArrayLike,
    max_tilt: float,
    window: float,
) -> RotorLimits:
    """Thrust, tilt and body rate that a reference may ask for.

    The body rate is bounded by torque: where the jerk of a trajectory is turned around, its
    direction of thrust turns back, within the window over which the reference is smoothed. That
    takes the angular acceleration 2 rate / window, about any horizontal axis, and the rotors must
    have the torque for it even at the least and the most that references within `REFERENCE_SHARE`
    let them carry. Rotor k gives w_k . alpha for the angular acceleration alpha, so that
    alpha <= min over k of room_k / |w_k|.

    Args:
        mass: [kg].
        inertia: about the centre of mass, shape (3, 3) [kg m^2].
        allocation: shape (4, 4), see `Mixer`; of full rank.
        thrust_limits: (low, high) of the rotors [N], each (4,).
        gravity: shape (3,) [m/s^2].
        max_tilt: largest tilt of the body [rad].
        window: over which the reference is smoothed [s].

    Raises:
        ShapeError: a shape, or an entry that is not finite.
        QueryError: the body cannot hover.
    """
    J, matrix = as_floats(inertia, "inertia", 2), as_floats(allocation, "allocation", 2)
    low, high = (as_floats(limit, "thrust_limits", 1) for limit in thrust_limits)
    fall = float(np.linalg.norm(as_point(gravity, "gravity", 3)))
    least, most = (float(matrix[0] @ limit) / mass for limit in (low, high))
    inverse = np.linalg.inv(matrix)
    thrusts_only = RotorLimits(max(least, 0.0), most, max_tilt, body_rate=1.0, gravity=gravity)
    a = thrusts_only.scaled(REFERENCE_SHARE).acceleration
    thrusts = np.outer([fall - a, fall + a], mass * inverse[:, 0])
    room = np.minimum(thrusts - low, high - thrusts).min(axis=0)
    turning = np.linalg.norm(inverse[:, 1:3] @ J[:2, :2], axis=1)
    return replace(thrusts_only, body_rate=0.5 * window * float((room / turning).min()))
