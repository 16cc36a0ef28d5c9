"""Worlds in every form that MuJoCo reads, and in every way that MJCF says the same thing."""

import struct
import zipfile
from pathlib import Path

import mujoco
import numpy as np
import pytest

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_sim.scene import Scene, load_scene
from hzmp_sim.scene.decompiled import decompiled
from hzmp_sim.scene.geoms import geom_type, mesh_points
from hzmp_sim.worlds import body_path, world_path

SPACE = '<custom><numeric name="workspace" data="-3 -2 0 3 2 2"/></custom>'
SITES = '<site name="start" pos="-2.5 0 1"/><site name="goal" pos="2.5 0 1"/>'
TENT = (
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\n"
    "f 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 2/1 3/1 4/1\nf 1/1 4/1 3/1\n"
)
HEIGHTS = np.random.default_rng(0).random((4, 5)).astype(np.float32)


def with_assets(folder: Path) -> Path:
    """A world with an include, a mesh and a height field in files."""
    (folder / "parts").mkdir()
    (folder / "parts" / "tent.obj").write_text(TENT)
    (folder / "parts" / "hills.bin").write_bytes(struct.pack("ii", 4, 5) + HEIGHTS.tobytes())
    (folder / "walls.xml").write_text(
        '<mujoco><worldbody><geom name="wall" type="box" size="0.1 1 1" pos="0 -1 1"/></worldbody>'
        "</mujoco>"
    )
    file = folder / "world.xml"
    file.write_text(f"""<mujoco model="yard"><compiler meshdir="parts"/>{SPACE}
      <include file="walls.xml"/>
      <asset>
        <mesh name="tent" file="tent.obj" scale="-0.7 0.5 1.2"/>
        <hfield name="hills" file="hills.bin" size="1 0.5 0.6 0.1"/>
      </asset>
      <worldbody>{SITES}
        <geom name="tent" type="mesh" mesh="tent" pos="1 1 0.4" euler="10 20 30"/>
        <geom name="hills" type="hfield" hfield="hills" pos="-1 1 0.1"/>
        <geom name="fitted" type="capsule" mesh="tent" pos="1.5 -1 0.4"/>
      </worldbody></mujoco>""")
    return file


