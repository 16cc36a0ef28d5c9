"""The body that moves: which one it is, how it can move, and how much room it takes."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_sim.scene.geoms import HalfSpace, geom_name, geom_shape, reach
from hzmp_sim.scene.planar import vertical_range

BUNDLED = ("point", "quadrotor")
"""Bodies that can be attached to any world."""

_JOINT = mujoco.mjtJoint


@dataclass(frozen=True, eq=False)
class Body:
    """The moving body of a compiled model."""

    id: int
    name: str
    planar: bool
    """Moves in a horizontal plane only."""
    orientation: Literal["fixed", "tilts", "turns"]
    """ "tilts": a free body, which leans to fly; "turns": by hinges or balls."""
    centre: Floats
    """Where its frame stands at qpos0, shape (3,) [m]."""
    geoms: tuple[int, ...]
    """Its colliding geoms, those of welded children included."""
    radius: float
    """Of the ball about its centre that holds it; of the upright cylinder when planar [m]."""
    heights: tuple[float, float]
    """Lowest and highest z of its geoms where it stands [m]."""
    reach: tuple[Floats, Floats]
    """Where the ranges of its slide joints let the centre go (lo, hi), each (3,) [m]."""


def choose_body(model: mujoco.MjModel, name: str | None, driven: Collection[int] = ()) -> str:
    """Name of the body to move: a bundled one, or one of the world.

    Without a name it is the only body of the world that is free to move and actuated, other than
    the `driven` ones that a motion script moves, and the bundled point when there is none.

    Raises:
        SceneError: no such body, or several candidates.
    """
    known = [model.body(i).name for i in range(1, model.nbody) if model.body(i).name]
    if name is not None:
        if name in BUNDLED or name in known:
            return name
        valid = ", ".join(BUNDLED) + (f", or of this world: {', '.join(known)}" if known else "")
        raise SceneError(f"unknown body {name!r}; valid are {valid}")
    moved = {_root(model, body) for body in driven if model.body_weldid[body] != 0}
    roots = sorted({_root(model, body) for body in _actuated(model)} - moved)
    if not roots:
        return "point"
    names = [model.body(root).name for root in roots]
    if len(roots) > 1:
        raise SceneError(f"several bodies are actuated: {', '.join(names)}; choose one by --body")
    if not names[0]:
        raise SceneError("the actuated body has no name; name it in the MJCF, or give --body")
    return names[0]


def is_bundled(model: mujoco.MjModel, name: str) -> bool:
    """Whether a name means a bundled body that is yet to be attached.

    A world that has an actuated body of that name (such as the scene.xml of a run) means its own.
    """
    return name in BUNDLED and name not in {
        model.body(_root(model, body)).name for body in _actuated(model)
    }


def read_body(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> Body:
    """Motion and size of a body of a compiled model, `data` at qpos0.

    Raises:
        SceneError: it cannot move freely, changes its shape, or has nothing that collides.
    """
    body = model.body(name).id
    planar = _is_planar(model, data, body)
    subtree = [b for b in range(model.nbody) if descends(model, b, body)]
    inner = [b for b in subtree if b != body and model.body_jntnum[b]]
    if inner:
        raise SceneError(
            f"body {name!r} has joints inside (body {model.body(inner[0]).name!r}): its shape "
            "changes in flight; only rigid bodies are planned"
        )
    paired = {int(g) for pair in (model.pair_geom1, model.pair_geom2) for g in pair}
    geoms = tuple(
        g
        for g in range(model.ngeom)
        if int(model.geom_bodyid[g]) in subtree
        and (model.geom_contype[g] or model.geom_conaffinity[g] or g in paired)
    )
    if not geoms:
        raise SceneError(f"body {name!r} has no geom that can collide: give it one")
    centre = np.array(data.xpos[body])
    radius, low, high = 0.0, np.inf, -np.inf
    for geom in geoms:
        shape = geom_shape(model, data, geom)
        if isinstance(shape, HalfSpace):
            raise SceneError(f"{geom_name(model, geom)} of body {name!r} is a plane: infinite")
        radius = max(radius, reach(shape, centre[:2] if planar else centre))
        bottom, top = vertical_range(shape)
        low, high = min(low, bottom), max(high, top)
    span = _reach(model, data, body, centre)
    kind = _orientation(model, body)
    return Body(body, name, planar, kind, centre, geoms, radius, (low, high), span)


def _orientation(model: mujoco.MjModel, body: int) -> Literal["fixed", "tilts", "turns"]:
    kinds = {int(model.jnt_type[joint]) for joint in _joints(model, body)}
    if _JOINT.mjJNT_FREE in kinds:
        return "tilts"
    return "fixed" if kinds == {int(_JOINT.mjJNT_SLIDE)} else "turns"


def _reach(
    model: mujoco.MjModel, data: mujoco.MjData, body: int, centre: Floats
) -> tuple[Floats, Floats]:
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    for joint in _joints(model, body):
        direction = data.xaxis[joint]
        axis = int(np.abs(direction).argmax())
        slide = int(model.jnt_type[joint]) == _JOINT.mjJNT_SLIDE
        if slide and model.jnt_limited[joint] and abs(direction[axis]) > 1.0 - 1e-9:
            shift = model.jnt_range[joint] - model.qpos0[model.jnt_qposadr[joint]]
            ends = sorted((centre[axis] + direction[axis] * shift).tolist())
            low[axis], high[axis] = max(low[axis], ends[0]), min(high[axis], ends[1])
    return low, high


def qpos_at(model: mujoco.MjModel, data: mujoco.MjData, body: Body, centre: Floats) -> Floats:
    """The initial state (nq,) with the body's frame moved to `centre` (3,) [m], `data` at qpos0."""
    qpos = np.array(model.qpos0)
    joints = _joints(model, body.id)
    for joint in joints:
        if int(model.jnt_type[joint]) == _JOINT.mjJNT_FREE:
            address = int(model.jnt_qposadr[joint])
            qpos[address : address + 3] = centre
            return qpos
    slides = [j for j in joints if int(model.jnt_type[j]) == _JOINT.mjJNT_SLIDE]
    axes = np.array([_axis(model, data, body.id, joint) for joint in slides])
    move = np.linalg.lstsq(axes.T, centre - body.centre, rcond=None)[0]
    for joint, value in zip(slides, move, strict=True):
        qpos[int(model.jnt_qposadr[joint])] += value
    return qpos


