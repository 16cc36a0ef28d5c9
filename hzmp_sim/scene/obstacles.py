"""Geoms that can touch the body become polytopes in the space of its centre."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_planners.sets import Polytope
from hzmp_sim.scene.bodies import Body, carriers
from hzmp_sim.scene.body_shape import BodyShape
from hzmp_sim.scene.constants import MANY_PARTS, MERGE_SHARE, TOUCH_TOL
from hzmp_sim.scene.contact_filter import contact_margins
from hzmp_sim.scene.geoms import (
    HalfSpace,
    geom_name,
    geom_parts,
    geom_shape,
    geom_type,
)
from hzmp_sim.scene.grown import grown_obstacle, least_over_box
from hzmp_sim.scene.moving import MovingGeom, moving_geom
from hzmp_sim.scene.outer import Outer
from hzmp_sim.scene.placement import Bounds
from hzmp_sim.scene.planar import is_upright_prism
from hzmp_sim.scene.scene import GeomReport, Role


@dataclass(frozen=True, eq=False)
class Obstacles:
    """The grown obstacles and the report on every geom."""

    polytopes: tuple[Polytope, ...]
    geoms: tuple[int, ...]
    moving: tuple[MovingGeom, ...]
    reports: tuple[GeomReport, ...]
    warnings: tuple[str, ...]


def read_obstacles(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    body: Body,
    shape: BodyShape,
    bounds: Bounds,
    clearance: float,
    tolerance: float,
    driven: Collection[int] = (),
) -> Obstacles:
    """Obstacles of the body's centre within `bounds` (lo, hi), each (n,) [m].

    `shape` is what stands for the body; `driven` are ids of bodies that a motion script moves.

    Raises:
        SceneError: a geom that can touch the body is a flex, or too large, or on a body that moves
            and not convex.
    """
    polytopes: list[Polytope] = []
    geoms: list[int] = []
    moving: list[MovingGeom] = []
    reports: list[GeomReport] = []
    warnings: list[str] = []
    margins = _margins(model, body)
    _refuse_flexes(model, body)
    if np.isnan(np.delete(margins, body.geoms)).all() and model.ngeom > len(body.geoms):
        warnings.append(f"MuJoCo lets no geom of this world touch body {body.name!r}")

    for geom in range(model.ngeom):
        name, kind = geom_name(model, geom), geom_type(model, geom)
        role: Role = "ignored"
        if geom in body.geoms:
            role, reason = "body", "part of the moving body"
        elif np.isnan(margins[geom]):
            reason = _no_contact(model, geom)
        elif movement := _movement(model, geom, driven):
            margin = float(margins[geom])
            _check_margin(name, margin, bounds)
            moving.append(moving_geom(model, geom, margin))
            role, reason = "moving", movement
        else:
            reason = "static"
            if _is_mocap(model, geom):
                reason = "mocap, planned where it stands now"
                warnings.append(f"{name} is on a mocap body: planned where it stands now")
            margin = float(margins[geom])
            _check_margin(name, margin, bounds)
            near = _reach_box(body, shape, bounds, clearance, margin)
            parts = geom_parts(model, data, geom, near, MERGE_SHARE * tolerance)
            try:
                found = [
                    grown_obstacle(part, body, shape, bounds, clearance, margin, tolerance)
                    for part in parts
                ]
            except SceneError as error:
                raise SceneError(f"{name}: {error}") from error
            outers = [outer for outer, _, _ in found if outer is not None]
            if outers:
                polytopes += [outer.polytope for outer in outers]
                geoms += [geom] * len(outers)
                reports.append(_obstacle_report(geom, name, kind, outers, reason))
                warnings += _notes(name, kind, len(outers))
                continue
            role, reason = found[0][1:] if found else ("outside", "outside the workspace")
        reports.append(GeomReport(geom, name, kind, role, 0, 0, 0.0, reason))
    return Obstacles(tuple(polytopes), tuple(geoms), tuple(moving), tuple(reports), tuple(warnings))


def is_planar_world(
    model: mujoco.MjModel, data: mujoco.MjData, body: Body, workspace: Bounds
) -> bool:
    """True when every obstacle stands upright through the workspace: 2-D planning loses nothing."""
    low, high = workspace
    margins = _margins(model, body)
    for geom in range(model.ngeom):
        if geom in body.geoms or np.isnan(margins[geom]):
            continue
        shape = geom_shape(model, data, geom)
        if isinstance(shape, HalfSpace):
            reaches_in = shape.offset > least_over_box(shape.normal, low, high) + TOUCH_TOL
            if reaches_in and abs(shape.normal[2]) > 1e-9:
                return False
            continue
        apart = (shape.support(np.eye(3)) <= low + TOUCH_TOL).any()
        apart = apart or (-shape.support(-np.eye(3)) >= high - TOUCH_TOL).any()
        prism = geom_type(model, geom) != "hfield"  # its hull may be one, itself it is not
        prism = prism and is_upright_prism(shape, float(low[2]), float(high[2]))
        if not apart and not prism:
            return False
    return True


def _obstacle_report(
    geom: int, name: str, kind: str, outers: list[Outer], reason: str
) -> GeomReport:
    facets, error = sum(len(outer.polytope.b) for outer in outers), max(o.error for o in outers)
    return GeomReport(geom, name, kind, "obstacle", len(outers), facets, error, reason)


def _notes(name: str, kind: str, parts: int) -> list[str]:
    """What the user should know of an obstacle."""
    if kind == "sdf":
        return [f"{name} is an SDF geom: planned as the convex hull of its mesh, which holds it"]
    if parts > MANY_PARTS:
        return [f"{name} has become {parts} obstacles: planning takes long (see --tolerance)"]
    return []


def _reach_box(
    body: Body, shape: BodyShape, bounds: Bounds, clearance: float, margin: float
) -> Bounds:
    """World box (lo, hi), each (3,), of what can be an obstacle: the rest is not even read."""
    reach = shape.extent
    low, high = bounds[0] + reach[0] - clearance - margin, bounds[1] + reach[1] + clearance + margin
    if body.planar:
        low, high = np.append(low, body.heights[0]), np.append(high, body.heights[1])
        low[2], high[2] = low[2] - clearance, high[2] + clearance
    return low, high


def _margins(model: mujoco.MjModel, body: Body) -> Floats:
    """Largest contact margin of each geom with any geom of the body [m]; NaN: never in contact."""
    margins = contact_margins(model, body.geoms)
    return np.where(np.isnan(margins).all(axis=0), np.nan, np.fmax.reduce(margins, axis=0))


def _check_margin(name: str, margin: float, bounds: Bounds) -> None:
    """Refuse what would round off a shape for ever: a ball of many workspaces within cm."""
    size = float((bounds[1] - bounds[0]).max())
    if not margin <= size:
        raise SceneError(
            f"{name} has a contact margin of {margin:g} m with the body, wider than the room for "
            f"its centre ({size:.4g} m): make it smaller"
        )


def _refuse_flexes(model: mujoco.MjModel, body: Body) -> None:
    ids = list(body.geoms)
    for flex in range(model.nflex):
        bits = model.geom_contype[ids] & model.flex_conaffinity[flex]
        bits |= model.geom_conaffinity[ids] & model.flex_contype[flex]
        if bits.any():
            name = mujoco.mj_id2name(model, int(mujoco.mjtObj.mjOBJ_FLEX), flex) or f"#{flex}"
            raise SceneError(
                f"flex {name} could touch the body, and flexes are not read yet; remove it or make "
                'it visual only (<contact contype="0" conaffinity="0"/>)'
            )


def _no_contact(model: mujoco.MjModel, geom: int) -> str:
    if not model.geom_contype[geom] and not model.geom_conaffinity[geom]:
        return "visual only: contype and conaffinity are 0"
    return "MuJoCo never lets it touch the body (flag, exclude, contype/conaffinity, weld)"


def _movement(model: mujoco.MjModel, geom: int, driven: Collection[int]) -> str:
    """How a geom moves, in words; "" if it does not: static, or mocap that nothing drives."""
    above = list(carriers(model, int(model.geom_bodyid[geom])))
    if any(body in driven for body in above):
        return "moves as the motion script says"
    jointed = [body for body in above if model.body_jntnum[body]]
    return f"moves with the joints of body {model.body(jointed[0]).name!r}" if jointed else ""


def _is_mocap(model: mujoco.MjModel, geom: int) -> bool:
    return int(model.body_mocapid[model.body_weldid[model.geom_bodyid[geom]]]) >= 0