def corners(model: mujoco.MjModel) -> list[Floats]:
    """World position and what bounds it, of every geom."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = []
    for geom in range(model.ngeom):
        place, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
        if geom_type(model, geom) in ("mesh", "sdf"):
            points = mesh_points(model, geom) @ turn.T + place
            found.append(points[np.lexsort(np.round(points, 4).T)])
        else:
            kept = turn if geom_type(model, geom) != "cylinder" else turn[:, 2:].T
            found.append(np.vstack([place, kept, model.geom_size[geom]]))
    return found


def same_obstacles(one: Scene, two: Scene) -> None:
    kept = [[(r.name, r.type, r.role, r.parts) for r in scene.geoms] for scene in (one, two)]
    assert kept[0] == kept[1]
    for a, b in zip(corners(one.model), corners(two.model), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)
    np.testing.assert_array_equal(one.model.geom_margin, two.model.geom_margin)


def test_zip_compiled_model_and_editable_model_are_the_same_world(tmp_path: Path) -> None:
    file = with_assets(tmp_path)
    plain = load_scene(file)
    assert {report.type for report in plain.geoms} >= {"box", "mesh", "hfield", "capsule"}
    archive = tmp_path / "yard.zip"
    with zipfile.ZipFile(archive, "w") as target:
        for name in ("walls.xml", "world.xml", "parts/tent.obj", "parts/hills.bin"):
            inside = "scene.xml" if name == "world.xml" else name
            target.write(tmp_path / name, f"deep/{inside}")
    binary = tmp_path / "yard.mjb"
    mujoco.mj_saveModel(mujoco.MjModel.from_xml_path(str(file)), str(binary))
    spec = mujoco.MjSpec.from_file(str(file))
    before = spec.to_xml()
    for world in (archive, binary, spec):
        same_obstacles(load_scene(world), plain)
    assert spec.to_xml() == before
    assert load_scene(spec).path == Path("yard")
    same_obstacles(load_scene(plain.spec(), body="point"), plain)


@pytest.mark.parametrize("source", ["files", "zip"])
def test_the_text_of_the_world_needs_no_other_file(tmp_path: Path, source: str) -> None:
    file = with_assets(tmp_path)
    (tmp_path / "parts" / "tent.obj").write_text(TENT.replace("/1", ""))
    if source == "zip":
        file = tmp_path / "world.zip"
        with zipfile.ZipFile(file, "w") as target:
            for name in ("walls.xml", "world.xml", "parts/tent.obj", "parts/hills.bin"):
                target.write(tmp_path / name, name)
    scene = load_scene(file)
    for name in ("parts/tent.obj", "parts/hills.bin", "walls.xml"):
        (tmp_path / name).unlink()
    again = mujoco.MjModel.from_xml_string(scene.xml)
    for field in ("geom_pos", "geom_size", "mesh_vert", "hfield_data"):
        np.testing.assert_array_equal(getattr(again, field), getattr(scene.model, field))
    expected = (HEIGHTS - HEIGHTS.min()) / np.ptp(HEIGHTS)
    np.testing.assert_allclose(scene.model.hfield_data, expected.ravel(), atol=1e-5)


@pytest.mark.parametrize("name", ["all_geoms", "quadrotor", "maze"])
def test_a_compiled_model_is_taken_apart_exactly(name: str) -> None:
    files = {
        "all_geoms": Path(__file__).parents[1] / "data" / "all_geoms.xml",
        "quadrotor": body_path("quadrotor"),
        "maze": world_path("maze"),
    }
    model = mujoco.MjModel.from_xml_path(str(files[name]))
    again = decompiled(model).compile()
    for one, two in zip(corners(model), corners(again), strict=True):
        np.testing.assert_allclose(one, two, atol=1e-6)
    for field in (
        "geom_type", "geom_contype", "geom_margin", "body_mass", "body_inertia", "dof_damping",
        "actuator_gear", "actuator_dynprm", "actuator_gainprm", "actuator_ctrlrange", "qpos0",
        "site_pos", "numeric_data", "exclude_signature",
    ):  # fmt: skip
        np.testing.assert_allclose(getattr(again, field), getattr(model, field), err_msg=field)
    assert again.opt.timestep == model.opt.timestep


def test_broken_archives_and_compiled_models(tmp_path: Path) -> None:
    archive, binary = tmp_path / "world.zip", tmp_path / "world.mjb"
    with zipfile.ZipFile(archive, "w") as target:
        target.writestr("one.xml", "<mujoco/>")
        target.writestr("two.xml", "<mujoco/>")
    with pytest.raises(SceneError, match=r"must hold one MJCF file.*one\.xml, two\.xml"):
        load_scene(archive)
    with zipfile.ZipFile(archive, "w") as target:
        target.writestr("readme.txt", "nothing")
    with pytest.raises(SceneError, match="it has none"):
        load_scene(archive)
    binary.write_bytes(b"no model")
    with pytest.raises(SceneError, match="no model compiled by MuJoCo"):
        load_scene(binary)


PLAIN = f"""<mujoco>{SPACE}<worldbody>{SITES}
  <geom name="post_0" type="cylinder" size="0.1 1" pos="0 -0.9 1" margin="0.02"/>
  <geom name="post_1" type="cylinder" size="0.1 1" pos="0 0 1" margin="0.02"/>
  <geom name="post_2" type="cylinder" size="0.1 1" pos="0 0.9 1" margin="0.02"/>
