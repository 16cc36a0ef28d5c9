"""Worlds in which everything moves, for the tests of scripts and predictions."""

import mujoco
import numpy as np

import hzmp_sim as hz

WORLD = """<mujoco>
  <option timestep="0.002" jacobian="dense"/>
  <custom><numeric name="workspace" data="-4 -4 0 4 4 4"/></custom>
  <asset><mesh name="tent" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset>
  <worldbody>
    <site name="start" pos="-3.5 -3.5 1"/><site name="goal" pos="3.5 3.5 1"/>
    <geom name="floor" type="plane" size="5 5 0.1"/>
    <body name="cart" mocap="true" pos="-3 0 1">
      <geom name="cart" type="box" size="0.4 0.2 0.5"/>
      <geom name="mast" type="cylinder" size="0.1 0.6" pos="0 0 0.8" euler="0 30 0"/>
    </body>
    <body name="truck" mocap="true" pos="0 2 1">
      <geom name="truck" type="box" size="0.3 0.2 1"/>
    </body>
    <body name="drone" mocap="true" pos="0 0 2">
      <geom name="drone" type="ellipsoid" size="0.4 0.3 0.1"/>
    </body>
    <body name="hook" mocap="true" pos="2 2 1">
      <geom name="hook" type="mesh" mesh="tent"/>
    </body>
    <body name="ghost" mocap="true" pos="2 -2 -5">
      <geom name="ghost" type="box" size="0.3 0.3 0.5"/>
    </body>
    <body name="tool" mocap="true" pos="0 0 1">
      <geom name="tool" type="sphere" size="0.2"/>
    </body>
    <body name="door" pos="1 -1 1">
      <joint name="door" axis="0 0 1" pos="-0.5 0 0"/>
      <geom name="door" type="box" size="0.5 0.05 0.9"/>
    </body>
    <body name="rod" pos="-2 2 3.5">
      <joint name="rod" axis="0 1 0.1" damping="0.01"/>
      <geom name="rod" type="capsule" fromto="0 0 0 1 0 -1" size="0.08"/>
      <body name="bob" pos="1 0 -1"><joint name="bob" type="ball"/>
        <geom name="bob" type="sphere" size="0.2" pos="0.2 0 -0.3"/>
      </body>
    </body>
    <body name="lift" pos="3 0 1.5" gravcomp="1">
      <joint name="lift" type="slide" axis="0 0 1" damping="5"/>
      <geom name="lift" type="box" size="0.3 0.3 0.2" mass="2"/>
    </body>
  </worldbody>
  <actuator><position name="lift" joint="lift" kp="100" kv="20"/></actuator>
</mujoco>"""


def orbit(t: float) -> tuple[list[float], list[float]]:
    """Position and quaternion of what tumbles along."""
    position = [2.0 * np.sin(t), 2.0 * np.sin(2.0 * t), 1.0 + 0.5 * np.cos(t)]
    return position, [np.cos(0.5 * t), np.sin(0.5 * t), 0.0, 0.0]


SCRIPT = hz.MotionScript(
    motions=[
        hz.Motion(
            body="cart",
            path=hz.Waypoints(
                times=[0.5, 1.5, 2.2, 3.0],
                positions=[[-3, 0, 1], [-1, 1, 1.3], [0, -1, 0.6], [-3, 0, 1]],
                yaws=[0.0, 1.0, 1.0, 6.0],
                repeat="loop",
            ),
        ),
        hz.Motion(
            body="truck",
            path=hz.Circle(centre=[1, 1, 1], radius=1.5, period=-4.0, phase=1.0, facing=True),
        ),
        hz.Motion(
            body="drone", path=hz.Circle(centre=[0, 0, 2], radius=1.8, period=3.0, axis=[1, 1, 1])
        ),
        hz.Motion(body="hook", path=hz.Callback(orbit)),
        hz.Motion(
            body="ghost",
            path=hz.Waypoints(
                times=[0, 1.303, 1.303, 2.6, 2.6],
                positions=[[2, -2, -5], [2, -2, -5], [2, -2, 1], [0, -2, 1], [0, -2, -5]],
            ),
        ),
        hz.Motion(
            body="tool",
            path=hz.Waypoints(
                times=[0, 1, 2],
                positions=[[-2, -2, 1], [-2, -2, 3], [2, -1, 1]],
                repeat="bounce",
                smooth=True,
            ),
        ),
        hz.Motion(joint="door", path=hz.Swing(amplitude=1.2, period=2.5)),
        hz.Motion(
            actuator="lift",
            path=hz.Waypoints(times=[0, 1, 1, 3], values=[0.0, 0.5, -1.0, 1.5], repeat="loop"),
        ),
    ]
)


def flown(scene: hz.Scene) -> mujoco.MjData:
    """The state of a scene at time 0, with what the script drives where it is then."""
    data = mujoco.MjData(scene.model)
    data.qpos[:] = scene.initial_qpos
    hz.Drives(scene.model, scene.motion).apply(data, 0.0)
    mujoco.mj_forward(scene.model, data)
    return data


def hold(scene: hz.Scene, data: mujoco.MjData) -> None:
    """Put the body that flies back to its start: it is none of these tests' concern."""
    body = scene.model.body(scene.body).id
    for joint in range(scene.model.njnt):
        if scene.model.jnt_bodyid[joint] == body:
            q, v = int(scene.model.jnt_qposadr[joint]), int(scene.model.jnt_dofadr[joint])
            free = int(scene.model.jnt_type[joint]) == 0
            data.qpos[q : q + (7 if free else 1)] = scene.initial_qpos[q : q + (7 if free else 1)]
            data.qvel[v : v + (6 if free else 1)] = 0.0
