"""The tracking tube: how far a body leaves its reference, measured in test flights.

A clearance is chosen for an error that is only known after the flight. Flights with the same body,
limits and disturbance along random courses, among no obstacles, tell it before.
"""

from __future__ import annotations

import copy
import math
from dataclasses import replace

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope
from hzmp_sim.scene import Scene
from hzmp_sim.settings import RunSettings
from hzmp_sim.simulation.actuation import actuation_for
from hzmp_sim.simulation.guide import FixedGuide
from hzmp_sim.simulation.loop import fly
from hzmp_tracking import time_parameterize

_FLIGHTS = 10
_LEGS = 8
_LONGEST = 4.0  # [m] of a leg on each axis
_BESIDE = 0.2  # [m] that the cells of a course are wider than its legs
_MARGIN = 1.5  # of 1,000 flights in gusts some err by 1.5 times the largest of ten
_STEP = 1e-3  # clearances are rounded up to whole steps [m]

_DEFAULTS = RunSettings()


def tracking_tube(scene: Scene, settings: RunSettings = _DEFAULTS) -> float:
    """Largest distance of the body to its reference in test flights [m].

    The flights begin where the scene does and stay within its bounds; nothing is hit there.

    Args:
        scene: the body, and where it may go.
        settings: limits, disturbance and seed.

    Raises:
        SceneError: the body has joints or actuators that no controller here can use.
    """
    model = copy.copy(scene.model)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    empty = replace(scene, model=model)
    actuation = actuation_for(scene.model, scene.body, scene.shape.max_tilt)
    limits = settings.limits(actuation.default_limits)
    worst = 0.0
    for number in range(_FLIGHTS):
        waypoints, cells = _course(scene, np.random.default_rng([settings.seed, number]))
        trajectory = time_parameterize(waypoints, cells, limits)
        seeded = replace(settings, seed=settings.seed + number)
        guide = FixedGuide(scene, trajectory, settings, actuation.smoothing)
        flight = fly(empty, guide, actuation, seeded, lambda _: None)
        worst = max(worst, float(flight.log.tracking_error.max()))
    return worst


def clearance_for(tube: float) -> float:
    """A clearance that covers a tracking tube, with half as much again as margin [m]."""
    return _STEP * math.ceil(_MARGIN * tube / _STEP)


def _course(scene: Scene, rng: np.random.Generator) -> tuple[Floats, list[Polytope]]:
    """Random waypoints from the start, and a box around each leg."""
    low, high = scene.bounds
    points = [scene.start]
    for _ in range(_LEGS):
        move = rng.uniform(-_LONGEST, _LONGEST, scene.n)
        # What would leave the bounds is turned back.
        beyond = (points[-1] + move < low) | (points[-1] + move > high)
        points.append(np.clip(points[-1] + np.where(beyond, -move, move), low, high))
    waypoints = np.array(points)
    first, last = waypoints[:-1], waypoints[1:]
    lows = np.maximum(np.minimum(first, last) - _BESIDE, low - _BESIDE)
    highs = np.minimum(np.maximum(first, last) + _BESIDE, high + _BESIDE)
    return waypoints, [Polytope.from_box(a, b) for a, b in zip(lows, highs, strict=True)]
