"""motion.toml -> MotionScript."""

from __future__ import annotations

import tomllib
from dataclasses import MISSING, fields
from pathlib import Path as FilePath
from typing import Any

from hzmp_planners.errors import QueryError
from hzmp_sim.motion.paths import Circle, Swing
from hzmp_sim.motion.script import Goal, Motion, MotionScript
from hzmp_sim.motion.waypoints import Keyframes, Waypoints

_KINDS = {"waypoints": Waypoints, "circle": Circle, "swing": Swing, "keyframes": Keyframes}
_ON_ARRIVAL = "arrival"


def read_motion(file: str | FilePath) -> MotionScript:
    """The script of a motion.toml.

    Raises:
        QueryError: there is no such file, or something in it is not as it must be; the message
            says where, and what is valid.
    """
    path = FilePath(file)
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise QueryError(f"{path}: no motion script can be read there: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise QueryError(f"{path}: not well-formed TOML: {error}") from error
    try:
        return _script(table)
    except QueryError as error:
        raise QueryError(f"{path}: {error}") from error


def _script(table: dict[str, Any]) -> MotionScript:
    rest = dict(table)
    motions = _each(rest.pop("motion", []), "motion", _motion)
    goals = _each(rest.pop("goal", []), "goal", _goal)
    _known(rest, ["motion", "goal", "patrol", "duration"])
    return MotionScript(motions=motions, goals=goals, **rest)


def _each(entries: Any, label: str, read: Any) -> list[Any]:
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise QueryError(f"{label} must be written as [[{label}]]")
    found = []
    for number, entry in enumerate(entries, start=1):
        try:
            found.append(read(dict(entry)))
        except QueryError as error:
            raise QueryError(f"{label} {number}: {error}") from error
    return found


def _motion(entry: dict[str, Any]) -> Motion:
    own = [item.name for item in fields(Motion) if item.name != "path"]
    kind = entry.pop("kind", None)
    if kind not in _KINDS:
        raise QueryError(f"kind must be one of {', '.join(_KINDS)}, got {kind!r}")
    path = _KINDS[kind]
    valid = [item.name for item in fields(path) if item.init]
    _known(entry, [*own, "kind", *valid])
    needed = [item.name for item in fields(path) if item.init and item.default is MISSING]
    if missing := [name for name in needed if name not in entry]:
        raise QueryError(f"kind {kind!r} needs {', '.join(missing)}")
    made = path(**{name: entry.pop(name) for name in valid if name in entry})
    return Motion(path=made, **entry)


def _goal(entry: dict[str, Any]) -> Goal:
    after = entry.pop("after", None)
    _known(entry, ["position", "time", "after", "dwell"])
    if "position" not in entry:
        raise QueryError("it needs a position")
    if after not in (None, _ON_ARRIVAL):
        raise QueryError(f"after must be {_ON_ARRIVAL!r}, got {after!r}")
    if (after is None) == ("time" not in entry):
        raise QueryError(f"it needs either a time or after = {_ON_ARRIVAL!r}")
    return Goal(**entry)


def _known(entry: dict[str, Any], valid: list[str]) -> None:
    if unknown := [name for name in entry if name not in valid]:
        raise QueryError(f"unknown {unknown[0]!r}; valid are {', '.join(valid)}")
