"""Non-convex meshes as convex pieces: they cover the mesh, and physics and planner share them."""

import shutil
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import HzmpError, QueryError, SceneError
from hzmp_sim.scene import ConvexDecomposition, Scene, load_scene
from hzmp_sim.scene.decomposition import cache
from hzmp_sim.scene.decomposition.coacd_process import run_coacd
from hzmp_sim.scene.decomposition.cover import cover_surface, outside, surface_points
from hzmp_sim.scene.geoms import mesh_points
from hzmp_sim.scene.meshes import mesh_surface
from hzmp_sim.scene.shapes import Hull

# An L of two bars, 2 x 2 x 0.5 m, its notch at (1.25, 1.25).
L_SHAPE = """v 0 0 0\nv 2 0 0\nv 2 .5 0\nv .5 .5 0\nv .5 2 0\nv 0 2 0
v 0 0 .5\nv 2 0 .5\nv 2 .5 .5\nv .5 .5 .5\nv .5 2 .5\nv 0 2 .5
f 1 3 2\nf 1 4 3\nf 1 5 4\nf 1 6 5\nf 7 8 9\nf 7 9 10\nf 7 10 11\nf 7 11 12
f 1 2 8\nf 1 8 7\nf 2 3 9\nf 2 9 8\nf 3 4 10\nf 3 10 9\nf 4 5 11\nf 4 11 10
f 5 6 12\nf 5 12 11\nf 6 1 7\nf 6 7 12
"""
WORLD = """<mujoco>
  <custom><numeric name="workspace" data="-3 -3 -1 3 3 2"/></custom>
  {head}
  <asset><mesh name="angle" file="angle.obj" scale="1 1 1.2"/></asset>
  <worldbody>
    <site name="start" pos="-2.5 -2.5 0"/><site name="goal" pos="1.1 1.2 0.3"/>
    {geoms}
  </worldbody>
  {tail}
</mujoco>"""
GEOM = '<geom name="angle" type="mesh" mesh="angle"/>'


@pytest.fixture(scope="module", autouse=True)
def cache_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setenv("XDG_CACHE_HOME", str(folder))
        yield folder


def write(folder: Path, geoms: str = GEOM, head: str = "", tail: str = "") -> Path:
    (folder / "angle.obj").write_text(L_SHAPE)
    file = folder / "scene.xml"
    file.write_text(WORLD.format(geoms=geoms, head=head, tail=tail))
    return file


def load(file: Path, goal: tuple[float, float, float] | None = None) -> Scene:
    return load_scene(file, "quadrotor", goal=goal, convex_decomposition=True)


def posed(scene: Scene) -> mujoco.MjData:
    data = mujoco.MjData(scene.model)
    data.qpos[:] = scene.initial_qpos
    mujoco.mj_kinematics(scene.model, data)
    return data


def corners(scene: Scene, geom: int) -> Floats:
    """Corners of a mesh geom as MuJoCo collides it, in the world."""
    data = posed(scene)
    turn = data.geom_xmat[geom].reshape(3, 3)
    return np.asarray(mesh_points(scene.model, geom) @ turn.T + data.geom_xpos[geom])


def test_goal_in_the_notch_is_free_only_with_pieces(tmp_path: Path) -> None:
    file = write(tmp_path)
    with pytest.raises(QueryError, match="inside obstacle angle"):
        load_scene(file, "quadrotor")
    scene = load(file)
    (report,) = scene.pieces
    assert (report.mesh.name, report.pieces) == ("angle", len(scene.obstacles))
    assert report.pieces >= 2
    assert report.mesh.volume is not None
    assert report.mesh.volume == pytest.approx(1.75 * 0.6)
    assert report.mesh.hull_volume == pytest.approx(2.875 * 0.6)
    assert report.mesh.volume <= report.volume <= 1.1 * report.mesh.volume
    assert report.describe().startswith(f"mesh 'angle' cut into {report.pieces} convex pieces")
    roles = {geom.name: geom for geom in scene.geoms}
    assert roles["angle"].role == "ignored"
    assert roles["angle"].reason == "its convex pieces collide in its place"
    assert roles["angle_piece_1"].role == "obstacle"


FRAMES = """<frame pos="0.2 -0.1 0.4" euler="0 0 40">
  <body name="shelf" pos="-0.4 0.3 0" axisangle="1 0 0 25">
    <geom name="angle" type="mesh" mesh="angle" pos="-0.5 0 0"/>
  </body></frame>"""


