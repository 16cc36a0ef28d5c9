"""Height fields as convex bodies, against MuJoCo and against their own triangles."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from hzmp_planners._arrays import Bools, Floats
from hzmp_sim.scene import load_scene
from hzmp_sim.scene.height_field import HeightField
from hzmp_sim.scene.shapes import Hull
from hzmp_sim.simulation.parts import PairDistances


def field(z: Floats) -> HeightField:
    rows, columns = z.shape
    return HeightField(np.linspace(-2.0, 2.0, columns), np.linspace(-1.0, 1.0, rows), z, 0.3)


def rough(seed: int, rows: int = 7, columns: int = 9) -> Floats:
    return np.random.default_rng(seed).uniform(0.0, 1.0, (rows, columns))


def smooth(n: int = 17) -> Floats:
    u = np.linspace(0.0, 1.0, n)
    return 0.5 + 0.2 * np.sin(5.0 * u) * np.cos(4.0 * u[:, None])


def surface(z: Floats, points: Floats) -> Floats:
    """Height of the triangles above points (k, 2) of the field: the diagonal of a cell is ridge."""
    rows, columns = z.shape
    u = (points[:, 0] + 2.0) / 4.0 * (columns - 1)
    v = (points[:, 1] + 1.0) / 2.0 * (rows - 1)
    c, r = np.minimum(u.astype(int), columns - 2), np.minimum(v.astype(int), rows - 2)
    s, t = u - c, v - r
    a, b, far, d = z[r, c], z[r, c + 1], z[r + 1, c + 1], z[r + 1, c]
    right = a + s * (b - a) + t * (far - b)
    left = a + t * (d - a) + s * (far - d)
    return np.asarray(np.where(s >= t, right, left))


def covered(bodies: list[tuple[Floats, float]], points: Floats, slack: float) -> Bools:
    inside = np.zeros(len(points), dtype=bool)
    for corners, _ in bodies:
        planes = Hull.from_points(corners).equations
        inside |= (points @ planes[:, :3].T + planes[:, 3]).max(axis=1) <= slack
    return inside


@pytest.mark.parametrize("tolerance", [0.0, 0.03, 0.2, 10.0])
@pytest.mark.parametrize("name", ["rough", "smooth"])
def test_bodies_cover_the_field_and_reach_above_it_by_the_excess_only(
    name: str, tolerance: float
) -> None:
    z = rough(0) if name == "rough" else smooth()
    bodies = field(z).bodies(tolerance)
    flat = np.random.default_rng(1).uniform([-2.0, -1.0], [2.0, 1.0], (4000, 2))
    top = surface(z, flat)
    below = np.column_stack([flat, top - 1e-6])
    assert covered(bodies, below, 1e-9).all()
    excess = max(body[1] for body in bodies)
    assert excess <= tolerance
    above = np.column_stack([flat, top + excess + 1e-6])
    assert not covered(bodies, above, -1e-9).any()
    assert not covered(bodies, np.column_stack([flat, np.full(4000, -0.3001)]), 0.0).any()


def test_what_is_convex_is_one_body() -> None:
    u = np.linspace(-1.0, 1.0, 9)
    plane, dome = 0.5 + 0.1 * u + 0.2 * u[:, None], 1.0 - 0.5 * (u**2 + u[:, None] ** 2)
    for z in (np.zeros((9, 9)), plane, dome):
        bodies = field(z).bodies(0.0)
        assert len(bodies) == 1
        assert bodies[0][1] == 0.0


def test_flat_regions_are_few_bodies() -> None:
    z = np.zeros((21, 21))
    z[8:13, 5:9] = 0.4  # a block: its sides slope over one cell
    assert len(field(z).bodies(0.0)) <= 20
    counts = [len(field(smooth()).bodies(tolerance)) for tolerance in (0.0, 0.01, 0.05, 0.2)]
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] < 0.02 * counts[0]


def test_within_keeps_the_cells_of_the_box() -> None:
    part = field(rough(3)).within(np.array([-0.6, -0.2, 0.0]), np.array([0.4, 0.1, 0.5]))
    assert part is not None
    assert part.x[0] <= -0.6 < part.x[1]
    assert part.x[-2] < 0.4 <= part.x[-1]
    assert part.z.shape == (len(part.y), len(part.x))
    np.testing.assert_array_equal(part.z, rough(3)[2:5, 2:6])
    for low, high in (([3.0, -1, 0], [4.0, 1, 1]), ([-2.0, -1, 2], [2.0, 1, 3])):
        assert field(rough(3)).within(np.array(low), np.array(high)) is None


def world(folder: Path, z: Floats, kind: str = "hfield") -> Path:
    heights = " ".join(f"{value:.6f}" for value in z.ravel())
    file = folder / "scene.xml"
    file.write_text(f"""<mujoco>
      <custom><numeric name="workspace" data="-3 -2 -1 3 2 2"/></custom>
      <asset>
        <hfield name="hills" nrow="{z.shape[0]}" ncol="{z.shape[1]}" size="2 1 1 0.3"
                elevation="{heights}"/>
        <mesh name="rock" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/>
      </asset>
      <worldbody>
        <site name="start" pos="-2.6 0 1.8"/><site name="goal" pos="2.6 0 1.8"/>
        <body euler="3 -4 30"><geom name="thing" type="{kind}"
          {'hfield="hills"' if kind == "hfield" else 'mesh="rock"'}/></body>
      </worldbody></mujoco>""")
    return file


def test_reads_what_mujoco_collides(tmp_path: Path) -> None:
    """Contact, which is right however fine the field is, exactly where a part is near the ball."""
    scene = load_scene(world(tmp_path, rough(2, 21, 31)), tolerance=0.02)
    data = mujoco.MjData(scene.model)
    data.qpos[:] = scene.initial_qpos
    mujoco.mj_kinematics(scene.model, data)
    distances = PairDistances(scene, data)
    rng = np.random.default_rng(0)
    hits = 0
    for centre in rng.uniform([-2.0, -1.2, 0.0], [2.0, 1.2, 1.2], (300, 3)):
        data.qpos[:3] = scene.initial_qpos[:3] + centre - scene.start
        mujoco.mj_forward(scene.model, data)
        distances.update()
        contact = bool((data.contact.dist < 0.0).any())
        hits += contact
        nearest = min(distances.distance(pair) for pair in distances.pairs)
        if abs(nearest) > 0.011:  # the parts are merged to half the tolerance
            assert contact == (nearest < 0.0)
    assert 50 < hits < 250


def test_one_geom_has_many_obstacles(tmp_path: Path) -> None:
    scene = load_scene(world(tmp_path, rough(1)), tolerance=0.1)
    report = scene.geoms[0]
    assert (report.type, report.role, report.name) == ("hfield", "obstacle", "thing")
    assert report.parts == len(scene.obstacles) == scene.obstacle_geoms.count(0) > 10
    assert report.error <= 0.1


def test_sdf_geoms_are_the_hull_of_their_mesh_and_a_warning(tmp_path: Path) -> None:
    scene = load_scene(world(tmp_path, rough(1), "sdf"))
    twin = load_scene(world(tmp_path, rough(1), "mesh"))
    assert scene.geoms[0].type == "sdf"
    np.testing.assert_allclose(scene.obstacles[0].vertices(), twin.obstacles[0].vertices())
    assert "thing is an SDF geom" in scene.warnings[0]
    assert twin.warnings == ()


def test_fields_on_a_plane_that_the_body_moves_in(tmp_path: Path) -> None:
    z = np.zeros((9, 9))
    z[:, 4] = 1.0
    scene = load_scene(world(tmp_path, z), start=(-2.6, 0.0, 0.6), goal=(2.6, 0.0))
    assert scene.n == 2
    assert scene.geoms[0].role == "obstacle"
    ridge = np.vstack([obstacle.vertices() for obstacle in scene.obstacles])
    assert np.ptp(ridge, axis=0).max() < 3.0  # the slice at 0.6 m is narrower than the field
