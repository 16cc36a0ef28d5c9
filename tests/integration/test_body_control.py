from pathlib import Path

import mujoco
import numpy as np
import pytest

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_planners.sets import Polytope
from hzmp_sim.simulation.actuation import actuation_for
from hzmp_tracking import Limits, Trajectory, time_parameterize
from hzmp_tracking.smoothing import smooth_sample

BODIES = Path(__file__).parents[2] / "models" / "bodies"
DT = 0.002
WORLD = """<mujoco><option timestep="0.002"/><worldbody>
<geom name="floor" type="plane" size="5 5 0.1" pos="0 0 -3"/></worldbody></mujoco>"""
HEIGHT = 1.0
WAYPOINTS = [[0.5, 0.5], [3.0, 0.5], [3.5, 1.0], [3.5, 3.5]]
CELLS = [Polytope.from_box(*box) for box in (([0, 0], [3, 1]), ([3, 0], [4, 1]), ([3, 1], [4, 4]))]


def bundled(file: str, body: str) -> mujoco.MjsBody:
    found = mujoco.MjSpec.from_file(str(BODIES / file)).body(body)
    assert found is not None
    return found


def attached(
    file: str, body: str, position: tuple[float, float, float] = (0.5, 0.5, HEIGHT)
) -> tuple[mujoco.MjModel, str]:
    world = mujoco.MjSpec.from_string(WORLD)
    world.worldbody.add_frame(pos=position).attach_body(bundled(file, body), "robot-", "")
    return world.compile(), f"robot-{body}"


def errors_of_flight(
    model: mujoco.MjModel, body: str, trajectory: Trajectory, hold: float = 1.0, tilt: float = 0.0
) -> Floats:
    """Distance of the centre to the reference at each step [m]."""
    data, actuation = mujoco.MjData(model), actuation_for(model, body)
    if tilt:
        data.qpos[3:7] = [np.cos(tilt / 2), np.sin(tilt / 2), 0.0, 0.0]
    actuation.trim(data)
    mujoco.mj_forward(model, data)
    times: Floats = DT * np.arange(int((trajectory.duration + hold) / DT), dtype=np.float64)
    sample = smooth_sample(trajectory, times, actuation.smoothing)
    lifted = [np.hstack([part, np.zeros((len(part), 1))]) for part in sample]
    lifted[0][:, 2] = HEIGHT
    centre = model.body(body).id
    errors = []
    for reference in zip(*(part.tolist() for part in lifted), strict=True):
        errors.append(np.linalg.norm(data.xpos[centre] - reference[0]))
        actuation.apply(data, actuation.state(data), *reference)
        mujoco.mj_step(model, data)
    return np.array(errors)


@pytest.mark.parametrize("kind", ["planar", "spatial"])
def test_point_follows_a_bend_within_a_millimetre(kind: str) -> None:
    model, body = attached(f"point/{kind}.xml", "point")
    limits = actuation_for(model, body).default_limits
    trajectory = time_parameterize(WAYPOINTS, CELLS, limits)
    errors = errors_of_flight(model, body, trajectory)
    assert errors.max() <= 1e-3
    assert errors[-1] <= 1e-5


def test_quadrotor_follows_a_bend() -> None:
    model, body = attached("quadrotor/body.xml", "quadrotor")
    limits = actuation_for(model, body).default_limits
    trajectory = time_parameterize(WAYPOINTS, CELLS, limits)
    errors = errors_of_flight(model, body, trajectory)
    assert errors.max() <= 0.010
    assert errors[-1] <= 1e-3


def test_quadrotor_follows_faster_limits() -> None:
    model, body = attached("quadrotor/body.xml", "quadrotor")
    trajectory = time_parameterize(WAYPOINTS, CELLS, Limits(2.0, 4.0, 20.0))
    assert errors_of_flight(model, body, trajectory).max() <= 0.020


def test_default_limits_of_the_quadrotor_follow_from_its_rotors() -> None:
    model, body = attached("quadrotor/body.xml", "quadrotor")
    actuation = actuation_for(model, body)
    assert actuation.rotors is not None
    assert actuation.rotors.most_thrust == pytest.approx(18.0 / 0.6)
    limits = actuation.default_limits
    assert limits.total_acceleration == pytest.approx(9.81 * np.sin(0.8 * 0.6))
    usage = actuation.rotors.usage(time_parameterize(WAYPOINTS, CELLS, limits))
    assert max(usage[:3]) <= 0.8 * (1.0 + 1e-3)
    # Weaker motors bound the thrust, and with it everything.
    model.actuator_ctrlrange[:, 1] = 1.2 * 0.6 * 9.81 / 4.0
    weak = actuation_for(model, body).default_limits
    assert weak.total_acceleration == pytest.approx(0.8 * 0.2 * 9.81)
    assert actuation_for(model, body, max_tilt=0.1).default_limits.total_acceleration == (
        pytest.approx(9.81 * np.sin(0.08))
    )


def test_quadrotor_hovers_still() -> None:
    model, body = attached("quadrotor/body.xml", "quadrotor")
    stay = time_parameterize([[0.5, 0.5], [0.5, 0.5]], CELLS[:1])
    assert errors_of_flight(model, body, stay, hold=2.0).max() <= 1e-6


@pytest.mark.parametrize(("degrees", "drift"), [(20, 0.06), (120, 0.8)])
def test_quadrotor_recovers_from_a_tilt(degrees: float, drift: float) -> None:
    model, body = attached("quadrotor/body.xml", "quadrotor")
    stay = time_parameterize([[0.5, 0.5], [0.5, 0.5]], CELLS[:1])
    errors = errors_of_flight(model, body, stay, hold=4.0, tilt=np.radians(degrees))
    assert errors.max() <= drift
    assert errors[-1] <= 1e-3