def _is_planar(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> bool:
    """Motion of the centre: a horizontal plane (True) or all of space (False)."""
    name = model.body(body).name
    joints = _joints(model, body)
    kinds = [int(model.jnt_type[joint]) for joint in joints]
    parent = int(model.body_parentid[body])
    if kinds == [_JOINT.mjJNT_FREE]:
        return False
    axes = np.array(
        [
            _axis(model, data, body, j)
            for j in joints
            if int(model.jnt_type[j]) == _JOINT.mjJNT_SLIDE
        ]
    ).reshape(-1, 3)
    turns = [j for j in joints if int(model.jnt_type[j]) != _JOINT.mjJNT_SLIDE]
    about_centre = all(not np.array(model.jnt_pos[j]).any() for j in turns)
    rank = int(np.linalg.matrix_rank(axes, tol=1e-6)) if len(axes) else 0
    if model.body_weldid[parent] == 0 and about_centre and rank == len(axes):
        if rank == 3:
            return False
        upright = all(
            int(model.jnt_type[j]) == _JOINT.mjJNT_HINGE
            and abs(_axis(model, data, body, j)[2]) > 1.0 - 1e-9
            for j in turns
        )
        if rank == 2 and np.abs(axes[:, 2]).max() < 1e-9 and upright:
            return True
    has = ", ".join(_JOINT(kind).name.removeprefix("mjJNT_").lower() for kind in kinds) or "none"
    raise SceneError(
        f"body {name!r} cannot be planned with its joints ({has}); it needs a free joint, three "
        "slides, or two horizontal slides with or without an upright hinge, on a fixed parent"
    )


def _joints(model: mujoco.MjModel, body: int) -> list[int]:
    first = int(model.body_jntadr[body])
    return list(range(first, first + int(model.body_jntnum[body])))


def _axis(model: mujoco.MjModel, data: mujoco.MjData, body: int, joint: int) -> Floats:
    """Axis of a joint in the world at qpos0, shape (3,)."""
    return np.asarray(np.array(data.xmat[body]).reshape(3, 3) @ model.jnt_axis[joint])


def descends(model: mujoco.MjModel, body: int, ancestor: int) -> bool:
    """Whether `body` is `ancestor` or hangs from it."""
    while body > ancestor:  # parents come before their children
        body = int(model.body_parentid[body])
    return body == ancestor


def carriers(model: mujoco.MjModel, body: int) -> Iterator[int]:
    """A body, and those that it hangs from, by id; the world is left out."""
    while body > 0:
        yield body
        body = int(model.body_parentid[body])


def _root(model: mujoco.MjModel, body: int) -> int:
    """The moving body nearest to the world among a body and its ancestors."""
    root = int(model.body_weldid[body])
    while model.body_weldid[model.body_parentid[root]] != 0:
        root = int(model.body_weldid[model.body_parentid[root]])
    return root


def _actuated(model: mujoco.MjModel) -> list[int]:
    """Bodies that an actuator drives through a joint, site or body, if they can move."""
    bodies = []
    for kind, (target, _) in zip(model.actuator_trntype, model.actuator_trnid, strict=True):
        # int() first: MuJoCo's enums on the left compare unequal to numpy integers.
        if int(kind) in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT):
            bodies.append(int(model.jnt_bodyid[target]))
        elif int(kind) == mujoco.mjtTrn.mjTRN_SITE:
            bodies.append(int(model.site_bodyid[target]))
        elif int(kind) == mujoco.mjtTrn.mjTRN_BODY:
            bodies.append(int(target))
    return [body for body in bodies if model.body_weldid[body] != 0]