@pytest.mark.parametrize("head", ["", '<default><geom euler="10 20 30" margin="0.1"/></default>'])
@pytest.mark.parametrize("geoms", [GEOM, FRAMES])
def test_pieces_of_the_flown_world_cover_the_mesh(tmp_path: Path, geoms: str, head: str) -> None:
    """Every sampled point of the mesh's surface, where the written world shows it, is in a piece,
    and every corner of a piece is near the mesh."""
    scene = load(write(tmp_path, geoms, head), goal=(2.5, -2.5, 1.5))
    pieces = [corners(scene, geom) for geom in scene.obstacle_geoms]
    angle = scene.model.geom("angle").id
    surface = mesh_surface(scene.model, int(scene.model.geom_dataid[angle]))[0]
    data = posed(scene)
    turn = data.geom_xmat[angle].reshape(3, 3)
    rng = np.random.default_rng(1)
    weights = rng.dirichlet(np.ones(3), (len(surface.faces), 2000))
    points = np.einsum("fkc,fcx->fkx", weights, surface.triangles).reshape(-1, 3)
    points = np.vstack([points, surface.vertices]) @ turn.T + data.geom_xpos[angle]
    assert outside(points, [Hull.from_points(piece) for piece in pieces]).max() <= 0.0
    whole = Hull.from_points(corners(scene, angle))
    (report,) = scene.pieces
    assert 0.0 < report.growth < 2e-3
    assert outside(np.vstack(pieces), [whole]).max() <= 3.0 * report.growth
    margin = scene.model.geom_margin[list(scene.obstacle_geoms)]
    assert (margin == (0.1 if head else 0.0)).all()


def test_planner_and_mujoco_see_the_same_pieces(tmp_path: Path) -> None:
    scene = load(write(tmp_path))
    data = posed(scene)
    centres = np.random.default_rng(2).uniform(-0.5, 2.5, (1500, 3)) * [1.0, 1.0, 0.4]
    blocked = np.array([piece.violation(centres) < 0.0 for piece in scene.obstacles]).any(axis=0)
    assert 200 < blocked.sum() < 1300
    for centre in centres[~blocked]:
        data.qpos[:3] = centre
        mujoco.mj_forward(scene.model, data)
        assert not (np.array([contact.dist for contact in data.contact]) < 0.0).any()
        for mine in scene.body_geoms:
            for piece in scene.obstacle_geoms:
                distance = mujoco.mj_geomDistance(scene.model, data, mine, piece, 1.0, None)
                assert distance >= scene.clearance - 1e-6


def test_written_world_holds_the_pieces_and_needs_no_other_file(tmp_path: Path) -> None:
    scene = load(write(tmp_path))
    (tmp_path / "angle.obj").unlink()
    (tmp_path / "again").mkdir()
    file = tmp_path / "again" / "scene.xml"
    file.write_text(scene.xml)
    again = load_scene(file)
    assert (again.pieces, again.body) == ((), "quadrotor")
    assert len(again.obstacles) == len(scene.obstacles)
    for one, two in zip(again.obstacles, scene.obstacles, strict=True):
        np.testing.assert_array_equal(one.vertices(), two.vertices())


def test_explicit_pairs_go_to_the_pieces(tmp_path: Path) -> None:
    drone = '<body name="drone" pos="-2.5 -2.5 0"><freejoint/><geom name="ball" size="0.1"/></body>'
    geoms = GEOM.replace("/>", ' contype="0" conaffinity="0"/>') + drone
    pair = '<contact><pair geom1="angle" geom2="ball" margin="0.2" condim="1"/></contact>'
    scene = load_scene(write(tmp_path, geoms, tail=pair), "drone", convex_decomposition=True)
    model = scene.model
    assert len(scene.obstacles) == scene.pieces[0].pieces == len(model.pair_geom1)
    assert set(model.pair_geom1) | set(model.pair_geom2) >= set(scene.obstacle_geoms)
    assert (model.pair_margin == 0.2).all()
    assert (model.pair_dim == 1).all()


def test_convex_meshes_and_the_body_are_left_alone(tmp_path: Path) -> None:
    head = '<asset><mesh name="tent" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset>'
    geoms = """<geom type="mesh" mesh="tent"/>
      <body name="drone" pos="-2 -2 0"><freejoint/>
        <geom type="mesh" mesh="angle" pos="-1 -1 0" mass="1"/></body>"""
    file = write(tmp_path, geoms, head)
    space = (-9, -9, -9), (9, 9, 9)
    scene = load_scene(
        file, "drone", goal=(-5.0, -5.0, 0.0), workspace=space, convex_decomposition=True
    )
    assert scene.pieces == ()
    assert scene.model.ngeom == 2


def test_names_that_are_taken_are_not_used_again(tmp_path: Path) -> None:
    taken = '<geom name="angle_piece_1" size="0.1" pos="-1 -1 0"/>'
    scene = load(write(tmp_path, GEOM + taken + '<geom type="mesh" mesh="angle" pos="-3 0 0"/>'))
    names = {scene.geom_name(geom) for geom in scene.obstacle_geoms}
    assert {"angle__piece_1", "angle_piece_1", "angle___piece_1"} <= names
    assert len(names) == len(scene.obstacles) == 2 * scene.pieces[0].pieces + 1


