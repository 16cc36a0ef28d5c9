"""Motion scripts: what they say, what they move, and how their mistakes are told."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

import hzmp_sim as hz
from hzmp_planners.errors import HzmpError
from hzmp_sim.motion.resolve import resolved
from moving_worlds import SCRIPT, WORLD, flown

GOOD = """
patrol = true
duration = 60.0

[[motion]]
body = "cart"
kind = "waypoints"
times = [0.0, 2.0, 2.0]
positions = [[0, 0, 1], [1, 0, 1], [0, 0, 3]]

[[motion]]
joint = "door"
kind = "swing"
amplitude = 1.0
period = 2.0
announced = false

[[goal]]
position = [1, 1, 1]
after = "arrival"
dwell = 2.0
"""


def read(folder: Path, text: str) -> hz.MotionScript:
    file = folder / "motion.toml"
    file.write_text(text)
    return hz.read_motion(file)


def test_a_file_is_the_object_of_the_same_content(tmp_path: Path) -> None:
    waypoints = hz.Waypoints(times=[0.0, 2.0, 2.0], positions=[[0, 0, 1], [1, 0, 1], [0, 0, 3]])
    swing = hz.Swing(amplitude=1.0, period=2.0)
    assert read(tmp_path, GOOD) == hz.MotionScript(
        motions=[
            hz.Motion(body="cart", path=waypoints),
            hz.Motion(joint="door", path=swing, announced=False),
        ],
        goals=[hz.Goal(position=[1, 1, 1], dwell=2.0)],
        patrol=True,
        duration=60.0,
    )


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[[motion]]", "[motion", ["not well-formed TOML"]),
        ("patrol", "patroll", ["unknown 'patroll'", "motion, goal, patrol, duration"]),
        ("duration = 60.0", "", ["patrol needs", "duration"]),
        ('kind = "swing"', 'kind = "swirl"', ["motion 2", "'swirl'", "waypoints, circle, swing"]),
        ("amplitude", "size", ["motion 2", "unknown 'size'", "amplitude, period"]),
        ("amplitude = 1.0", "", ["motion 2", "'swing' needs amplitude"]),
        ("period = 2.0", "period = -2.0", ["motion 2", "period must be positive", "-2.0"]),
        ("period = 2.0", 'period = "2"', ["period must be a number", "'2'"]),
        ("times = [0.0, 2.0, 2.0]", "times = [0.0, 2.0, 1.0]", ["ascend", "1 comes after 2"]),
        ("times = [0.0, 2.0, 2.0]", "times = [0.0, 2.0]", ["2 times for 3 waypoints"]),
        ("[1, 0, 1]", "[1, 0]", ["3 coordinates, got 2"]),
        ('joint = "door"', "", ["motion 2", "exactly one of body, joint, actuator"]),
        ('joint = "door"', 'body = "cart"', ["body 'cart'", "values does not suit a body"]),
        ("announced = false", "announced = 0", ["announced must be true or false"]),
        ('after = "arrival"', "", ["goal 1", "either a time or after"]),
        ("position = [1, 1, 1]", "", ["goal 1", "position"]),
        ("dwell = 2.0", "dwell = nan", ["dwell must be finite"]),
    ],
)
def test_mistakes_are_told_in_one_line(tmp_path: Path, old: str, new: str, says: list[str]) -> None:
    assert old in GOOD
    with pytest.raises(HzmpError) as caught:
        read(tmp_path, GOOD.replace(old, new, 1))
    text = str(caught.value)
    assert "\n" not in text
    for part in ("motion.toml", *says):
        assert part in text


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ("trolley", ["there is no mocap body", "cart, truck"]),
        ("door", ["it is no mocap body", "cart, truck"]),
    ],
)
def test_names_that_the_world_has_not_are_told_with_those_it_has(
    body: str, says: list[str]
) -> None:
    path = hz.Circle(centre=[0, 0, 1], radius=1.0, period=2.0)
    script = hz.MotionScript(motions=[hz.Motion(path=path, body=body)])
    with pytest.raises(HzmpError) as caught:
        hz.load_scene(mujoco.MjSpec.from_string(WORLD), "point", motion=script)
    for part in says:
        assert part in str(caught.value)


def test_the_flown_body_is_not_driven() -> None:
    path = hz.Waypoints(times=[0.0], values=[0.0])
    script = hz.MotionScript(motions=[hz.Motion(joint="point_x", path=path)])
    spec = hz.load_scene("enclosure", "point").spec()
    with pytest.raises(HzmpError, match="joint 'point_x' drives body 'point', which flies"):
        hz.load_scene(spec, "point", motion=script)


def test_waypoints_go_and_come_again() -> None:
    places = {"times": [1.0, 2.0, 4.0], "values": [0.0, 1.0, 3.0]}
    once, loop, bounce = (
        hz.Waypoints(**places, repeat=repeat)  # type: ignore[arg-type]
        for repeat in ("once", "loop", "bounce")
    )
    asked = [0.0, 1.5, 3.0, 4.5, 5.0, 7.5]
    assert [once.at(t)[0] for t in asked] == [0.0, 0.5, 2.0, 3.0, 3.0, 3.0]
    assert [loop.at(t)[0] for t in asked] == [2.0, 0.5, 2.0, 0.5, 1.0, 0.5]
    assert [bounce.at(t)[0] for t in asked] == [1.0, 0.5, 2.0, 2.5, 2.0, 0.5]
    assert (once.cycle, loop.cycle, bounce.cycle) == (None, 3.0, 6.0)


@pytest.mark.parametrize(
    "path",
    [
        hz.Waypoints(times=[0, 1, 3], values=[0, 2, 1], repeat="loop"),
        hz.Waypoints(times=[0, 1, 3], values=[0, 2, 1], repeat="bounce", smooth=True),
        hz.Swing(amplitude=2.0, period=1.7, phase=0.4, middle=1.0),
        hz.Callback(lambda t: np.sin(3.0 * t)),
    ],
)
def test_rates_are_derivatives(path: hz.Waypoints | hz.Swing | hz.Callback) -> None:
    motion = hz.Motion(joint="door", path=path, speed=1.3, offset=0.2)
    for t in np.linspace(0.013, 7.0, 100):
        difference = (motion.at(t + 1e-6)[0] - motion.at(t - 1e-6)[0]) / 2e-6
        assert motion.rate(t) == pytest.approx(difference, abs=1e-3)


def test_what_faces_its_way_on_a_circle_points_along_it() -> None:
    for period in (3.0, -3.0):
        for axis in ([0, 0, 1], [0, 0, -2]):
            circle = hz.Circle(centre=[1, 2, 3], radius=2.0, period=period, axis=axis, facing=True)
            for t in (0.0, 0.4, 2.0):
                way = np.subtract(circle.at(t + 1e-6)[:3], circle.at(t)[:3])
                yaw = circle.at(t)[3]
                along = way / np.linalg.norm(way)
                np.testing.assert_allclose([np.cos(yaw), np.sin(yaw), 0.0], along, atol=1e-5)


def test_drives_put_everything_where_the_script_says() -> None:
    scene = hz.load_scene(mujoco.MjSpec.from_string(WORLD), "point", motion=SCRIPT)
    data, model = flown(scene), scene.model
    hz.Drives(model, scene.motion).apply(data, 1.3)
    motions = {motion.name: motion for motion in SCRIPT.motions}
    mocap = {name: int(model.body_mocapid[model.body(name).id]) for name in ("cart", "truck")}
    np.testing.assert_allclose(data.mocap_pos[mocap["cart"]], motions["cart"].at(1.3)[:3])
    yaw = motions["truck"].at(1.3)[3]
    quaternion = [np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
    np.testing.assert_allclose(data.mocap_quat[mocap["truck"]], quaternion)
    joint = model.joint("door").id
    assert data.qpos[model.jnt_qposadr[joint]] == motions["door"].at(1.3)[0]
    assert data.qvel[model.jnt_dofadr[joint]] == motions["door"].rate(1.3)
    assert data.ctrl[model.actuator("lift").id] == motions["lift"].at(1.3)[0]


def test_keyframes_are_waypoints_that_the_world_names() -> None:
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody>
        <body name="cart" mocap="true"><geom size="0.1"/></body>
        <body name="door"><joint name="door"/><geom size="0.1"/></body></worldbody>
        <keyframe><key name="shut" qpos="0" mpos="0 0 1"/>
        <key name="open" time="2" qpos="1.5" mpos="1 0 1" mquat="0.7071068 0 0 0.7071068"/>
        </keyframe></mujoco>"""
    )
    path = hz.Keyframes(names=["shut", "open"])
    script = hz.MotionScript(
        motions=[hz.Motion(body="cart", path=path), hz.Motion(joint="door", path=path)]
    )
    cart, door = resolved(script, model).motions
    np.testing.assert_allclose(cart.at(1.0), [0.5, 0.0, 1.0, np.pi / 4], atol=1e-6)
    np.testing.assert_allclose(door.at(1.0), [0.75])
    wrong = hz.Motion(joint="door", path=hz.Keyframes(names=["ajar"]))
    with pytest.raises(HzmpError, match=r"joint 'door': there is no keyframe 'ajar'.*shut, open"):
        resolved(hz.MotionScript(motions=[wrong]), model)


def test_seeds_give_other_moments_and_one_path_keeps_its_distances() -> None:
    scene = hz.load_scene("crossing_traffic")
    script = scene.motion
    assert script is not None
    one, again, other = (script.with_phases(seed) for seed in (1, 1, 2))
    assert one == again
    assert one != other
    for first, second, was, then in zip(
        one.motions[::2], one.motions[1::2], script.motions[::2], script.motions[1::2], strict=True
    ):
        assert first.speed == second.speed
        assert second.offset - first.offset == pytest.approx(then.offset - was.offset)


def test_frozen_joints_lose_their_motion_and_the_scene_says_so() -> None:
    scene = hz.load_scene("sliding_doors", freeze=True)
    assert scene.motion is not None
    assert [motion.name for motion in scene.motion.motions] == ["door_a"]
    assert [item.name for item in scene.moving] == ["door_a"]
    left_out = [text for text in scene.warnings if "motion is left out" in text]
    assert len(left_out) == 2
