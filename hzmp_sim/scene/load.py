"""MJCF file -> Scene."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, frozen
from hzmp_planners.errors import QueryError, SceneError
from hzmp_sim.motion.reading import read_motion
from hzmp_sim.motion.resolve import driven_bodies, resolved, without_missing
from hzmp_sim.motion.script import Motion, MotionScript
from hzmp_sim.scene.attach import attach_body
from hzmp_sim.scene.bodies import (
    Body,
    choose_body,
    descends,
    is_bundled,
    qpos_at,
    read_body,
)
from hzmp_sim.scene.body_shape import BodyShape, ShapeChoice
from hzmp_sim.scene.constants import BOX_MITRE, DEFAULT_CLEARANCE, MIN_TOLERANCE
from hzmp_sim.scene.decomposition import ConvexDecomposition, Decomposition, decompose_meshes
from hzmp_sim.scene.fit_shape import fit_shape
from hzmp_sim.scene.freeze import weld_others
from hzmp_sim.scene.geoms import geom_name
from hzmp_sim.scene.meshes import hull_note, mesh_warnings, read_meshes
from hzmp_sim.scene.mjcf import World, written_world
from hzmp_sim.scene.obstacles import Obstacles, is_planar_world, read_obstacles
from hzmp_sim.scene.placement import (
    Bounds,
    Endpoint,
    centre_bounds,
    check_inside,
    read_endpoint,
    read_workspace,
)
from hzmp_sim.scene.scene import Scene
from hzmp_sim.scene.sources import Source, open_world

_SAME_HEIGHT = 1e-4  # [m] two heights closer than this are one: MJCF text has six digits


def load_scene(
    path: str | Path | mujoco.MjSpec,
    body: str | None = None,
    start: ArrayLike | None = None,
    goal: ArrayLike | None = None,
    workspace: tuple[ArrayLike, ArrayLike] | None = None,
    clearance: float | None = None,
    tolerance: float | None = None,
    convex_decomposition: bool | ConvexDecomposition = False,
    freeze: bool = False,
    shape: ShapeChoice = "auto",
    max_tilt: float | None = None,
    motion: MotionScript | str | Path | None = None,
) -> Scene:
    """Read a MuJoCo world as a planning scene.

    Args:
        path: MJCF file, zip of one with its assets, compiled model (.mjb), name of a bundled world,
            or an editable model, which is not changed. `Scene.spec()` goes the other way.
        body: "point" or "quadrotor" attach a bundled body; any other name is a body of the world.
            None takes the only actuated moving body of the world, or attaches the point.
        start: position of the body's centre, 2 or 3 coordinates [m]; None: where the body stands,
            or the site "start" for an attached body.
        goal: the same for the goal; None: the site "goal".
        workspace: corners (lo, hi) of the box that bounds the whole body [m]; None: the numeric
            "workspace" of the world, else the box of its static geoms, start and goal with room
            for the body to pass around all of them (and a warning).
        clearance: distance to keep from every obstacle [m], >= 0; default 0.05.
        tolerance: how much larger than exact an obstacle may be [m], > 0; default such that a
            grown box keeps its six facets.
        shape: what stands for the body: "ball" about its centre that holds it; "hull" of a body
            that keeps its orientation; "cylinder", upright, that holds a free body at any yaw and
            at tilts up to `max_tilt`; "auto": what keeps most free space.
        max_tilt: of that cylinder [rad], > 0; default 0.6.
        convex_decomposition: cut non-convex meshes that collide into convex pieces, for planner
            and physics alike; True: by CoACD's usual settings. Otherwise a mesh is its hull.
        freeze: weld every other jointed body to where it stands, for planner and physics alike.
            Otherwise they move.
        motion: what drives the bodies of the world: a script, or a file of one; None: the file
            motion.toml beside the world, if there is one.

    Raises:
        SceneError: the world cannot be read as a scene.
        QueryError: start or goal is outside the workspace or inside an obstacle; the motion script
            cannot be read, or does not suit the world.
        ShapeError: an argument is not finite or has the wrong shape.
    """
    began = time.perf_counter()
    keep = _positive("clearance", DEFAULT_CLEARANCE if clearance is None else clearance, zero=True)
    source = open_world(path)
    script = _script(source, motion)
    driven = driven_bodies(script, source.model) if script else {}
    name = choose_body(source.model, body, driven)
    _check_flown(source.model, name, driven)
    lost: tuple[str, ...] = ()
    if freeze:
        source = weld_others(source, None if is_bundled(source.model, name) else name)
        if script:
            script, lost = without_missing(script, source.model)
    model, data = source.model, source.data
    begin, end = (
        read_endpoint(model, data, label, given)
        for label, given in (("start", start), ("goal", goal))
    )
    room = read_workspace(model, data, workspace).with_room([begin.known, end.known], 0.0)
    space = room.bounds
    pieces = _pieces(model, source.spec, name, convex_decomposition)
    if is_bundled(model, name):
        world, moving, centre = _attached(source, pieces, name, begin, end, space)
    else:
        spec = source.spec.copy()
        pieces.put_into(spec)
        world = written_world(spec, source.path)
        moving = read_body(world.model, world.data, name)
        centre = moving.centre
        if begin.given is not None:
            centre = (
                begin.position(float(centre[2]))
                if begin.given.size == 3
                else np.append(begin.given, centre[2])
            )
    target = end.position(float(centre[2]))
    n = 2 if moving.planar else 3
    tilt = None if max_tilt is None else _positive("max_tilt", max_tilt, zero=False)
    finest = None if tolerance is None else _positive("tolerance", tolerance, zero=False)
    solid = fit_shape(world.model, world.data, moving, shape, tilt, finest)
    # What turns gets the tolerance of the ball that holds it: less costs leaves at turned boxes.
    sharp = solid.mitre_radius(keep) if solid.kind == "hull" else moving.radius + keep
    tight = max(BOX_MITRE * sharp, MIN_TOLERANCE) if finest is None else finest
    # Wide enough to pass around every grown obstacle: what blocks a way must be an obstacle, not
    # the border of a guess.
    room = room.with_room([centre[:n], target[:n]], 3.0 * (moving.radius + keep) + tight)
    space = room.bounds
    if moving.planar:
        _check_heights(moving, begin, end, None if room.guessed else space)
    elif space[0].size == 2:
        raise SceneError(f"body {moving.name!r} moves in 3-D: its workspace needs z, too")
    bounds = centre_bounds(space, solid, moving.reach)
    for label, point in (("start", centre[:n]), ("goal", target[:n])):
        check_inside(label, point, bounds)
    driven = driven_bodies(script, world.model) if script else {}
    obstacles = read_obstacles(world.model, world.data, moving, solid, bounds, keep, tight, driven)
    for label, point in (("start", centre[:n]), ("goal", target[:n])):
        _check_free(world.model, obstacles, label, point, solid, keep)
    meshes = read_meshes(world.model, obstacles.geoms)
    return Scene(
        path=source.path,
        model=world.model,
        xml=world.xml,
        body=moving.name,
        n=n,
        workspace=(frozen(space[0][:n].copy()), frozen(space[1][:n].copy())),
        bounds=(frozen(bounds[0]), frozen(bounds[1])),
        start=frozen(centre[:n].copy()),
        goal=frozen(target[:n].copy()),
        radius=moving.radius,
        shape=solid,
        clearance=keep,
        tolerance=tight,
        height=float(moving.centre[2]) if moving.planar else None,
        heights=moving.heights if moving.planar else None,
        obstacles=obstacles.polytopes,
        obstacle_geoms=obstacles.geoms,
        moving=obstacles.moving,
        motion=script,
        body_geoms=moving.geoms,
        geoms=pieces.explained(obstacles.reports, world.model),
        meshes=meshes,
        pieces=pieces.reports,
        warnings=(
            *(room.warnings(n) + source.warnings + world.warnings),
            *(obstacles.warnings + pieces.warnings),
            *(f"frozen, so its motion is left out: {what}" for what in lost),
            *mesh_warnings(meshes),
        ),
        initial_qpos=frozen(qpos_at(world.model, world.data, moving, centre)),
        reading_time=time.perf_counter() - began,
    )


def _script(source: Source, given: MotionScript | str | Path | None) -> MotionScript | None:
    """The motion script of a world, its names looked up; None if there is none."""
    script = given
    if script is None:
        beside = source.path.parent / "motion.toml"
        script = beside if source.path.is_file() and beside.is_file() else None
    if script is None:
        return None
    if isinstance(script, MotionScript):
        return resolved(script, source.model)
    read = read_motion(script)
    try:
        return resolved(read, source.model)
    except QueryError as error:
        raise QueryError(f"{script}: {error}") from error


def _check_flown(model: mujoco.MjModel, name: str, driven: Mapping[int, Motion]) -> None:
    """Raise QueryError if the motion script drives the body that is flown."""
    if is_bundled(model, name):
        return
    flown = model.body(name).id
    for body, motion in driven.items():
        if descends(model, body, flown):
            raise QueryError(f"the motion of {motion.describe()} drives body {name!r}, which flies")


def _pieces(
    model: mujoco.MjModel, spec: mujoco.MjSpec, body: str, asked: bool | ConvexDecomposition
) -> Decomposition:
    """The convex pieces of the world's meshes as far as asked, those of the body left alone."""
    if not asked:
        return Decomposition()
    spared: list[int] = []
    if not is_bundled(model, body):
        root = model.body(body).id
        spared = [g for g in range(model.ngeom) if descends(model, model.geom_bodyid[g], root)]
    settings = ConvexDecomposition() if asked is True else asked
    return decompose_meshes(model, spec, settings, spared)


