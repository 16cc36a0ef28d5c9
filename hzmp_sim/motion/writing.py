"""MotionScript -> motion.toml."""

from __future__ import annotations

import json
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from hzmp_sim.motion.paths import Callback, Circle, Row, Swing
from hzmp_sim.motion.script import Motion, MotionScript
from hzmp_sim.motion.waypoints import Keyframes, Waypoints

_KINDS = {Waypoints: "waypoints", Circle: "circle", Swing: "swing", Keyframes: "keyframes"}
_RATE = 50.0  # [Hz] at which functions are written down


def motion_text(script: MotionScript, seconds: float) -> str:
    """A script as the text of a motion.toml, which `read_motion` reads.

    Python functions become waypoints at 50 Hz, and without the turns that quaternions give.

    Args:
        script: what moves.
        seconds: for how long functions are written down [s].
    """
    head = {"patrol": script.patrol or None, "duration": script.duration}
    tables = [_lines(head)]
    tables += [f"[[motion]]\n{_motion(motion, seconds)}" for motion in script.motions]
    for goal in script.goals:
        told = {"after": "arrival"} if goal.time is None else {"time": goal.time}
        entry = {"position": list(goal.position), **told, "dwell": goal.dwell or None}
        tables.append(f"[[goal]]\n{_lines(entry)}")
    return "\n".join(table for table in tables if table)


def _motion(motion: Motion, seconds: float) -> str:
    path: Any = motion.path
    note = ""
    if isinstance(path, Callback):
        path, note = _sampled(path, motion, seconds), "# a Python function at 50 Hz\n"
    entry: dict[str, Any] = {motion.kind: motion.name, "kind": _KINDS[type(path)]}
    entry |= _changed(path, ())
    entry |= _changed(motion, ("path", "body", "joint", "actuator"))
    return note + _lines(entry)


def _changed(item: Any, without: tuple[str, ...]) -> dict[str, Any]:
    """The fields of a dataclass that are not at their defaults."""
    found = {}
    for field in fields(item):
        value = getattr(item, field.name)
        if (
            field.init
            and field.name not in without
            and (field.default is MISSING or value != field.default)
        ):
            found[field.name] = value
    return found


def _sampled(path: Callback, motion: Motion, seconds: float) -> Waypoints:
    last = motion.offset + motion.speed * seconds
    times = np.linspace(motion.offset, last, max(2, round(_RATE * seconds) + 1)).tolist()
    rows: list[Row] = [path.at(t) for t in times]
    if motion.kind == "body":
        return Waypoints(times=times, positions=[row[:3] for row in rows])
    return Waypoints(times=times, values=[row[0] for row in rows])


def _lines(entry: dict[str, Any]) -> str:
    """Keys and values; what JSON writes of strings, numbers and lists is TOML, too."""
    return "".join(
        f"{key} = {json.dumps(value, default=list)}\n"
        for key, value in entry.items()
        if value is not None
    )
