"""A painted room around a table: from outside its walls would be all that the picture shows."""

import copy
from pathlib import Path

import mujoco
import numpy as np
import pytest

from hzmp_planners.planning import plan
from hzmp_sim.output.scenery import hide_scenery
from hzmp_sim.output.video import render_frame
from hzmp_sim.run import Run
from hzmp_sim.scene import Scene, load_scene

ROOM = """
<mujoco>
  <custom><numeric name="workspace" data="-1 -1 0 1 1 1.5"/></custom>
  <asset><material name="plaster" rgba="0.9 0.9 0.8 1"/></asset>
  <worldbody>
    {camera}
    <site name="start" pos="-0.7 0 1"/><site name="goal" pos="0.7 0 1.2"/>
    <geom name="floor" type="plane" size="3 3 1"/>
    <geom name="table" type="box" size="0.3 0.3 0.4" pos="0 0 0.4"/>
    <geom name="inside" type="box" size="0.3 0.01 0.2" pos="0 -0.6 1" {visual}/>
    <geom name="east" type="box" size="0.01 2 2" pos="1.6 0 1.5" material="plaster" {visual}/>
    <geom name="south" type="box" size="2 0.01 2" pos="0 -1.6 1.5" material="plaster" {visual}/>
    <geom name="west" type="box" size="0.01 2 2" pos="-1.6 0 1.5" {visual}/>
    <geom name="north" type="box" size="2 0.01 2" pos="0 1.6 1.5" {visual}/>
    <geom name="shell" type="box" size="2 0.01 2" pos="0 -1.5 1.5" group="3" {visual}/>
  </worldbody>
</mujoco>
"""


def room(folder: Path, camera: str = "") -> Scene:
    file = folder / "room.xml"
    visual = 'contype="0" conaffinity="0"'
    file.write_text(ROOM.format(camera=camera, visual=visual))
    return load_scene(file, "point")


@pytest.mark.parametrize(
    ("camera", "gone"),
    [
        ("", {"east", "south"}),  # from the corner that our own camera takes
        ('<camera name="overview" pos="-4 0 1"/>', {"west"}),
        ('<camera name="overview" pos="0 0 4"/>', set()),
    ],
)
def test_walls_before_the_workspace_are_hidden(tmp_path: Path, camera: str, gone: set[str]) -> None:
    scene = room(tmp_path, camera)
    model = copy.copy(scene.model)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    seen = np.array([scene.start, scene.goal])
    hidden = hide_scenery(model, data, scene, 4 / 3, seen)
    assert {scene.geom_name(geom) for geom in hidden} == gone
    for geom in range(model.ngeom):
        shown = scene.model.geom_rgba[geom] if geom not in hidden else np.zeros(4)
        np.testing.assert_array_equal(model.geom_rgba[geom], shown)


def test_an_obstacle_is_shown_even_if_it_hides_the_rest(tmp_path: Path) -> None:
    scene = room(tmp_path, '<camera name="overview" pos="0 0 -1"/>')  # from beneath the table
    model = copy.copy(scene.model)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert hide_scenery(model, data, scene, 4 / 3, np.array([[0.0, 0.0, 1.2]])) == []


@pytest.mark.render
def test_a_world_without_lights_can_be_seen(tmp_path: Path) -> None:
    """MuJoCo's own headlight shows a white floor as dark grey (median 67 of 255)."""
    file = tmp_path / "dark.xml"
    file.write_text(
        """<mujoco><worldbody>
      <geom type="plane" size="9 9 1" rgba="1 1 1 1"/>
      <geom type="box" size="0.1 1 1" pos="0 0 1"/>
    </worldbody></mujoco>"""
    )
    scene = load_scene(file, "quadrotor", (-2, 0, 0.5), (2, 0, 0.5))
    space = scene.free_space()
    run = Run(scene, space, plan(space, scene.start, scene.goal), None, None, {})
    assert np.median(render_frame(run, width=64, height=48)[-10:]) > 120