def _attached(
    source: Source, pieces: Decomposition, name: str, begin: Endpoint, end: Endpoint, space: Bounds
) -> tuple[World, Body, Floats]:
    """The world with a bundled body at the start; the point stays in the plane if it can."""
    asked = begin.is_planar or end.is_planar or space[0].size == 2
    height = next((h for h in (begin.height, end.height) if h is not None), None)
    if height is None and name == "point":
        height = float(space[0][2] + space[1][2]) / 2.0 if space[0].size == 3 else 0.0
    centre = begin.position(height)
    target = end.position(float(centre[2]))
    level = abs(float(centre[2] - target[2])) <= _SAME_HEIGHT
    if name == "point" and (asked or level):
        world, moving = _with_body(source, pieces, name, centre, planar=True)
        if asked or is_planar_world(world.model, world.data, moving, space):
            return world, moving, centre
    return *_with_body(source, pieces, name, centre, planar=False), centre


def _with_body(
    source: Source, pieces: Decomposition, name: str, centre: Floats, *, planar: bool
) -> tuple[World, Body]:
    spec = source.spec.copy()
    pieces.put_into(spec)
    root = attach_body(spec, name, centre, planar=planar)
    world = written_world(spec, source.path)
    return world, read_body(world.model, world.data, root)


def _check_heights(body: Body, begin: Endpoint, end: Endpoint, space: Bounds | None) -> None:
    """A planar body stays at its height: what was said (`space` too, if any) must agree."""
    height = float(body.centre[2])
    for point in (begin, end):
        given = point.given
        if given is not None and given.size == 3 and abs(given[2] - height) > _SAME_HEIGHT:
            raise QueryError(
                f"{point.label} has z = {given[2]:g}, but body {body.name!r} moves in the plane "
                f"z = {height:g}: give that z, or two coordinates"
            )
    if space is None or space[0].size != 3:
        return
    if body.heights[0] < space[0][2] - _SAME_HEIGHT or body.heights[1] > space[1][2] + _SAME_HEIGHT:
        raise QueryError(
            f"body {body.name!r} is {body.heights[0]:.4g} to {body.heights[1]:.4g} m high up, "
            f"outside the workspace's {space[0][2] + 0.0:.4g} to {space[1][2]:.4g} m"
        )


def _check_free(
    model: mujoco.MjModel,
    obstacles: Obstacles,
    label: str,
    point: Floats,
    shape: BodyShape,
    clearance: float,
) -> None:
    worst, name, why = 1e-9, "", ""
    for polytope, geom in zip(obstacles.polytopes, obstacles.geoms, strict=True):
        depth = -float(polytope.violation(point)[0])
        if depth > worst:
            worst, name, why = depth, geom_name(model, geom), hull_note(model, geom)
    if name:
        where = ", ".join(f"{value:.4g}" for value in point)
        raise QueryError(
            f"{label} ({where}) is {worst:.3g} m inside obstacle {name} "
            f"(grown by {shape.growth(clearance)}); move it at least that far out, or lower the "
            "clearance" + (f"; {why}" if why else "")
        )


def _positive(label: str, value: float, *, zero: bool) -> float:
    number = float(value)
    if not np.isfinite(number) or number < 0.0 or (number == 0.0 and not zero):
        raise SceneError(f"{label} must be a finite number {'>=' if zero else '>'} 0, got {value}")
    return number
