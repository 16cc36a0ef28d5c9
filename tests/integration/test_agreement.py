"""What the planner calls free is free for MuJoCo, and the reverse up to the stated errors.

Bodies are the balls that hold them here, in any attitude; other shapes: `test_scene_body_shape`.
"""

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest
from geom_samples import OCTAHEDRON, SOLIDS
from scipy.spatial.transform import Rotation

from hzmp_planners._arrays import Bools, Floats
from hzmp_sim.scene import Scene, load_scene
from hzmp_sim.simulation.parts import Pair, PairDistances

POSITIONS = 10_000
CLEARANCE = 1e-3
"""Next to nothing [m], so that a position free for the planner all but touches."""
ROUNDING = 1e-6
"""Of MuJoCo's iterations and of mesh vertices in single precision [m]."""

_BALL = np.random.default_rng(0).normal(size=(60, 3))
_BALL *= 0.7 / np.linalg.norm(_BALL, axis=1)[:, None]
_TERRAIN = np.random.default_rng(1).uniform(size=(5, 6))
_L_FOOT = "0 0 {z} 1 0 {z} 1 0.3 {z} 0.3 0.3 {z} 0.3 1 {z} 0 1 {z} "
_L_FACES = "0 2 1 0 3 2 0 4 3 0 5 4 6 7 8 6 8 9 6 9 10 6 10 11 " + " ".join(
    f"{i} {j} {j + 6} {i} {j + 6} {i + 6}" for i, j in [(k, (k + 1) % 6) for k in range(6)]
)
ASSETS = f"""
  <mesh name="octahedron" vertex="{OCTAHEDRON}"/>
  <mesh name="mirrored" scale="1.3 -0.6 0.5" vertex="0 0 0  1 0 0  0 1 0  0 0 1  0.8 0.9 0.7"/>
  <mesh name="ball" vertex="{" ".join(f"{x:.9g}" for x in _BALL.ravel())}"/>
  <mesh name="angle" vertex="{_L_FOOT.format(z=-0.3) + _L_FOOT.format(z=0.3)}" face="{_L_FACES}"/>
  <hfield name="terrain" nrow="5" ncol="6" size="1.2 1 0.6 0.2"
          elevation="{" ".join(f"{z:.6g}" for z in _TERRAIN.ravel())}"/>"""
GEOMS = {
    **SOLIDS,
    "plane": 'type="plane" size="1 1 0.1"',
    "hfield": 'type="hfield" hfield="terrain"',
    "rough mesh": 'type="mesh" mesh="ball"',
    "scaled and mirrored mesh": 'type="mesh" mesh="mirrored"',
    "non-convex mesh as its hull": 'type="mesh" mesh="angle"',
    "non-convex mesh in pieces": 'type="mesh" mesh="angle"',
    "sdf": 'type="sdf" mesh="octahedron"',
    "geom with a margin": 'type="box" size="0.5 0.3 0.8" margin="0.2"',
}
SPATIAL, PLANAR, UPRIGHT = "point in space", "point in the plane", "point beside upright geoms"


@pytest.fixture(scope="module", autouse=True)
def _cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        (kind, body)
        for kind in GEOMS
        for body in (SPATIAL, PLANAR, UPRIGHT, "quadrotor")
        if (kind, body) != ("plane", UPRIGHT)  # a floor
    ],
)
def test_planner_and_mujoco_agree(tmp_path: Path, kind: str, body: str) -> None:
    rng = np.random.default_rng([*kind.encode(), *body.encode()])
    scene = load(tmp_path, kind, body, rng)
    assert scene.n == (2 if body in (PLANAR, UPRIGHT) else 3)
    X = positions(scene, rng)
    free = scene.free_space().contains(X)
    assert 500 < free.sum() < POSITIONS - 500
    keep = CLEARANCE + (0.2 if "margin" in kind else 0.0)
    nearest, middle, touching = measure(scene, X, free, keep, rng)
    assert not touching.any()
    assert nearest[free].min() >= keep - ROUNDING
    error = max(scene.geoms[geom].error for geom in scene.obstacle_geoms)
    assert error <= scene.tolerance
    assert middle[~free].max() <= keep + error + beyond_ball(scene, keep, error) + ROUNDING