def test_pieces_are_cached_by_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    file = write(tmp_path)
    first, second = load(file), load(file)
    assert [scene.pieces[0].cached for scene in (first, second)] == [False, True]
    (entry,) = cache.cache_folder().iterdir()
    assert entry.is_relative_to(tmp_path / "cache" / "hzmp-sim")
    for one, two in zip(first.obstacles, second.obstacles, strict=True):
        np.testing.assert_array_equal(one.vertices(), two.vertices())
    other = ConvexDecomposition(threshold=0.2)
    again = load_scene(file, "quadrotor", convex_decomposition=other)
    assert not again.pieces[0].cached  # other settings
    assert len(list(cache.cache_folder().iterdir())) == 2


@pytest.mark.parametrize("damage", ["truncated", "empty", "text", "other arrays", "flipped"])
def test_damaged_cache_entry_is_rebuilt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: str
) -> None:
    vertices, faces = np.eye(3), np.array([[0, 1, 2]])
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    file = cache.cache_file(vertices, faces, ConvexDecomposition())
    assert cache.cached_pieces(file) is None
    parts = [np.random.default_rng(0).normal(size=(k, 3)) for k in (8, 5)]
    assert cache.keep_pieces(file, parts) == ""
    found = cache.cached_pieces(file)
    assert found is not None
    for one, two in zip(found, parts, strict=True):
        np.testing.assert_array_equal(one, two)
    whole = file.read_bytes()
    if damage == "other arrays":
        np.savez(file, vertices=np.zeros((3, 3)), counts=np.array([4]))
    elif damage == "flipped":
        with zipfile.ZipFile(file) as archive:
            middle = archive.infolist()[0].header_offset + 200
        file.write_bytes(whole[:middle] + bytes([whole[middle] ^ 255]) + whole[middle + 1 :])
    else:
        content = {"truncated": whole[: len(whole) // 2], "empty": b"", "text": b"pieces"}
        file.write_bytes(content[damage])
    assert cache.cached_pieces(file) is None
    cache.keep_pieces(file, parts)
    assert cache.cached_pieces(file) is not None


def test_cache_that_cannot_be_written_is_only_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cache").write_text("a file where a folder should be")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    scene = load(write(tmp_path))
    assert len(scene.obstacles) >= 2
    assert len(scene.warnings) == 1
    assert "cannot be written" in scene.warnings[0]


@pytest.mark.parametrize(
    ("script", "says"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "crashed (signal 11)"),
        ("import time; time.sleep(60)", "no pieces in 0.5 s"),
        ("raise RuntimeError('out of memory')", "failed (RuntimeError: out of memory)"),
        (
            "import sys, numpy; "
            "numpy.savez(sys.argv[3], vertices=numpy.zeros((0, 3)), counts=numpy.zeros(0, int))",
            "found no pieces",
        ),
    ],
)
def test_what_coacd_does_to_a_mesh_is_one_line(tmp_path: Path, script: str, says: str) -> None:
    worker = tmp_path / "worker.py"
    worker.write_text(script)
    limit = 0.5 if "sleep" in script else 60.0
    with pytest.raises(SceneError) as caught:
        run_coacd(
            "rock",
            np.eye(3),
            np.array([[0, 1, 2]]),
            ConvexDecomposition(time_limit=limit),
            worker=worker,
        )
    text = str(caught.value)
    assert "mesh 'rock'" in text
    assert says in text
    assert "\n" not in text


def test_coacd_is_silent_and_stays_out_of_this_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delitem(sys.modules, "coacd", raising=False)
    load(write(tmp_path))
    assert capfd.readouterr() == ("", "")
    assert "coacd" not in sys.modules


@pytest.mark.parametrize(
    "settings",
    [
        {"threshold": 0.001},
        {"threshold": float("nan")},
        {"max_pieces": 0},
        {"mcts_nodes": 0},
        {"mcts_max_depth": 11},
        {"preprocess": "maybe"},
        {"preprocess_resolution": 5},
        {"time_limit": 0.0},
    ],
)
def test_bad_settings_are_refused_by_name(settings: dict[str, Any]) -> None:
    with pytest.raises(HzmpError, match=next(iter(settings))):
        ConvexDecomposition(**settings)


def test_pieces_grow_until_they_cover(tmp_path: Path) -> None:
    """Boxes that miss a centimetre on each side: the leak is found, and closed."""
    model = load_scene(write(tmp_path), "quadrotor", goal=(-2, 2, 0)).model
    surface = mesh_surface(model, 0)[0]
    low, high = surface.bounds
    short = np.array(np.meshgrid(*np.array([low + 0.01, high - 0.01]).T)).reshape(3, -1).T
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1e-12]], dtype=np.float64)
    cover = cover_surface(surface, [short, flat], 1.0)
    assert len(cover.pieces) == 1  # the flat one is dropped: MuJoCo would refuse it
    assert cover.leak == pytest.approx(0.01)
    assert 0.01 < cover.growth < 0.0101
    points = surface_points(surface)
    assert outside(points, [Hull.from_points(cover.pieces[0])]).max() <= 0.0


def test_asset_folder_may_go_after_loading(tmp_path: Path) -> None:
    folder = tmp_path / "world"
    folder.mkdir()
    scene = load(write(folder))
    shutil.rmtree(folder)
    mujoco.MjModel.from_xml_string(scene.xml)
