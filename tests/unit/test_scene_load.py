"""What a scene says: body, start, goal, workspace, motion, and the world that is written."""

import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest

from hzmp_sim.scene import load_scene

ROOM = """
  <site name="start" pos="-2 0 1"/><site name="goal" pos="2 0 1"/>
  <geom name="wall" type="box" pos="0 0 1" size="0.15 1 1"/>
"""
SPACE = '<custom><numeric name="workspace" data="-3 -2 0 3 2 2"/></custom>'


def write(folder: Path, world: str = ROOM, head: str = SPACE, tail: str = "") -> Path:
    file = folder / "scene.xml"
    file.write_text(f"<mujoco>{head}<worldbody>{world}</worldbody>{tail}</mujoco>")
    return file


def robot(joints: str, geom: str = '<geom name="shell" size="0.1"/>', pos: str = "-2 0 1") -> str:
    return f'<body name="robot" pos="{pos}">{joints}{geom}</body>'


def motors(*joints: str) -> str:
    return "<actuator>" + "".join(f'<motor joint="{j}"/>' for j in joints) + "</actuator>"


SLIDES_XY = '<joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>'


def test_point_stays_in_the_plane_when_nothing_is_lost(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path))
    assert (scene.body, scene.n, scene.height) == ("point", 2, 1.0)
    np.testing.assert_allclose(scene.start, [-2.0, 0.0])
    np.testing.assert_allclose(scene.goal, [2.0, 0.0])
    np.testing.assert_allclose(scene.workspace, [[-3.0, -2.0], [3.0, 2.0]])
    np.testing.assert_allclose(scene.bounds, [[-2.9, -1.9], [2.9, 1.9]])
    assert scene.radius == pytest.approx(0.1)
    assert scene.clearance == 0.05
    np.testing.assert_allclose(scene.to_world(scene.start[None, :]), [[-2.0, 0.0, 1.0]])
    assert scene.warnings == ()


@pytest.mark.parametrize(
    "change",
    [
        ('pos="2 0 1"', 'pos="2 0 1.3"'),  # another height
        ('size="0.15 1 1"', 'size="0.15 1 0.9"'),  # it can fly over
        ('type="box" pos="0 0 1" size="0.15 1 1"', 'type="sphere" pos="0 0 1" size="1"'),
    ],
)
def test_point_is_spatial_otherwise(tmp_path: Path, change: tuple[str, str]) -> None:
    scene = load_scene(write(tmp_path, ROOM.replace(*change)))
    assert (scene.n, scene.height) == (3, None)
    np.testing.assert_allclose(scene.start, [-2.0, 0.0, 1.0])


def test_two_coordinates_ask_for_the_plane(tmp_path: Path) -> None:
    low = write(tmp_path, ROOM.replace('size="0.15 1 1"', 'size="0.15 1 0.9"'))
    scene = load_scene(low, start=(-1.0, 0.5))
    assert (scene.n, scene.height) == (2, 1.0)
    np.testing.assert_allclose(scene.start, [-1.0, 0.5])


def test_quadrotor_keeps_the_height_of_the_site(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path), "quadrotor", start=(-1.0, 0.5))
    assert (scene.body, scene.n) == ("quadrotor", 3)
    np.testing.assert_allclose(scene.start, [-1.0, 0.5, 1.0])
    np.testing.assert_allclose(scene.initial_qpos[:7], [-1.0, 0.5, 1.0, 1.0, 0.0, 0.0, 0.0])
    assert 0.15 < scene.radius <= 0.2


def test_radius_holds_every_vertex_of_the_body(tmp_path: Path) -> None:
    """Against MuJoCo: a ball of that radius about the centre covers the body, and barely."""
    scene = load_scene(write(tmp_path), "quadrotor")
    data = mujoco.MjData(scene.model)
    data.qpos[:] = scene.initial_qpos
    mujoco.mj_kinematics(scene.model, data)
    directions = np.random.default_rng(0).normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    spec = mujoco.MjSpec.from_string(scene.xml)
    probe = spec.worldbody.add_body(name="probe", mocap=True)
    probe.add_geom(name="probe", size=[1e-6, 0.0, 0.0], contype=0, conaffinity=0)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = scene.initial_qpos
    gaps = []
    for direction in directions:
        data.mocap_pos[0] = scene.start + 2.0 * direction
        mujoco.mj_kinematics(model, data)
        probe_id = model.geom("probe").id
        gaps.append(
            min(
                mujoco.mj_geomDistance(
                    model, data, model.geom(scene.geom_name(g)).id, probe_id, 5.0, None
                )
                for g in scene.body_geoms
            )
        )
    assert 2.0 - scene.radius - 1e-4 <= min(gaps) <= 2.0 - scene.radius + 5e-3


def test_actuated_body_of_the_world_is_taken(tmp_path: Path) -> None:
    world = ROOM + robot(SLIDES_XY + '<joint name="yaw" axis="0 0 1"/>', pos="-2 0.5 0.7")
    scene = load_scene(write(tmp_path, world, tail=motors("x", "y")), start=(-1.0, 1.0))
    assert (scene.body, scene.n) == ("robot", 2)
    assert scene.height == pytest.approx(0.7)
    np.testing.assert_allclose(scene.start, [-1.0, 1.0])
    data = mujoco.MjData(scene.model)
    data.qpos[:] = scene.initial_qpos
    mujoco.mj_kinematics(scene.model, data)
    np.testing.assert_allclose(
        data.xpos[scene.model.body("robot").id], [-1.0, 1.0, 0.7], atol=1e-12
    )


