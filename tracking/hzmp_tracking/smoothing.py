r"""References with a continuous jerk, for bodies that have to turn before they can push.

The jerk of a cubic spline jumps, and with it the body rate that a quadrotor needs: no torque does
that. The mean over a window of width w around each instant has the derivatives

    v = (x(t + w/2) - x(t - w/2)) / w,   and so on for acceleration, jerk and snap,

exactly, and is off the trajectory by w^2 / 24 times the acceleration at most (less than 1 mm for
4 m/s^2 and 60 ms). The window reaches ahead, which a known trajectory allows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_tracking.trajectory import Sample, Trajectory


class SmoothSample(NamedTuple):
    """A reference at k instants, each array of shape (k, n)."""

    position: Floats
    """Of the trajectory itself [m]."""
    velocity: Floats
    """[m/s]"""
    acceleration: Floats
    """[m/s^2]"""
    jerk: Floats
    """[m/s^3]"""
    snap: Floats
    """[m/s^4]; 0 where the jerk is not smoothed."""


def smooth_sample(trajectory: Trajectory, times: Floats, width: float) -> SmoothSample:
    """A trajectory from rest at `times` of shape (k,) [s], its derivatives as means over a window.

    Args:
        trajectory: starts and ends at rest.
        times: shape (k,) [s].
        width: of the window [s]; 0 for the trajectory as it is.
    """
    now = trajectory.sample(times)
    if width == 0.0:
        return SmoothSample(*now, np.zeros_like(now.jerk))
    after, before = (_resting(trajectory, times + shift) for shift in (0.5 * width, -0.5 * width))
    means = [(b - a) / width for a, b in zip(before, after, strict=True)]
    return SmoothSample(now.position, *means)


def _resting(trajectory: Trajectory, times: Floats) -> Sample:
    """At rest before the start, too: the jerk begins with the trajectory."""
    sample = trajectory.sample(times)
    return sample._replace(jerk=np.where(times[:, None] < 0.0, 0.0, sample.jerk))
