"""The actuator of one slide joint, turned round: which input gives a wanted force.

MuJoCo's force on the joint is gear (gain u + bias), each of gain and bias affine in the actuator's
length and velocity (XML reference, actuator/general): a motor has a constant gain and no bias, a
position servo gain kp and bias -kp length - kv velocity, a velocity servo gain kv and bias
-kv velocity. Solved for u, each of them is a source of force for the same law of control.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError

_WANTED = (
    "it needs one actuator on the joint, with a force affine in ctrl, length and velocity "
    "(motor, position, velocity or general; no dynamics, no delay, not by a tendon)"
)
_JOINT_KINDS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_GAINS = (int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE))
_BIASES = (int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE))

Affine = tuple[float, float, float]
Range = tuple[float, float]


@dataclass(frozen=True)
class SlideDrive:
    """One actuator on one slide joint; q [m] and v [m/s] are those of the joint."""

    actuator: int
    """Its id."""
    gear: float
    gain: Affine
    """Force per unit of input: constant, per length, per velocity."""
    bias: Affine
    """Force without input: likewise."""
    inputs: Range
    """That act (ctrlrange)."""
    forces: Range
    """Of the actuator, before the gear (forcerange)."""
    joint_forces: Range
    """After the gear (actuatorfrcrange of the joint) [N]."""

    def input(self, force: float, q: float, v: float) -> float:
        """The input whose force on the joint is nearest to `force` [N]."""
        length, speed = self.gear * q, self.gear * v
        gain = self.gain[0] + self.gain[1] * length + self.gain[2] * speed
        wanted = _clip(_clip(force, self.joint_forces) / self.gear, self.forces)
        if gain == 0.0:  # here no input does anything
            return _clip(0.0, self.inputs)
        bias = self.bias[0] + self.bias[1] * length + self.bias[2] * speed
        return _clip((wanted - bias) / gain, self.inputs)

    def force_range(self, q: float, v: float) -> Range:
        """Least and largest force on the joint [N]."""
        length, speed = self.gear * q, self.gear * v
        gain = self.gain[0] + self.gain[1] * length + self.gain[2] * speed
        bias = self.bias[0] + self.bias[1] * length + self.bias[2] * speed
        ends = [self.gear * _clip(gain * end + bias, self.forces) for end in self.inputs]
        low, high = (_clip(force, self.joint_forces) for force in sorted(ends))
        return low, high


def slide_drive(model: mujoco.MjModel, body: str, joint: int) -> SlideDrive:
    """The one actuator of a slide joint.

    Raises:
        SceneError: none, several, or one whose force does not follow its input at once.
    """
    found = [
        k
        for k in range(model.nu)
        if int(model.actuator_trntype[k]) in _JOINT_KINDS
        and int(model.actuator_trnid[k, 0]) == joint
    ]
    name = model.joint(joint).name
    if len(found) != 1 or not _is_affine(model, found[0]):
        names = ", ".join(repr(model.actuator(k).name) for k in found)
        has = f"the actuators {names}" if found else "no actuator of its own"
        raise SceneError(f"slide joint {name!r} of body {body!r} has {has}: {_WANTED}")
    k = found[0]
    affine = int(model.actuator_gaintype[k]) == mujoco.mjtGain.mjGAIN_AFFINE
    biased = int(model.actuator_biastype[k]) == mujoco.mjtBias.mjBIAS_AFFINE
    gains, biases = model.actuator_gainprm[k].tolist(), model.actuator_biasprm[k].tolist()
    drive = SlideDrive(
        actuator=k,
        gear=float(model.actuator_gear[k, 0]),
        gain=(gains[0], gains[1], gains[2]) if affine else (gains[0], 0.0, 0.0),
        bias=(biases[0], biases[1], biases[2]) if biased else (0.0, 0.0, 0.0),
        inputs=_range(model.actuator_ctrllimited[k], model.actuator_ctrlrange[k]),
        forces=_range(model.actuator_forcelimited[k], model.actuator_forcerange[k]),
        joint_forces=_range(model.jnt_actfrclimited[joint], model.jnt_actfrcrange[joint]),
    )
    start = float(model.qpos0[model.jnt_qposadr[joint]])
    if drive.gear * (drive.gain[0] + drive.gain[1] * drive.gear * start) == 0.0:
        raise SceneError(
            f"the actuator of slide joint {name!r} of body {body!r} has gear or gain 0 at rest: "
            "no input of it pushes"
        )
    return drive


def moved_masses(model: mujoco.MjModel, data: mujoco.MjData, dofs: Sequence[int]) -> list[float]:
    """What one physics step moves as mass along each degree of freedom: m = dt dF / dv [kg].

    Integrators that take damping implicitly (that of joints, or also of actuators) move a mass that
    is larger by dt times the damping. Measured, so that it holds for each of them.

    Args:
        model: its constraints (contacts, friction, joint limits) are left out.
        data: state and inputs.
        dofs: what is pushed, one at a time.
    """
    free = copy.copy(model)
    free.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)

    def speed_after(dof: int, push: float) -> float:
        pushed = mujoco.MjData(free)
        pushed.qpos[:], pushed.ctrl[:] = data.qpos, data.ctrl
        pushed.qfrc_applied[dof] = push
        mujoco.mj_step(free, pushed)
        return float(pushed.qvel[dof])

    dt = float(model.opt.timestep)
    return [2.0 * dt / (speed_after(dof, 1.0) - speed_after(dof, -1.0)) for dof in dofs]


def look_ahead(model: mujoco.MjModel) -> float:
    """From the begin of a physics step to where servos act with its input, on average [s].

    Runge-Kutta lets them act all along the step, every other integrator at its begin.
    """
    runge_kutta = int(model.opt.integrator) == mujoco.mjtIntegrator.mjINT_RK4
    return 0.5 * float(model.opt.timestep) if runge_kutta else 0.0


def passive_law(model: mujoco.MjModel, drive: SlideDrive, joint: int) -> Range:
    """Damping [N s/m] and stiffness [N/m] of a slide joint, those of its actuator included."""
    flags, bits = model.opt.disableflags, mujoco.mjtDisableBit
    own = float(model.actuator_damping[drive.actuator]) * drive.gear**2
    damping = float(model.dof_damping[model.jnt_dofadr[joint]]) + own
    stiffness = float(model.jnt_stiffness[joint])
    return (
        0.0 if flags & int(bits.mjDSBL_DAMPER) else damping,
        0.0 if flags & int(bits.mjDSBL_SPRING) else stiffness,
    )


def _is_affine(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether force = gain u + bias, both affine in length and velocity, at once."""
    return (
        int(model.actuator_gaintype[actuator]) in _GAINS
        and int(model.actuator_biastype[actuator]) in _BIASES
        and int(model.actuator_dyntype[actuator]) == mujoco.mjtDyn.mjDYN_NONE
        and float(model.actuator_delay[actuator]) == 0.0
    )


def _range(limited: int, ends: Floats) -> Range:
    return (float(ends[0]), float(ends[1])) if limited else (-math.inf, math.inf)


def _clip(value: float, ends: Range) -> float:
    return min(max(value, ends[0]), ends[1])
