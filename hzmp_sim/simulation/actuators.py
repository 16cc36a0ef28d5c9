"""What a compiled model says about a body's joints and actuators."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_sim.scene.bodies import descends

VALID_BODIES = (
    "valid are slide joints along world axes with one motor or servo each, or a free joint with "
    "four site thrusts along the body's z axis"
)


def at_rest(model: mujoco.MjModel) -> mujoco.MjData:
    """The model in its reference configuration, without motion or control."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> Floats:
    """Joint-space inertia, shape (nv, nv)."""
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return matrix


def rigid_body(
    model: mujoco.MjModel, data: mujoco.MjData, dof: int
) -> tuple[float, Floats, Floats]:
    """Mass, centre of mass (3,) and inertia about it (3, 3), in the body frame, with all parts.

    From the mass matrix of the free joint: [[m 1, -m R [c]], [.., I]] with I about the origin.
    """
    block = mass_matrix(model, data)[dof : dof + 6, dof : dof + 6]
    mass = float(block[0, 0])
    rotation = data.xmat[int(model.dof_bodyid[dof])].reshape(3, 3)
    skew = -(rotation.T @ block[:3, 3:]) / mass
    com = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    shift = mass * (com @ com * np.eye(3) - np.outer(com, com))
    return mass, com, block[3:, 3:] - shift


def site_thrusts(model: mujoco.MjModel, body: str) -> list[int]:
    """Actuator ids of the four site thrusts of a body (their sites may sit on welded parts)."""
    index = int(model.body(body).id)
    site_kind = int(mujoco.mjtTrn.mjTRN_SITE)
    rotors = [
        k
        for k in range(model.nu)
        if int(model.actuator_trntype[k]) == site_kind
        and descends(model, int(model.site_bodyid[model.actuator_trnid[k, 0]]), index)
    ]
    usable = [k for k in rotors if is_direct(model, k) and int(model.actuator_trnid[k, 1]) < 0]
    if len(rotors) != 4 or len(usable) != 4:
        raise SceneError(
            f"body {body!r} has a free joint and {len(usable)} site thrusts with fixed gain and no "
            f"bias (of {len(rotors)} site actuators): {VALID_BODIES}"
        )
    return rotors


def is_direct(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether force = gain * (ctrl or its first-order lag)."""
    return (
        int(model.actuator_gaintype[actuator]) == mujoco.mjtGain.mjGAIN_FIXED
        and int(model.actuator_biastype[actuator]) == mujoco.mjtBias.mjBIAS_NONE
        and int(model.actuator_dyntype[actuator])
        in (mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT)
    )


def lag(model: mujoco.MjModel, actuator: int) -> float:
    """Time constant of the actuator [s]; 0 without dynamics."""
    if int(model.actuator_dyntype[actuator]) == mujoco.mjtDyn.mjDYN_NONE:
        return 0.0
    return float(model.actuator_dynprm[actuator, 0])


def control_range(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    """Range of ctrl that acts: ctrlrange, and forcerange seen through the gain."""
    low, high = -math.inf, math.inf
    if model.actuator_ctrllimited[actuator]:
        low, high = (float(v) for v in model.actuator_ctrlrange[actuator])
    if model.actuator_forcelimited[actuator]:
        gain = float(model.actuator_gainprm[actuator, 0])
        ends = sorted(float(v) / gain for v in model.actuator_forcerange[actuator])
        low, high = max(low, ends[0]), min(high, ends[1])
    return low, high
