"""Worlds with doors, arms and loose things: --freeze welds all but the flown body."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from hzmp_sim.scene import load_scene

WORLD = """
<mujoco>
  <custom><numeric name="workspace" data="-3 -2 0 3 2 2"/></custom>
  <worldbody>
    <site name="start" pos="-2 0 1"/><site name="goal" pos="2 0 1"/>
    <geom name="wall" type="box" pos="0 -1.2 1" size="0.1 0.8 1"/>
    <body name="door" pos="0 -0.4 1" euler="0 0 20">
      <joint name="hinge" axis="0 0 1" range="-90 90" limited="true" ref="10"/>
      <geom name="leaf" type="box" pos="0 0.5 0" size="0.04 0.5 1"/>
      <body name="latch" pos="0.06 0.9 0">
        <joint name="knob" axis="1 0 0"/>
        <geom name="handle" type="capsule" size="0.03 0.08"/>
        <site name="grip"/>
      </body>
    </body>
    <body name="ball" pos="-1 1.5 0.8"><freejoint/><geom name="ball" size="0.3"/></body>
    <body name="robot" pos="-2 0 1">
      <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
      <geom name="shell" size="0.1"/>
    </body>
  </worldbody>
  <tendon><fixed name="pull"><joint joint="hinge" coef="1"/></fixed></tendon>
  <equality><joint joint1="hinge" joint2="knob"/></equality>
  <sensor><jointpos joint="hinge"/><framepos objtype="site" objname="grip"/></sensor>
  <actuator>
    <motor name="mx" joint="x"/><motor name="my" joint="y"/>
    <motor name="opener" joint="hinge"/><motor name="puller" tendon="pull"/>
  </actuator>
  <keyframe><key name="open" qpos="0 0 0 0 0 1 0 0 0 0 0"/></keyframe>
</mujoco>
"""


@pytest.fixture
def world(tmp_path: Path) -> Path:
    file = tmp_path / "flat.xml"
    file.write_text(WORLD)
    return file


def test_what_is_not_frozen_moves(world: Path) -> None:
    scene = load_scene(world, "robot")
    roles = {g.name: (g.role, g.reason) for g in scene.geoms}
    assert roles["leaf"] == ("moving", "moves with the joints of body 'door'")
    assert roles["wall"][0] == "obstacle"
    assert "leaf" in {item.name for item in scene.moving}
    assert not {item.geom for item in scene.moving} & set(scene.obstacle_geoms)


@pytest.mark.parametrize("body", ["robot", "point"])
def test_everything_else_stands_where_it_stood(world: Path, body: str) -> None:
    scene = load_scene(world, body, (-2, -1, 1), freeze=True)
    before = mujoco.MjModel.from_xml_path(str(world))
    stood, stands = mujoco.MjData(before), mujoco.MjData(scene.model)
    mujoco.mj_kinematics(before, stood)
    mujoco.mj_kinematics(scene.model, stands)
    for name in ("wall", "leaf", "handle", "ball"):
        now, then = scene.model.geom(name).id, before.geom(name).id
        np.testing.assert_allclose(stands.geom_xpos[now], stood.geom_xpos[then], atol=1e-6)
        np.testing.assert_allclose(stands.geom_xmat[now], stood.geom_xmat[then], atol=1e-5)
        assert {g.name: g.role for g in scene.geoms}[name] == "obstacle"
    motors = [scene.model.actuator(k).name for k in range(scene.model.nu)]
    assert len(motors) == scene.model.nq == scene.n
    assert motors == ["mx", "my"] or body == "point"


def test_what_went_with_the_joints_is_told(world: Path) -> None:
    (warning,) = load_scene(world, "robot", freeze=True).warnings
    assert "frozen where they stand: door, latch, ball;" in warning
    for lost in ("actuators (2)", "tendons (1)", "equalities (1)", "sensors (2)", "keyframes (1)"):
        assert lost in warning
    # A bundled body is attached to a world in which nothing moves.
    (warning,) = load_scene(world, "point", (-2, -1, 1), freeze=True).warnings
    assert "door, latch, ball, robot;" in warning


def test_nothing_to_freeze_changes_nothing(tmp_path: Path) -> None:
    still = tmp_path / "still.xml"
    still.write_text(
        """<mujoco>
      <custom><numeric name="workspace" data="-3 -2 0 3 2 2"/></custom>
      <worldbody><geom name="wall" type="box" size="0.1 1 1" pos="0 0 1"/></worldbody>
    </mujoco>"""
    )
    scene = load_scene(still, "point", (-2, 0, 1), (2, 0, 1), freeze=True)
    assert scene.warnings == ()
    assert scene.xml == load_scene(still, "point", (-2, 0, 1), (2, 0, 1)).xml