def load(folder: Path, kind: str, body: str, rng: np.random.Generator) -> Scene:
    """A world with one geom at a random pose, and the body where there is room for it."""
    turns = Rotation.from_quat(rng.standard_normal((2, 4)))
    if body == UPRIGHT:
        turns = Rotation.from_euler("z", rng.uniform(0.0, 6.0, (2, 1)))
    quats = [" ".join(map(str, turn)) for turn in turns.as_quat(scalar_first=True)]
    shift = " ".join(map(str, rng.uniform(-0.2, 0.2, 3)))
    file = folder / "scene.xml"
    file.write_text(f"""<mujoco>
      <option ccd_tolerance="1e-10" ccd_iterations="200"/>
      <custom><numeric name="workspace" data="-3 -3 -3 3 3 3"/></custom>
      <asset>{ASSETS}</asset>
      <worldbody>
        <body pos="0.1 -0.2 0.1" quat="{quats[0]}">
          <geom name="thing" {GEOMS[kind]} pos="{shift}" quat="{quats[1]}"/>
        </body>
      </worldbody></mujoco>""")
    n, name = (2 if body in (PLANAR, UPRIGHT) else 3), body.split()[0]
    for spot in np.array(np.meshgrid(*[(-2.7, 2.7)] * n)).reshape(n, -1).T:
        try:
            return load_scene(
                file,
                name,
                start=spot,
                goal=spot,
                clearance=CLEARANCE,
                convex_decomposition="pieces" in kind,
                shape="ball",
            )
        except ValueError as error:
            if "inside obstacle" not in str(error):
                raise
    pytest.fail("the obstacle fills the workspace")


def positions(scene: Scene, rng: np.random.Generator) -> Floats:
    """Random centres (k, n): a third anywhere, the others at the surface of an obstacle.

    Half of these are within 1 nm to 10 cm of it, half spread over the space to the geom inside.
    """
    lo, hi = scene.bounds
    found = [rng.uniform(lo, hi, (POSITIONS // 3, scene.n))]
    missing = POSITIONS - len(found[0])
    while missing > 0:
        block = scene.obstacles[rng.integers(len(scene.obstacles))]
        middle = np.clip(block.vertices(), lo, hi).mean(axis=0)
        depth = block.b - block.A @ middle
        if depth.min() <= 0.0:
            continue
        rays = rng.standard_normal((200, scene.n))
        # Half of them nearly across a facet: round shapes touch theirs in one point only.
        rays[::2] *= 10.0 ** rng.uniform(-6.0, -1.0, (100, 1))
        rays[::2] += block.A[rng.integers(len(block.A), size=100)]
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        rise = np.maximum(rays @ block.A.T, 1e-9)
        surface = (depth / rise).min(axis=1)
        near = 10.0 ** rng.uniform(-9.0, -1.0, 200) * rng.choice([-1.0, 1.0], 200)
        length = np.where(rng.random(200) < 0.5, surface + near, surface * rng.uniform(0.6, 1.0))
        X = middle + length[:, None] * rays
        X = X[((lo <= X) & (hi >= X)).all(axis=1)][:missing]
        missing -= len(X)
        found.append(X)
    return np.vstack(found)


def measure(
    scene: Scene, X: Floats, free: Bools, keep: float, rng: np.random.Generator
) -> tuple[Floats, Floats, Bools]:
    """By MuJoCo, shape (k,) each: distance of the body where free, that of its first geom, contact.

    The first geom holds the body's centre, and no point of the body is farther from that than the
    radius: what is `keep` and the radius from the first geom needs no further measurements.
    """
    model, data = scene.model, mujoco.MjData(scene.model)
    data.qpos[:] = scene.initial_qpos
    mujoco.mj_kinematics(model, data)
    measures, things = PairDistances(scene, data), dict[tuple[int, int], list[Pair]]()
    for pair in measures.pairs:
        things.setdefault((pair.other, pair.part), []).append(pair)
    every = 20 if scene.geoms[scene.obstacle_geoms[0]].type == "sdf" else 1  # 1 ms for a contact
    quats = rng.standard_normal((len(X), 4))  # MuJoCo makes them of unit length
    nearest, middle = np.full(len(X), np.inf), np.full(len(X), np.inf)
    touching = np.zeros(len(X), dtype=np.bool_)
    for k, x in enumerate(X):
        data.qpos[: scene.n] = scene.initial_qpos[: scene.n] + x - scene.start
        if model.nq == 7:
            data.qpos[3:] = quats[k]
        mujoco.mj_kinematics(model, data)
        measures.update()
        for first, *others in things.values():
            distance = measures.distance(first)
            middle[k] = min(middle[k], distance)
            if free[k]:
                if distance < scene.radius + keep:
                    distance = min([distance, *map(measures.distance, others)])
                nearest[k] = min(nearest[k], distance)
        if free[k] and k % every == 0:
            mujoco.mj_forward(model, data)
            touching[k] = data.ncon > 0
    return nearest, middle, touching


def beyond_ball(scene: Scene, keep: float, error: float) -> float:
    """How much farther than the reported error a blocked position may be from the geom [m].

    The planner takes a body as the ball about it, of which the first geom holds the centre; and a
    planar one as the upright cylinder about that, so the geom may be over its edge.
    """
    if scene.height is not None:
        across, up = scene.radius + keep + error, scene.radius + CLEARANCE
        return float(np.hypot(across, up)) - across
    return 0.0 if len(scene.body_geoms) == 1 else scene.radius
