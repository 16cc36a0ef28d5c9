"""Bodies on slides that servos move: the same law of control follows the same reference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import hzmp_sim as hz
from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_sim.simulation.actuation import actuation_for
from hzmp_sim.simulation.slide_drive import slide_drive

ACTUATORS = {
    "motor": '<motor joint="{j}" gear="2"/>',
    "position": '<position joint="{j}" kp="300" kv="20"/>',
    "geared position": '<position joint="{j}" kp="300" gear="-3"/>',
    "stiff position": '<position joint="{j}" kp="20000" kv="400"/>',
    "velocity": '<velocity joint="{j}" kv="80"/>',
    "general": '<general joint="{j}" gainprm="4 0 0" biastype="affine" biasprm="3 -20 -5" '
               'gear="2"/>',
    "affine gain": '<general joint="{j}" gaintype="affine" gainprm="40 2 -1" biastype="affine" '
                   'biasprm="1 -2 -3"/>',
}  # fmt: skip
WORLD = """<mujoco><option timestep="0.002" integrator="{integrator}"/>
<custom><numeric name="workspace" data="0 0 0  6 4 2"/></custom>
<worldbody>
  <geom name="wall" type="box" pos="3 1.5 1" size="0.2 1.5 1"/>
  <body name="cart" pos="1 1 1">
    <joint name="x" type="slide" axis="1 0 0" {joint}/><joint name="y" type="slide" axis="0 -1 0"/>
    <geom type="box" size="0.1 0.1 0.1" mass="2"/></body>
  <site name="goal" pos="5 1 1"/>
</worldbody><actuator>{actuators}</actuator></mujoco>"""


def world(kind: str, integrator: str = "Euler", joint: str = "") -> str:
    actuators = "".join(ACTUATORS.get(kind, kind).format(j=j) for j in "xy")
    return WORLD.format(integrator=integrator, joint=joint, actuators=actuators)


def flown(tmp_path: Path, text: str, **settings: Any) -> hz.Run:
    path = tmp_path / "world.xml"
    path.write_text(text)
    return hz.simulate(hz.load_scene(path), settings=hz.RunSettings(**settings))


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
@pytest.mark.parametrize("kind", ACTUATORS)
def test_each_kind_follows_within_a_millimetre(tmp_path: Path, kind: str, integrator: str) -> None:
    metrics = flown(tmp_path, world(kind, integrator)).metrics
    assert metrics["status"] == "goal_reached"
    # Runge-Kutta lets a servo act at states within the step, which no input can undo.
    within_steps = (kind, integrator) == ("stiff position", "RK4")
    assert metrics["tracking_error_max_m"] <= (6e-3 if within_steps else 1e-3)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_damping_and_springs_of_the_joint_are_known(tmp_path: Path, integrator: str) -> None:
    joint = 'damping="15" stiffness="8" springref="0.5"'
    metrics = flown(tmp_path, world("position", integrator, joint)).metrics
    assert metrics["status"] == "goal_reached"
    assert metrics["tracking_error_max_m"] <= 1e-3


@pytest.mark.parametrize("kind", ACTUATORS)
def test_the_wanted_force_is_the_force(kind: str) -> None:
    model = mujoco.MjModel.from_xml_string(world(kind))
    data, rng = mujoco.MjData(model), np.random.default_rng(3)
    for _ in range(50):
        q, v, force = rng.uniform(-2.0, 2.0, 2), rng.uniform(-2.0, 2.0, 2), rng.normal(0.0, 9.0, 2)
        data.qpos[:], data.qvel[:] = q, v
        for joint in range(2):
            drive = slide_drive(model, "cart", joint)
            data.ctrl[drive.actuator] = drive.input(force[joint], q[joint], v[joint])
        mujoco.mj_forward(model, data)
        assert np.allclose(data.qfrc_actuator, force, atol=1e-9)


@pytest.mark.parametrize(
    ("limits", "joint"),
    [
        ('ctrlrange="-1 1"', ""),
        ('forcerange="-30 20"', ""),
        ('ctrlrange="-1 1" forcerange="-30 20"', 'actuatorfrcrange="-25 15"'),
    ],
)
def test_what_is_out_of_reach_is_given_as_far_as_it_goes(limits: str, joint: str) -> None:
    """The range that a drive states is what MuJoCo gives, and its inputs stay in their range."""
    model = mujoco.MjModel.from_xml_string(
        world(f'<position joint="{{j}}" kp="100" kv="5" {limits}/>', joint=joint)
    )
    data, drive = mujoco.MjData(model), slide_drive(model, "cart", 0)
    for q, v in ((0.0, 0.0), (0.5, -1.0), (-0.9, 2.0)):
        given = []
        for force in (-1e4, 1e4):
            data.qpos[0], data.qvel[0] = q, v
            data.ctrl[0] = drive.input(force, q, v)
            assert drive.inputs[0] <= data.ctrl[0] <= drive.inputs[1]
            mujoco.mj_forward(model, data)
            given.append(float(data.qfrc_actuator[0]))
        assert given == pytest.approx(drive.force_range(q, v))


def test_servos_that_get_weak_at_speed_slow_the_default_limits_down(tmp_path: Path) -> None:
    weak = '<velocity joint="{j}" kv="20" ctrlrange="-1.5 1.5"/>'
    run = flown(tmp_path, world(weak))
    assert run.trajectory is not None
    speed, acceleration = (float(peak.max()) for peak in run.trajectory.peaks[:2])
    assert speed <= 0.75 + 1e-6  # half of the speed at which no force is left
    assert acceleration <= 0.8 * 20.0 * 0.75 / 2.0 + 1e-6
    assert run.metrics["status"] == "goal_reached"
    assert run.metrics["tracking_error_max_m"] <= 1e-3


def test_a_reference_beyond_the_servos_is_told_of(tmp_path: Path) -> None:
    weak = '<velocity joint="{j}" kv="20" ctrlrange="-1.5 1.5"/>'
    run = flown(tmp_path, world(weak), velocity=3.0, acceleration=8.0)
    assert run.log is not None
    assert np.abs(run.log.control).max() <= 1.5
    assert run.metrics["tracking_error_max_m"] > run.scene.clearance
    assert any("off its reference" in warning for warning in run.metrics["warnings"])


def test_a_servo_that_loses_force_loses_all_of_it(tmp_path: Path) -> None:
    errors: list[Floats] = []
    for kind in ("motor", "position"):
        run = flown(tmp_path, world(kind), disturbance=hz.Disturbance(thrust_loss=0.1))
        assert run.log is not None
        errors.append(run.log.tracking_error)
    assert np.allclose(errors[0], errors[1], atol=1e-6)


@pytest.mark.parametrize(
    "actuator",
    [
        '<intvelocity joint="{j}" kp="9" actrange="-9 9"/>',
        '<position joint="{j}" kp="9" timeconst="0.1"/>',
        '<motor joint="{j}" delay="0.01" nsample="9"/>',
        '<muscle joint="{j}" lengthrange="0 1"/>',
        '<damper joint="{j}" kv="9" ctrlrange="0 1"/>',
    ],
)
def test_what_gives_no_force_at_once_is_refused_in_one_line(actuator: str) -> None:
    model = mujoco.MjModel.from_xml_string(world(actuator))
    with pytest.raises(SceneError, match="slide joint 'x' of body 'cart'") as caught:
        actuation_for(model, "cart")
    assert "\n" not in str(caught.value)
