"""A script meets a world: names are looked up, keyframes become waypoints."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import QueryError
from hzmp_sim.motion.paths import Path
from hzmp_sim.motion.script import Motion, MotionScript
from hzmp_sim.motion.waypoints import Keyframes, Waypoints

_OBJECTS = {
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "actuator": mujoco.mjtObj.mjOBJ_ACTUATOR,
}
_MOVED_JOINTS = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


def resolved(script: MotionScript, model: mujoco.MjModel) -> MotionScript:
    """The script with its keyframes looked up in a world, all its names checked.

    Raises:
        QueryError: the world has no such body, joint, actuator or keyframe, or it cannot be moved.
    """
    return replace(script, motions=[_resolved(motion, model) for motion in script.motions])


def without_missing(
    script: MotionScript, model: mujoco.MjModel
) -> tuple[MotionScript, tuple[str, ...]]:
    """The script without what a frozen world has no more; and what that is, in words."""
    kept = [motion for motion in script.motions if _id(motion, model) >= 0]
    lost = tuple(motion.describe() for motion in script.motions if motion not in kept)
    return replace(script, motions=kept), lost


def driven_bodies(script: MotionScript, model: mujoco.MjModel) -> dict[int, Motion]:
    """Bodies that a motion acts on, by id; those that hang from them move along."""
    found = {}
    for motion in script.motions:
        for body in _bodies(motion, model):
            found[body] = motion
    return found


def _resolved(motion: Motion, model: mujoco.MjModel) -> Motion:
    found = _id(motion, model)
    valid = _valid(motion.kind, model)
    if found < 0 or motion.name not in valid:
        kind = {"body": "mocap body", "joint": "hinge or slide joint", "actuator": "actuator"}
        what = "there is no" if found < 0 else "it is no"
        has = ", ".join(valid) or "none"
        raise QueryError(
            f"{motion.describe()}: {what} {kind[motion.kind]} of that name; this world has {has}"
        )
    if isinstance(motion.path, Keyframes):
        try:
            return replace(motion, path=_keyframes(motion.path, motion, found, model))
        except QueryError as error:
            raise QueryError(f"{motion.describe()}: {error}") from error
    return motion


def _id(motion: Motion, model: mujoco.MjModel) -> int:
    return int(mujoco.mj_name2id(model, int(_OBJECTS[motion.kind]), motion.name))


def _valid(kind: str, model: mujoco.MjModel) -> list[str]:
    if kind == "body":
        ids: Iterable[int] = np.flatnonzero(np.array(model.body_mocapid) >= 0).tolist()
        return [model.body(i).name for i in ids]
    if kind == "joint":
        ids = np.flatnonzero(np.isin(model.jnt_type, _MOVED_JOINTS)).tolist()
        return [model.joint(i).name for i in ids]
    return [model.actuator(i).name for i in range(model.nu)]


def _keyframes(path: Keyframes, motion: Motion, found: int, model: mujoco.MjModel) -> Path:
    known = [model.key(k).name for k in range(model.nkey)]
    if unknown := [name for name in path.names if name not in known]:
        raise QueryError(
            f"there is no keyframe {unknown[0]!r}; this world has {', '.join(known) or 'none'}"
        )
    keys = [known.index(name) for name in path.names]
    times = path.times if path.times is not None else model.key_time[keys].tolist()
    if motion.kind == "body":
        mocap = int(model.body_mocapid[found])
        stands = np.array(model.body_quat[found])
        turns = [np.array(model.key_mquat[key]).reshape(-1, 4)[mocap] for key in keys]
        yaws = np.unwrap([_yaw(stands, turned, path.names[k]) for k, turned in enumerate(turns)])
        return Waypoints(
            times=times,
            positions=[
                np.array(model.key_mpos[key]).reshape(-1, 3)[mocap].tolist() for key in keys
            ],
            yaws=yaws.tolist() if yaws.any() else None,
            repeat=path.repeat,
            smooth=path.smooth,
        )
    if motion.kind == "joint":
        column = model.key_qpos[keys, int(model.jnt_qposadr[found])]
    else:
        column = model.key_ctrl[keys, found]
    return Waypoints(times=times, values=column.tolist(), repeat=path.repeat, smooth=path.smooth)


def _yaw(stands: Floats, turned: Floats, key: str) -> float:
    """Angle about the vertical from one orientation to another [rad]."""
    back, between = np.empty(4), np.empty(4)
    mujoco.mju_negQuat(back, stands)
    mujoco.mju_mulQuat(between, turned, back)
    if np.abs(between[1:3]).max() > 1e-6:
        raise QueryError(f"keyframe {key!r} turns it otherwise than about the vertical")
    return 2.0 * math.atan2(between[3], between[0])


def _bodies(motion: Motion, model: mujoco.MjModel) -> list[int]:
    found = _id(motion, model)
    if motion.kind == "body":
        return [found]
    if motion.kind == "joint":
        return [int(model.jnt_bodyid[found])]
    kind, target = int(model.actuator_trntype[found]), int(model.actuator_trnid[found, 0])
    trn = mujoco.mjtTrn
    if kind in (int(trn.mjTRN_JOINT), int(trn.mjTRN_JOINTINPARENT)):
        return [int(model.jnt_bodyid[target])]
    if kind == int(trn.mjTRN_SITE):
        return [int(model.site_bodyid[target])]
    if kind == int(trn.mjTRN_BODY):
        return [target]
    if kind == int(trn.mjTRN_SLIDERCRANK):
        return [int(model.site_bodyid[int(model.actuator_trnid[found, 1])])]
    # A tendon: the joints and sites that it runs over.
    first, count = int(model.tendon_adr[target]), int(model.tendon_num[target])
    wraps = range(first, first + count)
    joints = [int(model.wrap_objid[w]) for w in wraps if int(model.wrap_type[w]) == _WRAP_JOINT]
    sites = [int(model.wrap_objid[w]) for w in wraps if int(model.wrap_type[w]) == _WRAP_SITE]
    return [int(model.jnt_bodyid[j]) for j in joints] + [int(model.site_bodyid[s]) for s in sites]


_WRAP_JOINT, _WRAP_SITE = int(mujoco.mjtWrap.mjWRAP_JOINT), int(mujoco.mjtWrap.mjWRAP_SITE)
