"""Worlds that hold more than one thing that moves: all but the flown body is welded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco

from hzmp_planners.errors import SceneError
from hzmp_sim.scene.meshes import listed
from hzmp_sim.scene.mjcf import compile_spec
from hzmp_sim.scene.sources import Source


def weld_others(source: Source, body: str | None) -> Source:
    """The world with every joint removed but those of `body` (None: all of them).

    What hung from a joint stands where it stands in the reference configuration (qpos0), and
    becomes an obstacle like any static geom. What acts on joints goes with them: actuators but
    those of the body, tendons, equality constraints, sensors, keyframes. The source is not changed.

    Raises:
        SceneError: MuJoCo cannot compile the world without its joints.
    """
    spec = source.spec.copy()
    own = None if body is None else spec.body(body)
    kept = _driven(own)
    joints = [joint for joint in spec.joints if own is None or joint.parent.name != own.name]
    if not joints:
        return source
    bodies = list(dict.fromkeys(joint.parent.name or "an unnamed one" for joint in joints))
    lost: dict[str, Sequence[object]] = {
        "actuators": [a for a in spec.actuators if (int(a.trntype), a.target) not in kept],
        "tendons": list(spec.tendons),
        "equalities": list(spec.equalities),
        "sensors": list(spec.sensors),
        "keyframes": list(spec.keys),
    }
    for items in (*lost.values(), joints):
        for item in items:
            spec.delete(item)
    try:
        model, data = compile_spec(spec, source.path)
    except SceneError as error:
        raise SceneError(f"{error} (after its joints were removed to freeze it)") from error
    warning = f"frozen where they stand: {listed(bodies)}"
    counts = [f"{kind} ({len(items)})" for kind, items in lost.items() if items]
    if counts:
        warning += f"; left out with their joints: {', '.join(counts)}"
    return replace(source, spec=spec, model=model, data=data, warnings=(*source.warnings, warning))


def _driven(body: mujoco.MjsBody | None) -> set[tuple[int, str]]:
    """What actuators of the body may act on: (transmission type, name)."""
    if body is None:
        return set()
    kinds = mujoco.mjtTrn
    parts = _tree(body)
    joints = [joint.name for joint in body.joints]
    return {
        *((int(kinds.mjTRN_JOINT), name) for name in joints),
        *((int(kinds.mjTRN_JOINTINPARENT), name) for name in joints),
        *((int(kinds.mjTRN_SITE), site.name) for part in parts for site in part.sites),
        *((int(kinds.mjTRN_BODY), part.name) for part in parts),
    }


def _tree(body: mujoco.MjsBody) -> list[mujoco.MjsBody]:
    return [body, *(part for child in body.bodies for part in _tree(child))]
