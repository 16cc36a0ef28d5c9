"""Obstacles against MuJoCo's own distances: free means clear, blocked means near."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from geom_samples import OCTAHEDRON, SOLIDS
from scipy.spatial.transform import Rotation

from hzmp_planners._arrays import Floats
from hzmp_sim.scene import Scene, load_scene

GEOMS = {
    **SOLIDS,
    "rough mesh": 'type="mesh" mesh="ball"',
    "hill": 'type="sphere" size="40"',
    "plane": 'type="plane" size="1 1 0.1"',
}


def world(tmp_path: Path, kind: str, seed: int, *, level: bool = False, extra: str = "") -> Path:
    """One geom at a random pose (`level`: turned about the vertical only), far endpoints."""
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed).as_quat(scalar_first=True)
    if level:
        turn = Rotation.from_euler("z", rng.uniform(0.0, 6.0)).as_quat(scalar_first=True)
    x, y, z = rng.uniform(-0.3, 0.3, 3)
    if kind == "hill":
        x, y, z = 24.0, -24.0, -20.0 + z
    ball = rng.normal(size=(60, 3))
    ball = 0.7 * ball / np.linalg.norm(ball, axis=1)[:, None]
    points = " ".join(f"{value:.9g}" for value in ball.ravel())
    file = tmp_path / "scene.xml"
    file.write_text(f"""<mujoco>
      <option ccd_tolerance="1e-10" ccd_iterations="200"/>
      <custom><numeric name="workspace" data="-3 -3 -3 3 3 3"/></custom>
      <asset>
        <mesh name="octahedron" vertex="{OCTAHEDRON}"/><mesh name="ball" vertex="{points}"/>
      </asset>
      <worldbody>
        <body pos="0.1 -0.2 0.3" euler="20 30 {0 if level else 40}">
          <geom name="thing" {GEOMS[kind]} {extra} pos="{x} {y} {z}"
                quat="{turn[0]} {turn[1]} {turn[2]} {turn[3]}"/>
        </body>
      </worldbody></mujoco>""")
    return file


def distances(scene: Scene, centres: Floats) -> Floats:
    """MuJoCo's distance between the body and the first obstacle with the centre at (k, n)."""
    data = mujoco.MjData(scene.model)
    ball, thing = scene.body_geoms[0], scene.model.geom("thing").id
    found = []
    for centre in scene.to_world(centres):
        data.qpos[:] = scene.initial_qpos
        data.qpos[: scene.n] += centre[: scene.n] - scene.start
        mujoco.mj_kinematics(scene.model, data)
        found.append(mujoco.mj_geomDistance(scene.model, data, ball, thing, 10.0, None))
    return np.array(found)


def free_end(
    file: Path, spots: Floats, clearance: float = 0.05, tolerance: float | None = None
) -> Scene:
    """The scene with start and goal at the first spots that are not inside the obstacle."""
    for spot in spots:
        try:
            return load_scene(
                file, "point", start=spot, goal=spot, clearance=clearance, tolerance=tolerance
            )
        except ValueError as error:
            if "inside obstacle" not in str(error):
                raise
    pytest.fail("the obstacle fills the workspace")


def around(scene: Scene, k: int) -> Floats:
    """Random centres in a box a little larger than the obstacle."""
    vertices = scene.obstacles[0].vertices()
    low = np.maximum(vertices.min(axis=0) - 0.1, scene.bounds[0])
    high = np.minimum(vertices.max(axis=0) + 0.1, scene.bounds[1])
    return np.random.default_rng(k).uniform(low, high, (k, scene.n))


def corners(n: int) -> Floats:
    return np.array(np.meshgrid(*[(-2.8, 2.8)] * n)).reshape(n, -1).T


@pytest.mark.parametrize("kind", GEOMS)
@pytest.mark.parametrize("seed", range(4))
def test_spatial_obstacle_agrees_with_mujoco(tmp_path: Path, kind: str, seed: int) -> None:
    scene = free_end(world(tmp_path, kind, seed), corners(3))
    assert scene.n == 3
    centres = around(scene, 3000)
    outside, distance = scene.obstacles[0].violation(centres) >= 0.0, distances(scene, centres)
    assert 300 < outside.sum() < 2700
    # Free for the planner: MuJoCo sees at least the clearance.
    assert distance[outside].min() >= scene.clearance - 1e-6
    # Clear by more than the tolerance for MuJoCo: free for the planner.
    report = scene.geoms[scene.obstacle_geoms[0]]
    assert report.error <= scene.tolerance
    assert distance[~outside].max() <= scene.clearance + report.error + 1e-6


@pytest.mark.parametrize("kind", [kind for kind in GEOMS if kind != "plane"])
@pytest.mark.parametrize("seed", range(4))
def test_planar_obstacle_agrees_with_mujoco(tmp_path: Path, kind: str, seed: int) -> None:
    scene = free_end(world(tmp_path, kind, seed, level=seed < 2), corners(2))
    assert scene.n == 2
    assert scene.height == 0.0
    centres = around(scene, 2000)
    outside = scene.obstacles[0].violation(centres) >= 0.0
    assert 20 < outside.sum() < 1980
    assert distances(scene, centres[outside]).min() >= scene.clearance - 1e-6
    report = scene.geoms[scene.obstacle_geoms[0]]
    assert 3 <= report.facets <= 12
    assert report.error <= scene.tolerance


@pytest.mark.parametrize("kind", ["box", "cylinder", "mesh"])
def test_margin_counts_as_part_of_the_geom(tmp_path: Path, kind: str) -> None:
    plain = free_end(world(tmp_path, kind, 1), corners(3))
    wide = free_end(world(tmp_path, kind, 1, extra='margin="0.2"'), corners(3), tolerance=0.05)
    centres = around(wide, 4000)
    outside = wide.obstacles[0].violation(centres) >= 0.0
    assert distances(wide, centres[outside]).min() >= plain.clearance + 0.2 - 1e-6


@pytest.mark.parametrize("clearance", [0.0, 0.3])
def test_clearance_is_what_was_asked(tmp_path: Path, clearance: float) -> None:
    scene = free_end(world(tmp_path, "box", 2), corners(3), clearance=clearance, tolerance=0.02)
    centres = around(scene, 4000)
    outside = scene.obstacles[0].violation(centres) >= 0.0
    distance = distances(scene, centres[outside])
    assert clearance - 1e-6 <= distance.min() <= clearance + 0.1
