"""A body on slide joints: PD with feed-forward through motors or servos."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from hzmp_planners.errors import SceneError
from hzmp_sim.simulation.actuation_base import Actuation
from hzmp_sim.simulation.actuators import at_rest
from hzmp_sim.simulation.slide_drive import (
    SlideDrive,
    look_ahead,
    moved_masses,
    passive_law,
    slide_drive,
)
from hzmp_tracking import Limits
from hzmp_tracking.controllers import REFERENCE_SHARE, BodyState, PointController

_AXIS_TOL = 1e-6
_LIMITS = (2.0, 4.0, 30.0)  # [m/s, m/s^2, m/s^3] comfortable for a camera and a report


class SlideActuation(Actuation):
    """A body on slide joints along world axes, each moved by one motor or servo."""

    def __init__(self, model: mujoco.MjModel, body: str) -> None:
        super().__init__(model, body)
        data = at_rest(model)
        masses, loads = [math.inf] * 3, [0.0] * 3
        slides: list[_Slide] = []
        first = int(model.body_jntadr[self._id])
        for joint in range(first, first + int(model.body_jntnum[self._id])):
            direction = data.xaxis[joint]
            axis = int(np.argmax(np.abs(direction)))
            sign = math.copysign(1.0, float(direction[axis]))
            if abs(direction[axis]) < 1.0 - _AXIS_TOL or axis in [slide.axis for slide in slides]:
                raise SceneError(
                    f"slide joint {model.joint(joint).name!r} of body {body!r} points along "
                    f"{direction.tolist()}: each must have a world axis of its own"
                )
            dof = int(model.jnt_dofadr[joint])
            drive = slide_drive(model, body, joint)
            q = float(data.qpos[model.jnt_qposadr[joint]])
            place = float(data.xpos[self._id, axis])
            # What stands still without moving: weight that nothing compensates, springs.
            load = float(data.qfrc_bias[dof] - data.qfrc_passive[dof])
            if model.jnt_actgravcomp[joint]:
                load -= float(data.qfrc_gravcomp[dof])
            loads[axis] = sign * load
            data.ctrl[drive.actuator] = drive.input(load, q, 0.0)
            law = passive_law(model, drive, joint)
            slides.append(_Slide(axis, sign, dof, drive, q, place, *law, look_ahead(model)))
        moved = moved_masses(model, data, [slide.dof for slide in slides])
        for slide, mass in zip(slides, moved, strict=True):
            masses[slide.axis] = mass
        self._slides = tuple(slides)
        self.actuators = tuple(slide.drive.actuator for slide in slides)
        self._loads = tuple(loads)
        # The actuators clip: how much they can give may depend on where and how fast they are.
        self.controller = PointController(masses, [(-math.inf, math.inf)] * 3, loads)
        self.default_limits = _slide_limits(body, slides, masses, loads)

    def state(self, data: mujoco.MjData) -> BodyState:
        velocity = [0.0, 0.0, 0.0]
        for slide in self._slides:
            velocity[slide.axis] = slide.sign * float(data.qvel[slide.dof])
        return BodyState(data.xpos[self._id].tolist(), velocity)

    def _write(self, data: mujoco.MjData, command: tuple[float, ...], state: BodyState) -> None:
        for slide in self._slides:
            axis = slide.axis
            data.ctrl[slide.drive.actuator] = slide.input(
                command[axis], state.position[axis], state.velocity[axis]
            )

    def trim(self, data: mujoco.MjData) -> None:
        self._write(data, self._loads, BodyState(data.xpos[self._id].tolist(), (0.0, 0.0, 0.0)))


class _Slide(NamedTuple):
    """A slide joint along a world axis, with what moves it; places and forces along that axis."""

    axis: int
    sign: float
    """Of the joint's direction along the axis."""
    dof: int
    drive: SlideDrive
    q: float
    """Of the joint [m] where the body is at `place` [m]."""
    place: float
    damping: float
    """[N s/m]"""
    stiffness: float
    """[N/m]"""
    ahead: float
    """From a step's begin to where its actuators act [s]."""

    def input(self, force: float, place: float, speed: float) -> float:
        """The actuator's input for a force [N] beyond damping and spring."""
        v = self.sign * speed
        moved = self.sign * (place - self.place) + self.ahead * v
        resisted = self.damping * v + self.stiffness * moved
        return self.drive.input(self.sign * force + resisted, self.q + moved, v)

    def spare(self, load: float, speed: float) -> float:
        """Force [N] beyond load and damping that there is in both directions, either way along."""
        least = math.inf
        for v in (-speed, 0.0, speed):
            low, high = self.drive.force_range(self.q, v)
            needed = self.sign * load + self.damping * v
            least = min(least, high - needed, needed - low)
        return least


def _slide_limits(
    body: str, slides: Sequence[_Slide], masses: Sequence[float], loads: Sequence[float]
) -> Limits:
    """Limits that leave a share of the actuators' force to the feedback.

    Where damping or a servo's own law takes force at speed, half of what there is at rest must be
    left at the speed limit.
    """
    top, acceleration, jerk = _LIMITS
    velocity, spare = top, math.inf
    for slide in slides:
        load = loads[slide.axis]
        still, fast = slide.spare(load, 0.0), slide.spare(load, top)
        if still <= 0.0:
            low, high = sorted(slide.sign * end for end in slide.drive.force_range(slide.q, 0.0))
            raise SceneError(
                f"the actuators of body {body!r} are too weak: along {'xyz'[slide.axis]} the load "
                f"is {load:.4g} N, and nothing of [{low:.4g}, {high:.4g}] N is left to accelerate"
            )
        if fast < 0.5 * still:  # spare force is concave in the speed: the chord is below it
            velocity = min(velocity, top * 0.5 * still / (still - fast))
            fast = 0.5 * still
        spare = min(spare, fast / masses[slide.axis])
    share = min(1.0, REFERENCE_SHARE * spare / acceleration)
    return Limits(velocity, share * acceleration, share * jerk)
