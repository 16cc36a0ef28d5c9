"""What the commands have in common: which world, which body, from where to where."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter, Token

from hzmp_planners.errors import QueryError
from hzmp_sim.motion.script import Goal, MotionScript
from hzmp_sim.scene.body_shape import ShapeChoice
from hzmp_sim.scene.decomposition.settings import ConvexDecomposition
from hzmp_sim.settings import RunSettings

if TYPE_CHECKING:
    from hzmp_sim.scene import Scene

Coordinates = Annotated[tuple[float, ...] | None, Parameter(consume_multiple=True, negative=())]


def _positions(type_: Any, tokens: Sequence[Token]) -> tuple[tuple[float, ...], ...]:
    """One position for each time that the flag is given."""
    del type_
    found: list[list[float]] = []
    for token in tokens:
        if token.index == 0:
            found.append([])
        try:
            found[-1].append(float(token.value))
        except ValueError as error:
            raise QueryError(
                f"--goal must be 2 or 3 numbers, X Y [Z], got {token.value!r}"
            ) from error
    return tuple(tuple(position) for position in found)


Positions = Annotated[
    tuple[tuple[float, ...], ...] | None,
    Parameter(consume_multiple=True, negative=(), converter=_positions),
]
Switch = Annotated[bool, Parameter(negative=())]

_DEFAULT_COACD = ConvexDecomposition()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class World:
    """Which world, body and query: the arguments of `load_scene`.

    Attributes:
        body: point or quadrotor (attached to the world), or the name of a body of the world.
        start: position of the body's centre, X Y [Z] [m]; default: the site "start".
        goal: position of the body's centre, X Y [Z] [m]; default: the site "goal". Given several
            times: goals in a row, for `run`.
        workspace: box that bounds the whole body, lower then upper corner [m].
        clearance: distance to keep from every obstacle [m]; default 0.05; auto (of a run):
            1.5 times the largest tracking error of test flights among no obstacles.
        tolerance: how much larger than exact an obstacle may be [m].
        convex_decomposition: cut non-convex meshes into convex pieces; else they are their hulls.
        coacd: how to cut them.
        shape: what stands for the body: ball about its centre; hull of a body that keeps its
            orientation; upright cylinder that holds a free body at any yaw and tilts up to
            max-tilt; auto: what keeps most free space.
        max_tilt: tilt that the cylinder holds the body for [rad]; default 0.6.
        freeze: weld every other jointed body (robots, doors, loose things) to where it stands.
        motion: what drives the bodies of the world; default: motion.toml beside it, if it is there.
    """

    body: str | None = None
    start: Coordinates = None
    goal: Positions = None
    workspace: Coordinates = None
    clearance: float | Literal["auto"] | None = None
    tolerance: float | None = None
    convex_decomposition: Switch = False
    coacd: ConvexDecomposition = _DEFAULT_COACD
    shape: ShapeChoice = "auto"
    max_tilt: float | None = None
    freeze: Switch = False
    motion: Path | None = None

    def load(self, path: str) -> Scene:
        """The scene; its warnings, and what became of its meshes, are printed to stderr."""
        scene = self._read(path)
        for report in scene.pieces:
            print(f"hzmp-sim: {report.describe()}", file=sys.stderr)
        for warning in scene.warnings:
            print(f"hzmp-sim: warning: {warning}", file=sys.stderr)
        return scene

    def _read(self, path: str) -> Scene:
        from hzmp_sim.scene import load_scene

        corners: tuple[list[float], list[float]] | None = None
        if self.workspace is not None:
            half = len(self.workspace) // 2
            corners = list(self.workspace[:half]), list(self.workspace[half:])
        if self.clearance == "auto":
            raise QueryError("--clearance auto takes test flights: it is for `hzmp-sim run`")
        if self.coacd != _DEFAULT_COACD and not self.convex_decomposition:
            raise QueryError("--coacd.* says how to cut meshes: give --convex-decomposition, too")
        if self.goal == ():
            raise QueryError("--goal must be 2 or 3 numbers, X Y [Z], got none")
        first, *others = self.goal or (None,)
        scene = load_scene(
            path,
            self.body,
            self.start,
            first,
            corners,
            self.clearance,
            self.tolerance,
            self.coacd if self.convex_decomposition else False,
            freeze=self.freeze,
            shape=self.shape,
            max_tilt=self.max_tilt,
            motion=self.motion,
        )
        if not others:
            return scene
        # What the motion script has comes after them.
        script = scene.motion or MotionScript()
        goals = [Goal(position=one) for one in others if one is not None]
        return replace(scene, motion=replace(script, goals=[*goals, *script.goals]))

    def with_clearance(self, path: str, settings: RunSettings) -> World:
        """The same with a number for the clearance, measured if it is to be found."""
        if self.clearance != "auto":
            return self
        from hzmp_sim.simulation import clearance_for, tracking_tube

        tube = tracking_tube(replace(self, clearance=0.0)._read(path), settings)
        clearance = clearance_for(tube)
        print(
            f"hzmp-sim: clearance {1e3 * clearance:.0f} mm, for tracking errors of up to "
            f"{1e3 * tube:.1f} mm in test flights",
            file=sys.stderr,
        )
        return replace(self, clearance=clearance)
