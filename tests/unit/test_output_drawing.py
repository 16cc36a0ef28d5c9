"""Triangles, outlines and cameras, against MuJoCo's own geometry."""

from __future__ import annotations

import io
import math
import time

import mujoco
import numpy as np
import pytest
from rich.console import Console
from scipy.spatial import ConvexHull

from hzmp_planners.sets import Polytope
from hzmp_sim.output import meshes
from hzmp_sim.output.framing import camera, eye, workspace_box
from hzmp_sim.progress import DELAY_S, busy, progress
from hzmp_sim.scene import load_scene

SHAPES = {
    "box": 'type="box" size=".3 .2 .4"',
    "sphere": 'type="sphere" size=".3"',
    "ellipsoid": 'type="ellipsoid" size=".3 .2 .4"',
    "cylinder": 'type="cylinder" size=".2 .4"',
    "capsule": 'type="capsule" size=".2 .4"',
    "mesh": 'type="mesh" mesh="wedge"',
}


def compile_geom(attributes: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><asset><mesh name="wedge" vertex="0 0 0 .6 0 0 0 .6 0 0 0 .6 .1 .1 .1"/>
        </asset><worldbody><geom {attributes} pos=".3 -.2 .5" euler="20 40 60"/>
        <geom type="sphere" size="1e-4" pos="9 9 9"/></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize("name", SHAPES)
def test_drawn_points_are_on_the_geom_that_mujoco_collides(name: str) -> None:
    """Every drawn point is in the geom, and the hull of all of them nearly fills it."""
    model, data = compile_geom(SHAPES[name])
    points = meshes.geom_points(model, data, 0)
    assert points is not None
    for point in points[:: max(1, len(points) // 40)]:
        data.geom_xpos[1] = point
        assert mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None) < 1e-6
    rng = np.random.default_rng(0)
    hull = ConvexHull(points)
    for direction in rng.normal(size=(40, 3)):
        outside = points.mean(axis=0) + 3.0 * direction / np.linalg.norm(direction)
        data.geom_xpos[1] = outside
        ends = np.zeros(6)
        mujoco.mj_geomDistance(model, data, 0, 1, 10.0, ends)
        depth = (hull.equations[:, :3] @ ends[:3] + hull.equations[:, 3]).max()
        assert -1e-3 < depth < 0.02  # touches the surface, a rounding of 24 corners aside


def test_planes_have_no_points() -> None:
    model, data = compile_geom('type="plane" size="1 1 1"')
    assert meshes.geom_points(model, data, 0) is None


def test_hull_triangles_enclose_the_volume_from_outside() -> None:
    cube = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    inner = np.vstack([cube, np.zeros((1, 3))])
    vertices, triangles = meshes.hull_triangles(inner)
    assert len(vertices) == 8
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0 == pytest.approx(8.0)
    flat, none = meshes.hull_triangles(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]))
    assert none.shape == (0, 3)
    assert len(flat) == 3


def test_outline_of_a_box_has_its_twelve_edges() -> None:
    edges = meshes.polytope_outline(Polytope.from_box([0, 0, 0], [1, 2, 3]))
    lengths = sorted(float(np.linalg.norm(b - a)) for a, b in edges)
    assert lengths == pytest.approx([1.0] * 4 + [2.0] * 4 + [3.0] * 4)
    (ring,) = meshes.polytope_outline(Polytope.from_box([0, 0], [1, 2]))
    assert np.linalg.norm(np.diff(ring, axis=0), axis=1).sum() == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("point", "normal", "area"),
    [
        ((0, 0, 0), (0, 0, 1), 4.0),  # the floor of the box: a whole side
        ((1, 1, 1), (0, 0, -1), 4.0),
        ((1, 1, 1), (1, -1, 0), 4.0 * math.sqrt(2.0)),
        ((1, 1, 1), (1, 1, 1), 3.0 * math.sqrt(3.0)),  # the hexagon of a cube
        ((0, 0, -1), (0, 0, 1), 0.0),  # below the box
    ],
)
def test_plane_in_box(point: tuple[float, ...], normal: tuple[float, ...], area: float) -> None:
    unit = np.array(normal) / np.linalg.norm(normal)
    polygon = meshes.plane_in_box(np.array(point, float), unit, np.zeros(3), np.full(3, 2.0))
    total = np.zeros(3)
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        total += np.cross(a, b) / 2.0
    assert abs(total @ unit) == pytest.approx(area, abs=1e-6)
    if area:
        np.testing.assert_allclose((polygon - point) @ unit, 0.0, atol=1e-9)


