"""The widest body that gets through, against doorways whose width is known."""

import math
from pathlib import Path

import pytest

from hzmp_sim.scene import Scene, load_scene
from hzmp_sim.scene.passage import RESOLUTION, Passage, widest_body

WORLD = """<mujoco>
  <custom><numeric name="workspace" data="-3 -2 0 3 2 2"/></custom>
  <worldbody>
    <site name="start" pos="-2 0 1"/><site name="goal" pos="2 0 1"/>
    {}
  </worldbody>
</mujoco>"""
RADIUS, CLEARANCE = 0.1, 0.05  # of the point


def wall(low: float, high: float, z: float = 1.0, half: float = 1.0) -> str:
    """A wall across x = 0 from y = low to high."""
    return (
        f'<geom type="box" pos="0 {(low + high) / 2:g} {z}" '
        f'size="0.1 {(high - low) / 2:g} {half}"/>'
    )


def passage(
    folder: Path,
    geoms: str,
    start: tuple[float, float] | None = None,
    goal: tuple[float, float] | None = None,
    clearance: float = CLEARANCE,
) -> tuple[Scene, Passage]:
    file = folder / "scene.xml"
    file.write_text(WORLD.format(geoms))
    scene = load_scene(file, "point", start=start, goal=goal, clearance=clearance)
    return scene, widest_body(scene, scene.free_space())


def check(found: Passage, width: float) -> None:
    """The bracket holds the true extra radius, and is as narrow as promised."""
    assert found.passes is not None
    assert found.passes <= width + 1e-9
    assert width - 1e-9 <= found.blocked <= found.passes + 2.0 * RESOLUTION


@pytest.mark.parametrize("clearance", [0.0, 0.05])
@pytest.mark.parametrize("door", [0.5, 0.9])
def test_door_between_walls(tmp_path: Path, door: float, clearance: float) -> None:
    geoms = wall(-2, -0.3) + wall(door - 0.3, 2)
    scene, found = passage(tmp_path, geoms, clearance=clearance)
    assert scene.n == 2
    check(found, door / 2 - RADIUS - clearance)


def test_widest_of_several_ways_counts(tmp_path: Path) -> None:
    _, found = passage(tmp_path, wall(-2, -1) + wall(-0.6, 0.2) + wall(0.9, 2))
    check(found, 0.35 - RADIUS - CLEARANCE)


def test_way_along_the_workspace(tmp_path: Path) -> None:
    """The workspace bounds the body without clearance: 0.4 m beside the wall."""
    _, found = passage(tmp_path, wall(-2, 1.6))
    check(found, (0.4 - CLEARANCE) / 2 - RADIUS)


def test_window_in_space(tmp_path: Path) -> None:
    """1 m wide and 0.7 m high, between sill and lintel."""
    sides = wall(-2, -0.5) + wall(0.5, 2)
    scene, found = passage(
        tmp_path, sides + wall(-0.5, 0.5, 0.25, 0.25) + wall(-0.5, 0.5, 1.6, 0.4)
    )
    assert scene.n == 3
    check(found, 0.35 - RADIUS - CLEARANCE)


def test_room_at_the_start_counts(tmp_path: Path) -> None:
    _, found = passage(tmp_path, wall(1, 2), start=(-2.7, 0.0))
    check(found, 0.3 - RADIUS)


def test_gap_between_corners_is_bracketed(tmp_path: Path) -> None:
    """Two boxes face each other with their corners, 0.5 m apart along x and along y."""
    boxes = """<geom type="box" pos="-0.25 -1.125 1" size="1 0.875 1"/>
      <geom type="box" pos="1.75 1.125 1" size="0.5 0.875 1"/>"""
    _, found = passage(tmp_path, boxes, goal=(2.0, -0.8))
    apart = 0.5 - 2.0 * (RADIUS + CLEARANCE)  # of the corners as read, grown with sharp edges
    assert found.passes == pytest.approx(apart / 2.0, abs=2.0 * RESOLUTION)
    assert found.blocked == pytest.approx(math.hypot(apart, apart) / 2.0, abs=2.0 * RESOLUTION)
    assert found.blocked >= math.hypot(apart, apart) / 2.0 - 1e-9


def test_closed_world_lets_nothing_through(tmp_path: Path) -> None:
    _, found = passage(tmp_path, wall(-2, 2))
    assert found == Passage(None, 0.0)


def test_empty_world_is_bounded_by_the_workspace(tmp_path: Path) -> None:
    _, found = passage(tmp_path, "")
    check(found, 1.0 - RADIUS)  # start and goal are 1 m from its ends
