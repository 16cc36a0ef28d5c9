"""Pictures and recordings of `hzmp-sim inspect`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import exit_code
from matplotlib.image import imread
from rerun.chunk import RrdReader

from hzmp_sim.output.leaf_figure import write_leaf_picture
from hzmp_sim.output.recorded_space import EXPLODE_PERCENT, write_space
from hzmp_sim.scene import load_scene
from recordings import recorded, verify_recording


def command(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    code = exit_code("inspect", *words)
    said = capsys.readouterr()
    return code, said.out, said.err


def test_picture_and_recording_are_written_and_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture, recording = tmp_path / "new" / "maze.png", tmp_path / "maze.rrd"
    code, out, err = command(
        capsys, "maze", "--picture", str(picture), "--explode", "0.2", "--rrd", str(recording)
    )
    assert (code, err) == (0, "")
    assert out.splitlines()[-2:] == [f"picture   {picture}", f"recording {recording}"]
    assert sorted(path.name for path in tmp_path.rglob("*") if path.is_file()) == [
        "maze.png",
        "maze.rrd",
    ]
    image = np.asarray(imread(picture))
    assert image.shape[1] == 1040
    assert len(np.unique(image.reshape(-1, image.shape[2]), axis=0)) > 50


def test_recording_in_space_moves_the_leaves_apart(tmp_path: Path) -> None:
    scene = load_scene("narrow_passage", body="quadrotor")
    space, path = scene.free_space(), tmp_path / "passage.rrd"
    write_space(scene, space, path)
    verify_recording(path)
    assert recorded(path, "/space/cells", "explode") == list(EXPLODE_PERCENT)
    steps = [np.array(rows) for rows in recorded(path, "/space/cells", "Mesh3D:vertex_positions")]
    corners = sum(
        int(on.sum()) for leaf in space.leaves for on in leaf.incidence.T if on.sum() >= 3
    )
    assert {step.shape for step in steps} == {(corners, 3)}
    (triangles,) = recorded(path, "/space/cells", "Mesh3D:triangle_indices")
    rows = np.array(triangles)
    for percent, points in zip(EXPLODE_PERCENT, steps, strict=True):
        a, b, c = (points[rows[:, i]] for i in range(3))
        volume = float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
        assert volume == pytest.approx(space.volume / (1.0 + percent / 100) ** 3, rel=1e-4)
    (colours,) = recorded(path, "/space/cells", "Mesh3D:vertex_colors")
    assert len(colours) == corners
    (strips, *_) = recorded(path, "/space/leaves", "LineStrips3D:strips")
    assert len(strips) == sum(len(leaf.vertices()) * 3 // 2 for leaf in space.leaves)
    entities = {chunk.entity_path for chunk in RrdReader(path).stream()}
    assert {"/space/faces", "/space/grown_obstacles", "/world/boxes", "/plan/ends"} <= entities


def test_recording_of_a_planar_world_lies_at_the_height_of_the_body(tmp_path: Path) -> None:
    scene = load_scene("enclosure", body="point")
    space, path = scene.free_space(), tmp_path / "room.rrd"
    write_space(scene, space, path)
    steps = recorded(path, "/space/cells", "Mesh3D:vertex_positions")
    assert scene.height is not None
    assert len(steps) == len(EXPLODE_PERCENT)
    for step in steps:
        points = np.array(step)
        assert len(points) == sum(len(leaf.vertices()) for leaf in space.leaves)
        np.testing.assert_allclose(points[:, 2], scene.height, atol=1e-6)


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_the_ending_chooses_the_format_and_pictures_are_reproducible(
    tmp_path: Path, ending: str
) -> None:
    scene = load_scene("narrow_passage")
    space = scene.free_space()
    one, two = tmp_path / f"one.{ending}", tmp_path / f"two.{ending}"
    for path in (one, two):
        write_leaf_picture(scene, space, path, explode=0.4)
    starts = {"png": b"\x89PNG", "svg": b"<?xml"}
    assert one.read_bytes().startswith(starts[ending])
    assert one.read_bytes() == two.read_bytes()


@pytest.mark.parametrize("option", ["--picture", "--rrd"])
def test_a_file_that_cannot_be_written_is_one_line_and_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str
) -> None:
    blocker = tmp_path / "file"
    blocker.write_text("in the way")
    folder = tmp_path / "folder.png"
    folder.mkdir()
    for path in (blocker / "below" / "x.png", folder):
        code, out, err = command(capsys, "enclosure", option, str(path))
        assert (code, out) == (2, "")
        assert err.startswith("hzmp-sim: error: ")
        assert str(path) in err
        assert err.count("\n") == 1
    assert blocker.read_text() == "in the way"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder.png"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--picture", "x.doc"], "must end in one of"),
        (["--picture", "x.png", "--explode", "-1"], "explode must be"),
        (["--explode", "0.2"], "--picture"),
    ],
)
def test_wrong_settings_are_one_line_and_exit_code_2(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    told: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = command(capsys, "enclosure", *words)
    assert (code, out) == (2, "")
    assert told in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_json_stays_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "room.svg"
    code, out, _ = command(capsys, "enclosure", "--json", "--picture", str(path))
    assert code == 0
    assert json.loads(out)["leaves"] > 0
    assert path.exists()