def test_bundled_quadrotor_is_what_it_says() -> None:
    model, body = attached("quadrotor/body.xml", "quadrotor")
    index = model.body(body).id
    assert model.body_mass[index] == pytest.approx(0.6)
    assert not model.body_ipos[index].any()
    geoms = [g for g in range(model.ngeom) if model.geom_bodyid[g] == index]
    reach = [np.linalg.norm(model.geom_pos[g]) + model.geom_rbound[g] for g in geoms]
    assert max(reach) <= 0.20
    assert all(model.geom_contype[g] for g in geoms)
    assert model.actuator_ctrlrange[:, 1].sum() / (0.6 * 9.81) == pytest.approx(3.06, abs=0.01)


@pytest.mark.parametrize("defaults", ["", '<default><geom mass="3"/><motor ctrlrange="0 1"/>'
                                          '<joint damping="9"/></default>'])  # fmt: skip
def test_bodies_keep_their_values_in_any_world(defaults: str) -> None:
    world = mujoco.MjSpec.from_string(WORLD.replace("<worldbody>", f"{defaults}<worldbody>"))
    for file, body in (("point/spatial.xml", "point"), ("quadrotor/body.xml", "quadrotor")):
        world.worldbody.add_frame().attach_body(bundled(file, body), f"{body}-", "")
    model = world.compile()
    assert model.body_mass[model.body("point-point").id] == pytest.approx(1.0)
    assert model.body_mass[model.body("quadrotor-quadrotor").id] == pytest.approx(0.6)
    assert (model.actuator_ctrlrange[:3] == [-20.0, 20.0]).all()
    assert not model.dof_damping.any()


USER = """<mujoco><option timestep="0.002"/><worldbody><body name="cart" pos="0.5 0.5 1" {turn}>
{joints}<geom type="box" size="0.1 0.1 0.1" mass="2"/><site name="s"/></body></worldbody>
<actuator>{motors}</actuator></mujoco>"""


def user_model(joints: str, motors: str = "", turn: str = "") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(USER.format(joints=joints, motors=motors, turn=turn))


def test_a_body_of_the_users_own_with_gears_and_turned_axes() -> None:
    model = user_model(
        '<joint name="a" type="slide" axis="0 1 0"/><joint name="b" type="slide" axis="1 0 0"/>',
        '<motor joint="a" gear="-5" ctrlrange="-10 10"/><motor joint="b" gear="2"/>',
        turn='euler="0 0 90"',
    )
    trajectory = time_parameterize(WAYPOINTS, CELLS, Limits(2.0, 4.0, 20.0))
    assert errors_of_flight(model, "cart", trajectory).max() <= 1e-3


def test_weight_and_weak_motors_shape_the_default_limits() -> None:
    lift = '<joint name="z" type="slide" axis="0 0 1"/>'
    strong = user_model(lift, '<motor joint="z" gear="1" ctrlrange="-100 100"/>')
    weak = user_model(lift, '<motor joint="z" gear="1" ctrlrange="-22 22"/>')
    assert actuation_for(strong, "cart").default_limits.acceleration == 4.0
    spare = (22.0 - 2 * 9.81) / 2.0
    assert actuation_for(weak, "cart").default_limits.acceleration == pytest.approx(0.8 * spare)
    with pytest.raises(SceneError, match="too weak"):
        actuation_for(user_model(lift, '<motor joint="z" ctrlrange="-9 9"/>'), "cart")


SLIDE = '<joint name="x" type="slide" axis="1 0 0"/>'


@pytest.mark.parametrize(
    ("joints", "motors", "message"),
    [
        ("", "", "'cart' has no joint: valid are"),
        ('<joint type="hinge"/>', "", "joints of type hinge: valid are"),
        (SLIDE, "", "'x' of body 'cart' has no actuator of its own"),
        (SLIDE, '<motor joint="x"/><motor joint="x"/>', "needs one actuator"),
        (SLIDE, '<motor joint="x" gear="0"/>', "gear or gain 0"),
        (SLIDE.replace("1 0 0", "1 1 0"), '<motor joint="x"/>', "world axis of its own"),
        (SLIDE + SLIDE.replace('"x"', '"y"'), '<motor joint="x"/><motor joint="y"/>', "its own"),
        ("<freejoint/>", "", "0 site thrusts"),
        ("<freejoint/>", '<motor site="s" gear="0 0 1 0 0 0"/>' * 3, "3 site thrusts"),
        ("<freejoint/>", '<motor site="s" gear="1 0 0 0 0 0"/>' * 4, "pushes along"),
        ("<freejoint/>", '<motor site="s" gear="0 0 1 0 0 0"/>' * 4, "need a ctrlrange"),
        ("<freejoint/>", '<motor site="s" gear="0 0 1 0 0 1" ctrlrange="0 9"/>' * 4,
         "'cart' cannot be flown: the rotors span only 1"),
        ("<freejoint/>", '<motor site="s" gear="0 0 1 0 0 1" ctrlrange="0 1"/>' * 4,
         "thrust to weight is 0.204"),
    ],
)  # fmt: skip
def test_what_cannot_be_steered_is_named(joints: str, motors: str, message: str) -> None:
    with pytest.raises(SceneError, match=message) as caught:
        actuation_for(user_model(joints, motors), "cart")
    assert "cart" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_moving_parts_and_unknown_bodies_are_named() -> None:
    model = user_model(SLIDE + '<body name="arm"><joint/><geom size="0.1"/></body>')
    with pytest.raises(SceneError, match="'cart' carries moving parts"):
        actuation_for(model, "cart")
    with pytest.raises(SceneError, match="no body 'drone'"):
        actuation_for(model, "drone")
