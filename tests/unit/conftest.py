"""Runs for the tests of the output: real scenes, plans and trajectories, replayed flights."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from hzmp_planners.planning import PlanStatus, plan
from hzmp_sim.run import FlightLog, Run
from hzmp_sim.scene import Scene, load_scene
from hzmp_tracking import Limits, Trajectory, time_parameterize

WORLD = """
<mujoco model="yard">
  <custom><numeric name="workspace" data="-2 -2 0 4 2 3"/></custom>
  <asset><mesh name="wedge" vertex="0 0 0 .6 0 0 0 .6 0 0 0 .6"/></asset>
  <worldbody>
    <light pos="0 -2 5" dir="0 .4 -1"/>
    <geom name="ground" type="plane" size="5 5 .1" rgba=".8 .8 .7 1"/>
    <geom name="wall" type="box" size=".1 1.2 1.5" pos="1 -.8 1.5" rgba=".2 .4 .6 1"/>
    <geom name="ball" type="sphere" size=".3" pos="2 1.5 2"/>
    <geom name="egg" type="ellipsoid" size=".2 .3 .2" pos="-1 -1.5 2"/>
    <geom name="post" type="cylinder" size=".2 .5" pos="3 -1.5 .5"/>
    <geom name="pill" type="capsule" size=".1 .3" pos="-1 1.5 2.4" euler="90 0 0"/>
    <geom name="chip" type="mesh" mesh="wedge" pos="2.5 -1.5 2"/>
    <site name="goal" pos="3 0 1.5"/>
    <body name="drone" pos="-1 0 1">
      <freejoint/>
      <geom name="hull" type="box" size=".1 .1 .03" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""


def replay(scene: Scene, trajectory: Trajectory, seconds: float) -> FlightLog:
    """A log of a body that follows its reference with a known error: no controller, no contact."""
    model = scene.model
    time = np.arange(0.0, seconds, model.opt.timestep)
    sample = trajectory.sample(time)
    reference = scene.to_world(sample.position)
    position = reference + np.array([0.003, -0.004, 0.0])
    velocity = np.zeros_like(position)
    velocity[:, : scene.n] = sample.velocity
    qpos = np.tile(scene.initial_qpos, (len(time), 1))
    qpos[:, : scene.n] += (position - scene.to_world(scene.start[None]))[:, : scene.n]
    quaternion = np.tile([1.0, 0.0, 0.0, 0.0], (len(time), 1))
    return FlightLog(
        time=time,
        qpos=qpos,
        mocap=np.zeros((len(time), model.nmocap, 7)),
        position=position,
        quaternion=quaternion,
        velocity=velocity,
        reference=reference,
        control=np.column_stack([np.sin(time), np.cos(time)]),
        clearance=1.0 + np.cos(time),
        nearest=np.array(scene.obstacle_geoms)[np.arange(len(time)) % len(scene.obstacle_geoms)],
        contact=np.where(time > seconds / 2, scene.obstacle_geoms[0], -1),
    )


def make_run(scene: Scene, seconds: float) -> Run:
    space = scene.free_space()
    found = plan(space, scene.start, scene.goal)
    trajectory = time_parameterize(found.waypoints, found.cells(space), limits=Limits())
    metrics = {
        "status": "goal_reached",
        "collision_steps": 0,
        "min_clearance_m": 0.0712,
        "optimality_gap": found.gap,
        "path_length_m": found.cost,
        "containment_m": trajectory.containment,
        "tracking_error_max_m": 0.005,
        "trajectory_duration_s": trajectory.duration,
        "replan_latency_ms": {"median": None, "p99": None, "max": None},
        "plan_verified": True,
        "plan_residual_m": 1e-9,
        "timings_s": {"plan": 0.012345},
        "versions": {"mujoco": mujoco.__version__},
        "seed": 7,
    }
    return Run(scene, space, found, trajectory, replay(scene, trajectory, seconds), metrics)


@pytest.fixture(scope="session")
def yard_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A 3-D run with every geom type that can be an obstacle."""
    path = tmp_path_factory.mktemp("yard") / "yard.xml"
    path.write_text(WORLD)
    return make_run(load_scene(path, body="drone"), 1.0)


@pytest.fixture(scope="session")
def room_run() -> Run:
    """A planar run."""
    return make_run(load_scene("enclosure", body="point"), 1.0)


@pytest.fixture(scope="session")
def closed_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run in which nothing could be flown: the goal is walled in."""
    walls = "".join(
        f'<geom type="box" size="{size} 1" pos="{centre} 0"/>'
        for size, centre in (("1 .1", "0 1"), ("1 .1", "0 -1"), (".1 1", "1 0"), (".1 1", "-1 0"))
    )
    path = tmp_path_factory.mktemp("closed") / "closed.xml"
    path.write_text(f"<mujoco><worldbody>{walls}<site name='goal'/></worldbody></mujoco>")
    scene = load_scene(path, body="point", start=[-2.5, 0.0], workspace=([-3, -3], [3, 3]))
    space = scene.free_space()
    found = plan(space, scene.start, scene.goal)
    assert found.status is PlanStatus.INFEASIBLE
    metrics = {
        "status": "infeasible",
        "plan_verified": True,
        "plan_residual_m": 0.0,
        "timings_s": {},
        "versions": {},
    }
    return Run(scene, space, found, None, None, metrics)
