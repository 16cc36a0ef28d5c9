"""What stands for the body, against MuJoCo: no more free space than there is, and all of it."""

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from geom_samples import OCTAHEDRON, SOLIDS
from scipy.spatial.transform import Rotation

from hzmp_planners._arrays import Bools, Floats
from hzmp_planners.errors import SceneError
from hzmp_sim.scene import Scene, load_scene
from hzmp_sim.simulation.parts import PairDistances

POSITIONS = 10_000
GEOMS = {
    **SOLIDS,
    "hill": 'type="sphere" size="40"',
    "slab": 'type="box" size="60 60 0.2"',
    "plane": 'type="plane" size="1 1 0.1"',
    "hfield": 'type="hfield" hfield="hills"',
}
CENTRES = {"hill": "24 -24 -20", "slab": "0 0 -0.3"}
HILLS = " ".join(str((3 * row + 5 * column) % 4) for row in range(6) for column in range(6))

SLIDES = "".join(f'<joint name="{x}" type="slide" axis="{a}"/>' for x, a in
                 (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1")))  # fmt: skip
PLANAR = SLIDES[: SLIDES.index('<joint name="z"')]
BODIES = {
    "box": (SLIDES, '<geom type="box" size="0.4 0.25 0.08" euler="0 0 30"/>'),
    "capsule": (SLIDES, '<geom type="capsule" size="0.08" fromto="-0.3 0 0 0.4 0.1 0.2"/>'),
    "cylinder": (SLIDES, '<geom type="cylinder" size="0.3 0.05" euler="20 0 0"/>'),
    "ellipsoid": (SLIDES, '<geom type="ellipsoid" size="0.4 0.2 0.1" pos="0.1 0 0"/>'),
    "mesh": (SLIDES, '<geom type="mesh" mesh="wedge"/>'),
    "planar box": (PLANAR, '<geom type="box" size="0.4 0.1 0.1" euler="0 0 25"/>'),
}
FIXED = [name for name in BODIES if name != "planar box"]


def world(folder: Path, body: str, kind: str, seed: int) -> Path:
    """A body and one geom at a random pose."""
    turn = Rotation.random(random_state=seed)
    if kind in ("hfield", "slab"):
        turn = Rotation.from_euler("zyx", [30.0, 10.0, 0.0], degrees=True)
    quat = " ".join(str(value) for value in turn.as_quat(scalar_first=True))
    moving = ""
    if body in BODIES:
        joints, geom = BODIES[body]
        moving = f'<body name="robot">{joints}{geom}</body>'
    file = folder / "scene.xml"
    file.write_text(f"""<mujoco>
      <option ccd_tolerance="1e-10" ccd_iterations="200"/>
      <custom><numeric name="workspace" data="-3 -3 -3 3 3 3"/></custom>
      <asset>
        <mesh name="octahedron" vertex="{OCTAHEDRON}"/>
        <mesh name="wedge" vertex="-0.3 -0.2 0 0.3 -0.2 0 0 0.3 0 0 0 0.2"/>
        <hfield name="hills" nrow="6" ncol="6" size="1 1 0.6 0.2" elevation="{HILLS}"/>
      </asset>
      <worldbody>
        <geom name="thing" {GEOMS[kind]} pos="{CENTRES.get(kind, "0.1 -0.2 0.1")}" quat="{quat}"/>
        {moving}
      </worldbody></mujoco>""")
    return file


def scene_of(file: Path, body: str, shape: str = "auto", **settings: float) -> Scene:
    """The scene, from and to a corner of the workspace that is free."""
    name = "robot" if body in BODIES else body
    size = 2 if body == "planar box" else 3
    for corner in np.array(np.meshgrid(*[(-2.2, 2.2)] * size)).reshape(size, -1).T:
        try:
            return load_scene(file, name, corner, corner, shape=shape, **settings)  # type: ignore[arg-type]
        except ValueError as error:
            if "inside obstacle" not in str(error):
                raise
    pytest.fail("the obstacle fills the workspace")


def around(scene: Scene, k: int) -> Floats:
    """Random centres in a box a little larger than the obstacles."""
    vertices = np.vstack([obstacle.vertices() for obstacle in scene.obstacles])
    low = np.maximum(vertices.min(axis=0) - 0.1, scene.bounds[0])
    high = np.minimum(vertices.max(axis=0) + 0.1, scene.bounds[1])
    return np.random.default_rng(k).uniform(low, high, (k, scene.n))


def is_free(scene: Scene, centres: Floats) -> Bools:
    return np.asarray(
        np.min([obstacle.violation(centres) for obstacle in scene.obstacles], axis=0) >= 0.0
    )


def distances(scene: Scene, centres: Floats, quats: Floats | None = None) -> Floats:
    """Distance by MuJoCo of the body to the geom, to its prisms if it is a height field."""
    data = mujoco.MjData(scene.model)
    data.qpos[:] = scene.initial_qpos
    mujoco.mj_kinematics(scene.model, data)
    pairs = PairDistances(scene, data)
    found = []
    for k, centre in enumerate(centres):
        data.qpos[: scene.n] = scene.initial_qpos[: scene.n] + centre - scene.start
        if quats is not None:
            data.qpos[3:7] = quats[k]
        mujoco.mj_kinematics(scene.model, data)
        pairs.update()
        found.append(min(pairs.distance(pair) for pair in pairs.pairs))
    return np.array(found)


def tilted(k: int, limit: float, seed: int = 0) -> Floats:
    """Random orientations wxyz (k, 4): any yaw before and after a tilt up to the limit."""
    rng = np.random.default_rng(seed)
    tilt = np.where(rng.random(k) < 0.5, limit, rng.uniform(0.0, limit, k))
    angles = np.column_stack([rng.uniform(-4, 4, k), tilt, rng.uniform(-4, 4, k)])
    return np.asarray(Rotation.from_euler("ZYZ", angles).as_quat(scalar_first=True))


@pytest.mark.parametrize("kind", GEOMS)
@pytest.mark.parametrize("body", FIXED)
def test_hull_of_a_body_that_does_not_turn_is_exact(tmp_path: Path, body: str, kind: str) -> None:
    scene = scene_of(world(tmp_path, body, kind, 3), body)
    assert scene.shape.kind == "hull"
    assert scene.shape.excess == 0.0
    centres = around(scene, POSITIONS)
    free, distance = is_free(scene, centres), distances(scene, centres)
    assert 300 < free.sum() < POSITIONS - 300
    assert distance[free].min() >= scene.clearance - 1e-6
    report = next(geom for geom in scene.geoms if geom.name == "thing")
    assert report.error <= scene.tolerance
    assert distance[~free].max() <= scene.clearance + report.error + 1e-6


@pytest.mark.parametrize("kind", [kind for kind in GEOMS if kind not in ("hill", "slab", "plane")])
def test_planar_box_keeps_clear(tmp_path: Path, kind: str) -> None:
    scene = scene_of(world(tmp_path, "planar box", kind, 5), "planar box")
    assert (scene.n, scene.shape.kind) == (2, "hull")
    centres = around(scene, POSITIONS)
    free = is_free(scene, centres)
    assert 300 < free.sum() < POSITIONS - 300
    assert distances(scene, centres[free]).min() >= scene.clearance - 1e-6


@pytest.mark.parametrize("geom", ['type="box" size="0.5 0.3 2"', 'type="cylinder" size="0.6 2"'])
def test_planar_box_loses_nothing_beside_upright_walls(tmp_path: Path, geom: str) -> None:
    file = world(tmp_path, "planar box", "box", 0)
    upright = re.sub(r'quat="[^"]*"', 'euler="0 0 50"', file.read_text())
    file.write_text(upright.replace(GEOMS["box"], geom))
    scene = scene_of(file, "planar box")
    centres = around(scene, POSITIONS)
    free, distance = is_free(scene, centres), distances(scene, centres)
    assert distance[free].min() >= scene.clearance - 1e-6
    assert distance[~free].max() <= scene.clearance + scene.geoms[0].error + 1e-6


@pytest.mark.parametrize("kind", GEOMS)
def test_cylinder_holds_the_quadrotor_however_it_tilts(tmp_path: Path, kind: str) -> None:
    scene = scene_of(world(tmp_path, "quadrotor", kind, 7), "quadrotor")
    assert scene.shape.kind == "cylinder"
    assert scene.shape.max_tilt == 0.6
    centres = around(scene, POSITIONS)
    free = is_free(scene, centres)
    assert 300 < free.sum() < POSITIONS - 300
    quats = tilted(int(free.sum()), 0.6)
    assert distances(scene, centres[free], quats).min() >= scene.clearance - 1e-6


def test_a_body_of_several_geoms_is_within_its_hull(tmp_path: Path) -> None:
    """A plate, a mast, a ball at its end and a leaning drum: nothing that a curve loses."""
    parts = """<geom type="box" size="0.3 0.2 0.02"/>
      <geom type="capsule" size="0.03" fromto="0 0 0 0 0 0.4"/>
      <geom type="sphere" size="0.08" pos="0 0 0.4"/>
      <geom type="cylinder" size="0.1 0.06" pos="0.2 0 0.1" euler="40 0 0"/>"""
    file = world(tmp_path, "box", "cylinder", 1)
    file.write_text(file.read_text().replace(BODIES["box"][1], parts))
    scene = scene_of(file, "box")
    assert scene.shape.kind == "hull"
    assert 0.0 < scene.shape.excess <= 0.01
    centres = around(scene, POSITIONS)
    free, distance = is_free(scene, centres), distances(scene, centres)
    assert distance[free].min() >= scene.clearance - 1e-6
    again = scene_of(file, "box", tolerance=scene.tolerance)  # as a run is read again
    assert again.shape.as_dict() == scene.shape.as_dict()
    low, high = scene.shape.extent
    np.testing.assert_allclose(low, [-0.3, -0.2, -0.03], atol=scene.shape.excess)
    np.testing.assert_allclose(high[:2], [0.3, 0.2], atol=scene.shape.excess)
    assert 0.48 <= high[2] <= 0.48 + scene.shape.excess


def test_ball_is_kept_where_nothing_is_smaller(tmp_path: Path) -> None:
    file = world(tmp_path, "point", "box", 0)
    for settings in ({}, {"shape": "ball"}):
        scene = load_scene(file, "point", start=(-2, -2, -2), goal=(2, 2, 2), **settings)  # type: ignore[arg-type]
        assert scene.shape.kind == "ball"
        assert scene.shape.radius == scene.radius == pytest.approx(0.1)
        np.testing.assert_allclose(scene.bounds, [[-2.9] * 3, [2.9] * 3])


def test_hull_moves_with_its_offset_from_the_centre(tmp_path: Path) -> None:
    """A ball 0.5 m beside the frame of its body is a ball there, not one of 0.6 m."""
    file = world(tmp_path, "box", "sphere", 0)
    ball = '<geom type="sphere" size="0.1" pos="0.5 0 0"/>'
    file.write_text(file.read_text().replace(BODIES["box"][1], ball))
    scene = scene_of(file, "box")
    assert scene.radius == pytest.approx(0.6)
    np.testing.assert_allclose(scene.bounds, [[-3.4, -2.9, -2.9], [2.4, 2.9, 2.9]])
    centres = around(scene, 2000)
    free, distance = is_free(scene, centres), distances(scene, centres)
    assert distance[free].min() >= scene.clearance - 1e-6
    assert distance[~free].max() <= scene.clearance + scene.geoms[0].error + 1e-6


def test_workspace_holds_the_whole_body(tmp_path: Path) -> None:
    box = scene_of(world(tmp_path, "box", "sphere", 0), "box")
    turn = np.radians(30.0)
    reach = [
        0.4 * np.cos(turn) + 0.25 * np.sin(turn),
        0.4 * np.sin(turn) + 0.25 * np.cos(turn),
        0.08,
    ]
    np.testing.assert_allclose(box.bounds[1], 3.0 - np.array(reach))
    flown = scene_of(world(tmp_path, "quadrotor", "sphere", 0), "quadrotor")
    heights = flown.shape.extent[0][2], flown.shape.extent[1][2]
    np.testing.assert_allclose(flown.workspace[1][2] - flown.bounds[1][2], heights[1])
    assert heights[1] - heights[0] < 1.2 * flown.radius  # the ball is twice the radius high


def test_cylinder_is_narrower_the_less_it_may_tilt(tmp_path: Path) -> None:
    file = world(tmp_path, "quadrotor", "sphere", 0)
    scenes = [scene_of(file, "quadrotor", "cylinder", max_tilt=t) for t in (0.01, 0.3, 0.6, 1.5)]
    sizes = [scene.shape.extent[1][2] - scene.shape.extent[0][2] for scene in scenes]
    assert sizes == sorted(sizes)
    assert sizes[0] == pytest.approx(0.05 + 0.004, abs=2e-3)  # flat: rotors over the hull
    assert sizes[-1] <= 2.0 * scenes[-1].radius + 1e-3
    assert scene_of(file, "quadrotor", max_tilt=1.5).shape.kind == "ball"  # hardly larger


def test_hull_obstacles_do_not_need_clearance(tmp_path: Path) -> None:
    """Sharp on sharp, without a ball to grow by, also where a slab is cut off at the window."""
    for kind in ("box", "slab", "plane"):
        scene = scene_of(world(tmp_path, "mesh", kind, 2), "mesh", clearance=0.0, tolerance=0.01)
        centres = around(scene, 2000)
        free, distance = is_free(scene, centres), distances(scene, centres)
        assert distance[free].min() >= -1e-6
        assert distance[~free].max() <= 0.01 + 1e-6


@pytest.mark.parametrize(
    ("body", "shape", "settings", "says"),
    [
        ("box", "cylinder", {}, "keeps its orientation; auto, ball, hull do"),
        ("quadrotor", "hull", {}, "tilts as it flies; auto, ball, cylinder do"),
        ("box", "auto", {"max_tilt": 0.3}, "max_tilt is for free bodies"),
        ("quadrotor", "auto", {"max_tilt": -1.0}, "max_tilt must be a finite number > 0"),
        ("quadrotor", "sphere", {}, "'sphere' does not suit"),
    ],
)
def test_shapes_that_do_not_suit_a_body_are_refused(
    tmp_path: Path, body: str, shape: str, settings: dict[str, float], says: str
) -> None:
    with pytest.raises(SceneError, match=says):
        scene_of(world(tmp_path, body, "box", 0), body, shape, **settings)


def test_bodies_that_turn_are_balls(tmp_path: Path) -> None:
    hinge = PLANAR + '<joint name="yaw" axis="0 0 1"/>'
    file = world(tmp_path, "planar box", "box", 0)
    file.write_text(file.read_text().replace(PLANAR, hinge))
    scene = scene_of(file, "planar box")
    assert scene.shape.kind == "ball"
    assert scene.shape.describe().startswith("a disc of 0.412 m")
    with pytest.raises(SceneError, match="may turn"):
        scene_of(file, "planar box", "hull")


def test_free_body_that_lies_on_its_side_is_a_ball(tmp_path: Path) -> None:
    file = world(tmp_path, "box", "sphere", 0)
    text = file.read_text().replace(SLIDES, "<freejoint/>")
    file.write_text(text.replace('<body name="robot">', '<body name="robot" euler="90 0 0">'))
    assert scene_of(file, "box").shape.kind == "ball"
    with pytest.raises(SceneError, match=r"stands tilted by 1.57 rad, beyond 0.6"):
        scene_of(file, "box", "cylinder")
    file.write_text(text.replace('<body name="robot">', '<body name="robot" euler="0 0 50">'))
    assert scene_of(file, "box").shape.kind == "cylinder"
