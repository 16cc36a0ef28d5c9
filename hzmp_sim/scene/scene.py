"""What a planner needs to know of a MuJoCo world."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats, as_points
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from hzmp_sim.motion.script import MotionScript
from hzmp_sim.scene.body_shape import BodyShape
from hzmp_sim.scene.decomposition import PieceReport
from hzmp_sim.scene.geoms import geom_name
from hzmp_sim.scene.meshes import MeshReport
from hzmp_sim.scene.moving import MovingGeom

Role = Literal["obstacle", "moving", "beside", "outside", "ignored", "body"]


@dataclass(frozen=True)
class GeomReport:
    """How one geom of the world was taken."""

    geom: int
    """Geom id in the compiled model."""
    name: str
    type: str
    """MJCF type, such as "box"."""
    role: Role
    """"moving": on a body that moves, and so none of the obstacles; "beside": at heights that a
    planar body does not reach, such as the floor it stands on; "outside": where it reaches no point
    of the free space; "ignored": MuJoCo lets it touch nothing of the body."""
    parts: int
    """Obstacles it has become: several for a height field, 0 when it is none."""
    facets: int
    """Half-spaces of its obstacles; 0 when it is none."""
    error: float
    """Largest distance of a point of its obstacles to the exactly grown shape [m]."""
    reason: str
    """Why it has this role."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A world, the body that moves in it, and the obstacles of the body's centre.

    The centre of a body is the origin of its frame. Planar bodies (n = 2) move at one height.
    """

    path: Path
    """File of the world; the name of the model if it was an editable model."""
    model: mujoco.MjModel
    """Compiled, with the body attached."""
    xml: str
    """The exact world flown; compiles to the same model."""
    body: str
    """Name of the moving body in `model`."""
    n: int
    """2 for a planar body, else 3."""
    workspace: tuple[Floats, Floats]
    """Bounds of the whole body (lo, hi), each (n,) [m]."""
    bounds: tuple[Floats, Floats]
    """Box of the centre (lo, hi), each (n,) [m]: the workspace shrunk by the shape, within the
    ranges of slide joints."""
    start: Floats
    """Position of the centre, (n,) [m]."""
    goal: Floats
    """Position of the centre, (n,) [m]."""
    radius: float
    """Radius of the ball (disc) about the centre that holds the body [m]."""
    shape: BodyShape
    """What stands for the body: that ball, or a smaller set."""
    clearance: float
    """Distance kept between the body and every obstacle [m]."""
    tolerance: float
    """Bound on `GeomReport.error` [m]."""
    height: float | None
    """z of the centre of a planar body [m]; None in 3-D."""
    heights: tuple[float, float] | None
    """Lowest and highest z of a planar body [m]; None in 3-D."""
    obstacles: tuple[Polytope, ...]
    """Where the centre must not be: geoms grown by shape + clearance (+ contact margin)."""
    obstacle_geoms: tuple[int, ...]
    """Geom id of each obstacle; a height field has several obstacles."""
    moving: tuple[MovingGeom, ...]
    """Geoms that could touch the body and move: where they are when is for a prediction to say."""
    motion: MotionScript | None
    """What drives the bodies of the world, its names looked up; None: nothing does."""
    body_geoms: tuple[int, ...]
    """Ids of the colliding geoms of the moving body."""
    geoms: tuple[GeomReport, ...]
    """One for each geom of the model, in the order of ids."""
    meshes: tuple[MeshReport, ...]
    """The meshes that are obstacles, as the hulls that MuJoCo collides."""
    pieces: tuple[PieceReport, ...]
    """The meshes that were cut into convex pieces."""
    warnings: tuple[str, ...]
    initial_qpos: Floats
    """State (nq,) in which the centre is at start."""
    reading_time: float
    """How long it took to read the scene [s]."""

    @property
    def replans(self) -> bool:
        """Whether it takes a planner in the loop: something moves, or goals follow each other."""
        return bool(self.moving) or (self.motion is not None and bool(self.motion.goals))

    @property
    def contact_geoms(self) -> tuple[int, ...]:
        """Ids of all geoms that MuJoCo could bring into contact with the body."""
        roles = ("obstacle", "moving", "beside", "outside")
        return tuple(report.geom for report in self.geoms if report.role in roles)

    @property
    def beside_geoms(self) -> tuple[int, ...]:
        """Those of them beside the heights that a planar body moves in: floor, lintel, lamp."""
        return tuple(report.geom for report in self.geoms if report.role == "beside")

    def spec(self) -> mujoco.MjSpec:
        """The world flown as an editable model."""
        return mujoco.MjSpec.from_string(self.xml)

    def free_space(self) -> FreeSpace:
        """Exact convex decomposition of the free space of the body's centre."""
        return FreeSpace.decompose(bounds=self.bounds, obstacles=list(self.obstacles))

    def to_world(self, X: Floats) -> Floats:
        """World positions (k, 3) of planning points (k, n) [m]."""
        points = as_points(X, "X", self.n)
        if self.height is None:
            return points
        return np.column_stack([points, np.full(len(points), self.height)])

    def geom_name(self, geom: int) -> str:
        """Name of a geom; an unnamed one is told by number, type and body."""
        return geom_name(self.model, geom)
