"""Worlds of others say no workspace: what is guessed must not be what blocks the way."""

from pathlib import Path

import numpy as np
import pytest

from hzmp_planners import planning
from hzmp_planners.errors import QueryError, SceneError
from hzmp_sim.scene import load_scene


def write(folder: Path, world: str) -> Path:
    file = folder / "world.xml"
    file.write_text(f"<mujoco><worldbody>{world}</worldbody></mujoco>")
    return file


FLOOR = '<geom name="floor" type="plane" size="0 0 1"/>'
CRATE = '<geom name="crate" type="box" pos="0 0 0.5" size="0.5 0.5 0.5"/>'


def test_a_guess_holds_start_and_goal(tmp_path: Path) -> None:
    """Only a crate on an endless floor, and a query far beside and above it."""
    scene = load_scene(write(tmp_path, FLOOR + CRATE), "quadrotor", (-4, 1, 2.0), (3, -2, 0.4))
    lo, hi = scene.workspace
    assert (lo < [-4.0, -2.0, 0.0]).tolist() == [True, True, False]
    assert (hi > [3.0, 1.0, 2.0]).all()
    assert lo[2] == 0.0, "below the floor there is nothing to plan in"
    assert "start and goal with room around, (" in scene.warnings[0]


@pytest.mark.parametrize("body", ["point", "quadrotor"])
@pytest.mark.parametrize("tolerance", [None, 0.4])
def test_the_border_of_a_guess_blocks_nothing(
    tmp_path: Path, body: str, tolerance: float | None
) -> None:
    """A wall as wide and as high as all there is: the way around it is outside its own box."""
    wall = '<geom name="wall" type="ellipsoid" pos="0 0 1" size="0.3 2 1.2"/>'
    scene = load_scene(
        write(tmp_path, FLOOR + wall), body, (-2, 0, 0.5), (2, 0, 0.6), tolerance=tolerance
    )
    assert planning.plan(scene.free_space(), scene.start, scene.goal).cost < 10.0


def test_a_planar_body_may_stand_below_the_guess(tmp_path: Path) -> None:
    """Point mazes: walls from z = 0 up, and a ball that slides with its centre at z = 0."""
    walls = """
      <geom type="plane" size="9 9 1" pos="0 0 -0.1" contype="1" conaffinity="0"/>
      <geom name="wall" type="box" pos="0 0 0.2" size="0.5 2 0.2"/>
      <body name="ball">
        <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
        <geom name="ball" size="0.1"/>
      </body>
    """
    scene = load_scene(write(tmp_path, walls), "ball", (-2, 0), (2, 0))
    assert (scene.n, len(scene.obstacles)) == (2, 1)
    (warning,) = scene.warnings
    assert warning.endswith("(-2.5625, -2.5625) to (2.5625, 2.5625)"), "in its plane only"


def test_a_workspace_that_was_said_is_kept(tmp_path: Path) -> None:
    file = write(tmp_path, FLOOR + CRATE)
    said = ((-2, -2, 0), (2, 2, 1.5))
    scene = load_scene(file, "quadrotor", (-1.5, 0, 0.5), (1.5, 0, 0.5), said)
    np.testing.assert_allclose(scene.workspace, said)
    assert scene.warnings == ()
    with pytest.raises(QueryError, match="outside the workspace"):
        load_scene(file, "quadrotor", (-4, 0, 0.5), (1.5, 0, 0.5), said)


def test_nothing_to_guess_from_says_what_to_give(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="--workspace X0 Y0 Z0 X1 Y1 Z1"):
        load_scene(write(tmp_path, FLOOR), "point", (0, 0, 1), (1, 0, 1))
