"""Bodies that come with the package, attached to any world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import mujoco

from hzmp_planners._arrays import Floats
from hzmp_sim.worlds import body_path

_PREFIX = "flown/"


class _Element(Protocol):
    name: str


def attach_body(spec: mujoco.MjSpec, body: str, centre: Floats, *, planar: bool) -> str:
    """Attach a bundled body to a world, upright at `centre` (3,) [m]; returns its name there.

    Its parts keep the names of the body's file, unless the world uses one of them already.
    """
    child = mujoco.MjSpec.from_file(str(body_path(body, planar=planar)))
    names = {item.name for items in _elements(child) for item in items}
    taken = {item.name for items in _elements(spec) for item in items}
    frame = spec.worldbody.add_frame(pos=centre)
    spec.attach(child, prefix=_PREFIX, frame=frame)  # MuJoCo cannot save what has no prefix
    if names & taken - {""}:
        return _PREFIX + body
    for items in _elements(spec):
        for item in items:
            item.name = item.name.removeprefix(_PREFIX)
    for geom in spec.geoms:
        geom.material = geom.material.removeprefix(_PREFIX)
    for actuator in spec.actuators:
        actuator.target = actuator.target.removeprefix(_PREFIX)
    return body


def _elements(spec: mujoco.MjSpec) -> tuple[Sequence[_Element], ...]:
    """The named parts that the bundled bodies are made of."""
    lists = (spec.geoms, spec.joints, spec.sites, spec.actuators, spec.materials)
    return (spec.bodies[1:], *lists)