def test_colours_come_from_the_geom_or_its_material() -> None:
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><asset><material name="m" rgba="1 0 0 1"/></asset><worldbody>
        <geom size="1" material="m"/><geom size="1" rgba="0 1 0 1" material="m"/>
        <geom size="1"/></worldbody></mujoco>"""
    )
    colours = [meshes.geom_colour(model, geom).tolist() for geom in range(3)]
    assert colours == [[1, 0, 0, 1], [0, 1, 0, 1], [0.5, 0.5, 0.5, 1]]


@pytest.mark.parametrize(("world", "body"), [("enclosure", "point"), ("narrow_passage", "point")])
def test_the_free_camera_has_the_workspace_in_view(world: str, body: str) -> None:
    scene = load_scene(world, body=body)
    position, target = eye(scene, 4 / 3)
    lo, hi = workspace_box(scene)
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    half = math.tan(math.radians(scene.model.vis.global_.fovy / 2))
    for corner in np.array(np.meshgrid(*zip(lo, hi, strict=True))).reshape(3, -1).T - position:
        depth = corner @ forward
        assert abs(corner @ up) <= half * depth
        assert abs(corner @ right) <= half * depth * 4 / 3


def test_the_world_may_bring_its_own_camera() -> None:
    scene = load_scene("enclosure", body="point")
    view = camera(scene, 4 / 3)
    assert view.type == mujoco.mjtCamera.mjCAMERA_FIXED.value
    assert view.fixedcamid >= 0


def run_bar(console: Console, seconds: float, error: type[BaseException] | None = None) -> None:
    with progress("Rendering", 3, console=console) as advance:
        advance(1)
        time.sleep(seconds)
        advance(1)
        if error is not None:
            raise error


def test_progress_is_silent_for_short_work_and_when_piped() -> None:
    for terminal, seconds in ((True, 0.0), (False, DELAY_S + 0.1)):
        screen = io.StringIO()
        run_bar(Console(file=screen, force_terminal=terminal), seconds)
        assert screen.getvalue() == ""


def test_progress_shows_on_a_terminal_and_leaves_it_clean_on_ctrl_c() -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=80)
    with pytest.raises(KeyboardInterrupt):
        run_bar(console, DELAY_S + 0.1, KeyboardInterrupt)
    said = screen.getvalue()
    assert "Rendering" in said
    assert said.rstrip().endswith("\x1b[2K")  # the line is cleared
    assert said.count("\x1b[?25l") == said.count("\x1b[?25h") == 1  # and the cursor is back


def wait_busily(console: Console, seconds: float, error: type[BaseException] | None = None) -> None:
    with busy("Planning", console=console):
        time.sleep(seconds)
        if error is not None:
            raise error


def test_spinner_shows_only_on_a_terminal_and_only_for_long_work() -> None:
    piped, terminal = (
        Console(file=io.StringIO(), force_terminal=shown, width=60) for shown in (False, True)
    )
    for console, wait in ((piped, 1.2 * DELAY_S), (terminal, 0.0)):
        wait_busily(console, wait)
        assert isinstance(console.file, io.StringIO)
        assert console.file.getvalue() == ""
    with pytest.raises(KeyboardInterrupt):
        wait_busily(terminal, 1.5 * DELAY_S, KeyboardInterrupt)
    assert isinstance(terminal.file, io.StringIO)
    assert "Planning" in terminal.file.getvalue()
