"""Meshes with a doorway: blocked as hulls, with the reason said, and flown through as pieces."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from command_line import exit_code
from trimesh.creation import extrude_triangulation

import hzmp_sim as hz

# Across the workspace, from wall to wall and floor to ceiling; a doorway 1 m wide and 1.4 m high.
WALL = np.array([(-2.5, 0), (-0.5, 0), (-0.5, 1.4), (0.5, 1.4), (0.5, 0), (2.5, 0), (2.5, 2),
                 (-2.5, 2)])  # fmt: skip
WALL_FACES = np.array([(0, 1, 2), (0, 2, 7), (2, 3, 7), (3, 6, 7), (3, 4, 5), (3, 5, 6)])
WORLD = """<mujoco>
  <custom><numeric name="workspace" data="-3 -2.5 0 3 2.5 2"/></custom>
  <asset><mesh name="wall" file="wall.obj" refquat="0.5 -0.5 -0.5 -0.5"/></asset>
  <worldbody>
    <geom name="wall" type="mesh" mesh="wall"/>
    <site name="start" pos="-2 -1 1"/><site name="goal" pos="2 1 1"/>
    {more}
  </worldbody>
</mujoco>"""
OTHER_WALL = '<geom name="other" type="box" size="0.1 2.5 1" pos="1 0 1"/>'


@pytest.fixture(scope="module", autouse=True)
def cache_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def wall(tmp_path: Path) -> Path:
    """A world whose two halves only the doorway of a mesh joins."""
    extrude_triangulation(WALL, WALL_FACES, 0.2).export(tmp_path / "wall.obj")
    file = tmp_path / "scene.xml"
    file.write_text(WORLD.format(more=""))
    return file


def test_goal_in_a_room_is_refused_with_the_reason(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code("run", "mesh_room", "--body", "quadrotor") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "goal (0.8, 0.5, 0.9)" in line
    assert "mesh 'room' is treated as its convex hull, as MuJoCo does" in line
    assert "--convex-decomposition" in line


def test_wall_is_proved_to_block_with_the_reason(
    wall: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    reason = "mesh 'wall' (hull 2 m^3, mesh 1.72 m^3) is treated as its convex hull"
    assert exit_code("plan", str(wall), "--json") == 3
    plan = json.loads(capsys.readouterr().out)
    assert plan["verified"]
    assert reason in plan["blocked_by"]
    run = hz.simulate(hz.load_scene(wall, "quadrotor"))
    assert run.metrics["status"] == "infeasible"
    assert reason in run.metrics["warnings"][-1]


def test_hulls_are_not_blamed_for_what_they_do_not_block(wall: Path) -> None:
    wall.write_text(WORLD.format(more=OTHER_WALL))
    scene = hz.load_scene(wall, "quadrotor")
    run = hz.simulate(scene)
    assert run.metrics["status"] == "infeasible"
    assert run.metrics["warnings"] == list(scene.warnings)


@pytest.mark.parametrize("body", ["point", "quadrotor"])
def test_doorway_is_flown_through(wall: Path, body: str) -> None:
    scene = hz.load_scene(wall, body, convex_decomposition=True)
    run = hz.simulate(scene)
    assert run.metrics["status"] == "goal_reached"
    assert run.metrics["collision_steps"] == 0
    assert run.metrics["decomposed_meshes"][0]["pieces"] == scene.pieces[0].pieces >= 3
    assert run.log is not None
    at_wall = np.abs(run.log.position[:, 0]) < 0.1
    assert at_wall.any()
    assert (np.abs(run.log.position[at_wall, 1]) < 0.5).all()
    assert (run.log.position[at_wall, 2] < 1.4).all()


def test_room_is_flown_into(tmp_path: Path) -> None:
    scene = hz.load_scene("mesh_room", "quadrotor", convex_decomposition=True)
    run = hz.simulate(scene)
    m = run.metrics
    assert (m["status"], m["collision_steps"]) == ("goal_reached", 0)
    assert m["optimality_gap"] <= 1.1e-3
    (report,) = m["decomposed_meshes"]
    assert report["mesh"]["hull_volume"] == pytest.approx(24.0)
    assert report["mesh"]["volume"] == pytest.approx(5.0)
    assert 5.0 < report["volume"] < 5.2
    (tmp_path / "scene.xml").write_text(scene.xml)  # as a run writes it
    again = hz.load_scene(tmp_path / "scene.xml")
    assert again.warnings == ()
    assert len(again.obstacles) == m["obstacles"]


def test_inspect_lists_meshes_pieces_and_the_widest_body(
    wall: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert exit_code("inspect", str(wall), "--json") == 0
    whole = json.loads(capsys.readouterr().out)
    assert (whole["meshes"][0]["name"], whole["meshes"][0]["convex"]) == ("wall", False)
    assert any("mesh 'wall' (hull 2 m^3, mesh 1.72 m^3)" in text for text in whole["warnings"])
    assert whole["widest_body"]["radius_m"] is None
    assert exit_code("inspect", str(wall), "--json", "--convex-decomposition") == 0
    cut = json.loads(capsys.readouterr().out)
    assert cut["decomposed_meshes"][0]["mesh"]["name"] == "wall"
    # The doorway is 1 m wide, with 0.05 m of clearance on both sides; pieces grow by a millimetre.
    assert 0.447 <= cut["widest_body"]["radius_m"] <= 0.45
    assert exit_code("inspect", str(wall)) == 0
    out = capsys.readouterr().out
    assert "error [mm]" in out
    assert "start and goal are not connected for this body" in out