</worldbody></mujoco>"""
DEFAULTS = (
    '<default><geom margin="0.02"/>'
    '<default class="post"><geom type="cylinder" size="0.1 1"/></default></default>'
)
WAYS = {
    "default class": PLAIN.replace(' type="cylinder" size="0.1 1"', "")
    .replace(' margin="0.02"/>', "/>")
    .replace("<worldbody>", DEFAULTS + '<worldbody><body childclass="post">')
    .replace("</worldbody>", "</body></worldbody>"),
    "frame": f"""<mujoco>{SPACE}{DEFAULTS}<worldbody>{SITES}<frame euler="0 0 90" pos="0 0 1">
      <geom name="post_0" class="post" pos="-0.9 0 0"/><geom name="post_1" class="post"/>
      <geom name="post_2" class="post" pos="0.9 0 0"/></frame></worldbody></mujoco>""",
    "replicate": f"""<mujoco>{SPACE}{DEFAULTS}<worldbody>{SITES}
      <replicate count="3" offset="0 0.9 0" sep="_">
      <geom name="post" class="post" pos="0 -0.9 1"/></replicate></worldbody></mujoco>""",
    "include": f"""<mujoco>{SPACE}{DEFAULTS}<worldbody>{SITES}<include file="posts.xml"/>
      </worldbody></mujoco>""",
    "attach": f"""<mujoco>{SPACE}<asset><model name="child" file="child.xml"/></asset>
      <worldbody>{SITES}<attach model="child" body="posts" prefix="post"/></worldbody></mujoco>""",
    "gap": PLAIN.replace('margin="0.02"', 'margin="0.02" gap="0.5"'),
    "keyframe": PLAIN.replace(
        "</mujoco>", '<keyframe><key name="k" time="3"/></keyframe></mujoco>'
    ),
}
POSTS = "".join(f'<geom name="{{}}_{i}" class="post" pos="0 {0.9 * (i - 1)} 1"/>' for i in range(3))


@pytest.mark.parametrize("way", WAYS)
def test_every_way_to_say_it_is_the_same_world(tmp_path: Path, way: str) -> None:
    (tmp_path / "posts.xml").write_text(f"<mujoco>{POSTS.format(*['post'] * 3)}</mujoco>")
    (tmp_path / "child.xml").write_text(
        f"<mujoco>{DEFAULTS}<worldbody><body name='posts'>{POSTS.format(*[''] * 3)}</body>"
        "</worldbody></mujoco>"
    )
    scenes = []
    for name, text in (("plain.xml", PLAIN), ("way.xml", WAYS[way])):
        file = tmp_path / name
        file.write_text(text)
        scenes.append(load_scene(file))
    same_obstacles(*scenes)


@pytest.mark.parametrize("scale", ["1 1 1", "-1 1 1", "-0.5 2 -1.5", "1 1 -1"])
def test_mirrored_and_scaled_meshes(tmp_path: Path, scale: str) -> None:
    vertices = np.array([[0, 0, 0], [0.5, 0, 0], [0, 0.4, 0], [0, 0.1, 0.6]])
    text = " ".join(f"{value:g}" for value in vertices.ravel())
    file = tmp_path / "scene.xml"
    file.write_text(f"""<mujoco>{SPACE}
      <asset><mesh name="m" vertex="{text}" scale="{scale}"/></asset><worldbody>
      {SITES}<geom type="mesh" mesh="m" pos="0.2 -0.1 1" euler="0 0 90"/></worldbody>
      </mujoco>""")
    scene = load_scene(file, tolerance=0.01)
    x, y, z = (vertices * np.array(scale.split(), float)).T
    world = np.column_stack([0.2 - y, -0.1 + x, 1.0 + z])  # turned by 90 degrees about z
    grow = scene.radius + scene.clearance
    directions = np.random.default_rng(1).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    exact = (directions @ world.T).max(axis=1) + grow
    found = (directions @ scene.obstacles[0].vertices().T).max(axis=1)
    assert (found >= exact - 1e-6).all()
    assert (found <= exact + 0.0101).all()


@pytest.mark.parametrize(
    ("geom", "fits"),
    [('type="box"', "0.25 0.2 0.3"), ('type="ellipsoid" fitscale="1.1"', None)],
)
def test_primitives_fitted_to_meshes(tmp_path: Path, geom: str, fits: str | None) -> None:
    """MuJoCo turns the mesh into a primitive when it compiles: that is what is read."""
    file = tmp_path / "scene.xml"
    cube = " ".join(f"{a} {b} {c}" for a in (-0.25, 0.25) for b in (-0.2, 0.2) for c in (-0.3, 0.3))
    file.write_text(f"""<mujoco>{SPACE}<compiler fitaabb="true"/>
      <asset><mesh name="m" vertex="{cube}"/></asset>
      <worldbody>{SITES}<geom {geom} mesh="m" pos="0 0 1"/></worldbody></mujoco>""")
    scene = load_scene(file)
    assert scene.geoms[0].type == geom.split('"')[1]
    assert scene.geoms[0].role == "obstacle"
    if fits:
        size = np.sort(scene.model.geom_size[0])
        np.testing.assert_allclose(size, np.sort(np.array(fits.split(), float)), atol=1e-6)


def test_pairs_and_excludes_decide_what_is_an_obstacle(tmp_path: Path) -> None:
    file = tmp_path / "scene.xml"
    file.write_text(f"""<mujoco>{SPACE}<worldbody>{SITES}
      <geom name="ghost" type="box" size="0.1 0.1 1" pos="0 1 1" contype="0" conaffinity="0"/>
      <geom name="paired" type="box" size="0.1 0.1 1" pos="0 0 1" contype="0" conaffinity="0"/>
      <body name="let_through"><geom name="gate" type="box" size="0.1 0.1 1" pos="0 -1 1"/></body>
      <body name="robot" pos="-2 0 1"><freejoint name="j"/><geom name="shell" size="0.1"/></body>
      </worldbody><contact><pair geom1="paired" geom2="shell" margin="0.3"/>
      <exclude body1="let_through" body2="robot"/></contact></mujoco>""")
    scene = load_scene(file, "robot", tolerance=0.01)
    roles = {report.name: report.role for report in scene.geoms}
    assert roles == {"ghost": "ignored", "paired": "obstacle", "gate": "ignored", "shell": "body"}
    reach = scene.obstacles[0].vertices()[:, 0].max()
    assert reach == pytest.approx(0.1 + 0.1 + 0.05 + 0.3, abs=1e-6)
