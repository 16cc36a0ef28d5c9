"""Meshes as they come: repaired, measured, and refused or told about in one line."""

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.errors import QueryError, SceneError
from hzmp_sim.scene import Scene, load_scene
from hzmp_sim.scene.mesh_size import MAX_FACES

BOX = trimesh.creation.box((1.0, 1.0, 1.0))
V, F = np.array(BOX.vertices), np.array(BOX.faces)
WORLD = """<mujoco>
  <custom><numeric name="workspace" data="-3 -3 -2 3 3 2"/></custom>
  <asset><mesh name="rock" file="{file}"/></asset>
  <worldbody>
    <site name="start" pos="-2 0 0"/><site name="goal" pos="2 0 0"/>
    <geom name="rock" type="mesh" mesh="rock"/>
  </worldbody>
</mujoco>"""


def obj(vertices: Floats, faces: Ints) -> str:
    lines = [f"v {x:g} {y:g} {z:g}" for x, y, z in vertices]
    return "\n".join(lines + [f"f {a} {b} {c}" for a, b, c in faces + 1]) + "\n"


def load(folder: Path, text: str, start: tuple[float, float, float] | None = None) -> Scene:
    folder.mkdir(exist_ok=True)
    (folder / "rock.obj").write_text(text)
    (folder / "scene.xml").write_text(WORLD.format(file="rock.obj"))
    return load_scene(folder / "scene.xml", "quadrotor", start=start)


def dented() -> tuple[Floats, Ints]:
    """A box whose top is pressed in to a pyramid: half of its height in the middle."""
    top = np.flatnonzero((V[F][:, :, 2] > 0.0).all(axis=1))
    ring = [4 * (V[:, 0] > 0) + 2 * (V[:, 1] > 0) + (V[:, 2] > 0)]
    corner = {int(code): i for i, code in enumerate(ring[0])}
    loop = [corner[1], corner[5], corner[7], corner[3]]
    sides = [[loop[i], loop[(i + 1) % 4], len(V)] for i in range(4)]
    return np.vstack([V, [[0.0, 0.0, 0.0]]]), np.vstack([np.delete(F, top, axis=0), sides])


def test_good_convex_mesh_is_measured_without_a_word(tmp_path: Path) -> None:
    scene = load(tmp_path, obj(V, F))
    (mesh,) = scene.meshes
    assert (mesh.name, mesh.faces, mesh.flaws, mesh.convex) == ("rock", 12, (), True)
    assert mesh.volume == pytest.approx(1.0)
    assert mesh.hull_volume == pytest.approx(1.0)
    assert mesh.geoms == scene.obstacle_geoms
    assert scene.warnings == ()


def test_split_vertices_and_repeated_faces_are_joined(tmp_path: Path) -> None:
    """As exporters write them: every triangle with corners of its own, and one twice."""
    soup = V[np.vstack([F, F[:1]])].reshape(-1, 3)
    scene = load(tmp_path, obj(soup, np.arange(len(soup)).reshape(-1, 3)))
    assert scene.meshes[0].volume == pytest.approx(1.0)
    assert scene.meshes[0].flaws == ()


@pytest.mark.parametrize(
    ("faces", "flaw", "volume"),
    [
        (F[:-2], "open", None),
        (F[:, ::-1], "inside out", 1.0),
        (np.vstack([F[:4, ::-1], F[4:]]), "turned both ways", None),
        (np.vstack([F, [[0, 1, 1]]]), "with faces of no area", 1.0),
    ],
)
def test_flaws_are_told_and_the_hull_is_safe_all_the_same(
    tmp_path: Path, faces: Ints, flaw: str, volume: float | None
) -> None:
    scene = load(tmp_path, obj(V, faces))
    (mesh,) = scene.meshes
    assert mesh.flaws == (flaw,)
    assert mesh.volume == (None if volume is None else pytest.approx(volume))
    assert mesh.hull_volume == pytest.approx(1.0)
    if flaw == "with faces of no area":
        assert scene.warnings == ()  # every exporter leaves some
    else:
        told = [text for text in scene.warnings if text.startswith(f"meshes that are {flaw}: rock")]
        assert len(told) == 1
    whole = load(tmp_path / "whole", obj(V, F))  # MuJoCo remembers files by path and second
    np.testing.assert_allclose(scene.obstacles[0].vertices(), whole.obstacles[0].vertices())


@pytest.mark.parametrize("opened", [False, True])
def test_dent_is_told_with_both_volumes(tmp_path: Path, opened: bool) -> None:
    vertices, faces = dented()
    scene = load(tmp_path, obj(vertices, faces[1:] if opened else faces))
    (mesh,) = scene.meshes
    assert not mesh.convex
    volume = "volume of the mesh unknown" if opened else "mesh 0.833 m^3"
    assert scene.warnings[-1] == (
        f"treated as convex hulls, as MuJoCo does: mesh 'rock' (hull 1 m^3, {volume}); "
        "--convex-decomposition cuts them into convex pieces"
    )


@pytest.mark.parametrize("opened", [False, True])
def test_round_mesh_is_convex_though_its_facets_are_flat(tmp_path: Path, opened: bool) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.7)
    faces = np.array(ball.faces)
    scene = load(tmp_path, obj(np.array(ball.vertices), faces[1:] if opened else faces))
    assert scene.meshes[0].convex


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "at least 4 vertices"),
        (obj(V * [1, 1, 0], F), "coplanar"),
        (obj(V * [1, 0, 0], F), "collinear"),
        (obj(V * 1e-9, F), "too small"),
        (obj(V, F + 3), "does not exist"),
        (obj(V, F).replace("v 0.5", "v nan", 1), "not finite"),
    ],
)
def test_meshes_without_a_body_are_refused_in_one_line(
    tmp_path: Path, text: str, says: str
) -> None:
    with pytest.raises(SceneError, match=says) as caught:
        load(tmp_path, text)
    assert "rock" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", ["obj", "stl"])
def test_enormous_mesh_is_refused_before_it_is_read(tmp_path: Path, kind: str) -> None:
    file = tmp_path / f"rock.{kind}"
    if kind == "obj":
        file.write_bytes(obj(V, F[:0]).encode() + b"f 1 2 3\n" * (MAX_FACES + 1))
    else:
        file.write_bytes(bytes(80) + struct.pack("<I", MAX_FACES + 1) + bytes(8 * MAX_FACES))
    (tmp_path / "scene.xml").write_text(WORLD.format(file=file.name))
    with pytest.raises(SceneError) as caught:
        load_scene(tmp_path / "scene.xml", "quadrotor")
    assert f"mesh 'rock' (rock.{kind}) has 1,000,001 faces" in str(caught.value)


def test_start_inside_a_hull_but_not_in_its_mesh_is_explained(tmp_path: Path) -> None:
    with pytest.raises(QueryError) as caught:
        load(tmp_path, obj(*dented()), start=(0.0, 0.0, 0.5))
    text = str(caught.value)
    assert "start (0, 0, 0.5) is" in text
    assert "inside obstacle rock" in text
    assert "mesh 'rock' is treated as its convex hull, as MuJoCo does (hull 1 m^3, mesh 0" in text
    assert "--convex-decomposition" in text
    with pytest.raises(QueryError) as caught:
        load(tmp_path / "whole", obj(V, F), start=(0.0, 0.0, 0.5))
    assert "hull" not in str(caught.value)