def test_body_starts_where_it_stands(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path, ROOM + robot("<freejoint/>", pos="-1 0.5 0.7")), "robot")
    assert scene.n == 3
    np.testing.assert_allclose(scene.start, [-1.0, 0.5, 0.7])
    np.testing.assert_allclose(scene.initial_qpos, [-1.0, 0.5, 0.7, 1.0, 0.0, 0.0, 0.0])


def test_slides_along_turned_axes(tmp_path: Path) -> None:
    body = robot(SLIDES_XY).replace("<body ", '<body euler="0 0 30" ')
    scene = load_scene(write(tmp_path, ROOM + body), "robot", start=(-1.5, 0.7))
    data = mujoco.MjData(scene.model)
    data.qpos[:] = scene.initial_qpos
    mujoco.mj_kinematics(scene.model, data)
    np.testing.assert_allclose(
        data.xpos[scene.model.body("robot").id], [-1.5, 0.7, 1.0], atol=1e-12
    )


def test_planar_body_does_not_see_the_floor_it_stands_on(tmp_path: Path) -> None:
    floor = """<geom name="floor" type="plane" size="3 2 0.1"/>
      <geom name="slab" type="box" size="3 2 0.1" pos="0 0 -0.1"/>"""
    lamp = '<geom name="lamp" type="sphere" size="0.3" pos="1 0 1.5"/>'
    puck = robot(SLIDES_XY, '<geom type="cylinder" size="0.2 0.1"/>', "-2 0 0.1")
    file = write(tmp_path, ROOM + floor + lamp + puck, tail=motors("x", "y"))
    scene = load_scene(file)
    roles = {report.name: report for report in scene.geoms}
    assert scene.radius == pytest.approx(0.2)
    assert roles["wall"].role == "obstacle"
    for name in ("floor", "slab", "lamp"):
        assert roles[name].role == "beside"
        assert "heights 0 to 0.2 m" in roles[name].reason
    assert {scene.geom_name(g) for g in scene.beside_geoms} == {"floor", "slab", "lamp"}
    assert [scene.geom_name(g) for g in scene.obstacle_geoms] == ["wall"]


def test_unnamed_geom_is_told_by_number_type_and_body(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path, ROOM.replace('name="wall" ', "")))
    assert scene.geoms[0].name == "geom#0 (box) of body world"


def test_reports_every_geom_once_and_says_why(tmp_path: Path) -> None:
    extra = """
      <geom name="poster" type="box" size="0.1 0.1 0.1" contype="0" conaffinity="0"/>
      <geom name="other" type="box" size="0.1 0.1 0.1" contype="2" conaffinity="2"/>
      <geom name="far" type="box" size="0.1 0.1 1" pos="9 9 1"/>
      <body name="cart" mocap="true" pos="0 1.6 1">
        <geom name="cart" type="box" size="0.1 0.1 1"/>
      </body>
    """
    scene = load_scene(write(tmp_path, ROOM + extra))
    assert [report.geom for report in scene.geoms] == list(range(scene.model.ngeom))
    found = {report.name: (report.role, report.reason) for report in scene.geoms}
    assert found["wall"] == ("obstacle", "static")
    assert found["poster"][0] == "ignored"
    assert "visual only" in found["poster"][1]
    assert "never lets it touch" in found["other"][1]
    assert "outside the workspace" in found["far"][1]
    assert found["cart"][0] == "obstacle"
    assert scene.warnings == ("cart is on a mocap body: planned where it stands now",)
    assert len(scene.obstacles) == len(scene.obstacle_geoms) == 2


def test_workspace_from_flag_file_or_geoms(tmp_path: Path) -> None:
    walls = """<geom type="box" size="0.1 2 1" pos="-3 0 1"/>
      <geom type="box" size="0.1 2 1" pos="3 0 1"/>"""
    file = write(tmp_path, ROOM + walls, head="")
    scene = load_scene(file)
    room = 3 * (scene.radius + scene.clearance) + scene.tolerance
    np.testing.assert_allclose(scene.workspace, [[-3.1 - room, -2 - room], [3.1 + room, 2 + room]])
    assert len(scene.warnings) == 1
    assert "box of the static geoms" in scene.warnings[0]
    given = load_scene(file, workspace=((-3, -1.5, 0), (3, 1.5, 2)))
    np.testing.assert_allclose(given.workspace, [[-3.0, -1.5], [3.0, 1.5]])
    assert given.warnings == ()


def test_names_of_the_world_are_not_touched(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path, ROOM.replace('name="wall"', 'name="point_ball"')))
    assert scene.body == "flown/point"
    assert scene.geom_name(scene.obstacle_geoms[0]) == "point_ball"


@pytest.mark.parametrize("body", ["point", "quadrotor"])
def test_xml_is_the_world_flown(tmp_path: Path, body: str) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "tent.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    )
    head = SPACE + '<compiler meshdir="parts"/><asset><mesh name="tent" file="tent.obj"/></asset>'
    scene = load_scene(
        write(tmp_path, ROOM + '<geom type="mesh" mesh="tent" pos="0 -1.9 0"/>', head), body
    )
    shutil.rmtree(tmp_path / "parts")  # the text needs no other file
    again = mujoco.MjModel.from_xml_string(scene.xml)
    for name in ("geom_pos", "geom_quat", "geom_size", "mesh_vert", "body_mass", "qpos0"):
        np.testing.assert_array_equal(getattr(again, name), getattr(scene.model, name))
    names = [[m.geom(g).name for g in range(m.ngeom)] for m in (again, scene.model)]
    assert names[0] == names[1]
