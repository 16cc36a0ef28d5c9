"""Sums of shapes by nearest points, and the cylinder around what tilts."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shape_samples import SHAPES, units

from hzmp_sim.scene.minkowski import Difference
from hzmp_sim.scene.outer import outer_polytope
from hzmp_sim.scene.shapes import Box, Capsule, Cylinder, Hull, Shape
from hzmp_sim.scene.upright import upright_cylinder

CORES: dict[str, Shape] = {
    "point": Capsule(np.array([[0.3, 0.1, 0.0], [0.3, 0.1, 0.0]]), 0.0),
    "segment": Capsule(np.array([[-0.3, 0.1, 0.0], [0.4, 0.2, 0.1]]), 0.0),
    "box": Box(np.array([0.0, 0.1, 0.0]), np.eye(3), np.array([0.4, 0.3, 0.05])),
    "cylinder": Cylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.3, 0.1),
    "hull": Hull.from_points(np.random.default_rng(5).normal(size=(10, 3)) * 0.2),
    "interval": Capsule(np.array([[-0.3, 0.0], [0.3, 0.2]]), 0.0),
    "square": Box(np.zeros(2), np.eye(2), np.array([0.2, 0.2])),
}
PAIRS = [
    (name, core)
    for name in SHAPES
    for core in CORES
    if SHAPES[name]().centre.size == CORES[core].centre.size
]


@pytest.mark.parametrize(("name", "core"), PAIRS)
def test_nearest_point_of_a_sum_is_in_it_and_optimal(name: str, core: str) -> None:
    """p in a convex set is its nearest point to x exactly when h(x - p) = (x - p).p."""
    total = Difference(SHAPES[name](), CORES[core])
    n = total.centre.size
    points = total.centre + 2.0 * np.random.default_rng(1).normal(size=(100, n))
    nearest = total.project(points)
    away = points - nearest
    directions = units(200, n)
    assert (nearest @ directions.T - total.support(directions)).max() < 1e-7  # p is in the set
    np.testing.assert_allclose(total.support(away), (away * nearest).sum(axis=1), atol=2e-4)


@pytest.mark.parametrize(("name", "core"), PAIRS)
def test_outer_polytope_of_a_sum_holds_it_within_the_error(name: str, core: str) -> None:
    total = Difference(SHAPES[name](), CORES[core])
    n = total.centre.size
    outer = outer_polytope(total, 0.05, 0.1)
    assert outer.error <= 0.1
    A, b = outer.polytope.A, outer.polytope.b
    assert (b - total.support(A) - 0.05).min() > -1e-9
    surface = total.project(total.centre + 9.0 * units(200, n, 3)) + 0.05 * units(200, n, 4)
    assert outer.polytope.violation(surface).max() < 1e-9


def test_box_on_box_keeps_six_facets() -> None:
    total = Difference(Box(np.zeros(3), np.eye(3), np.ones(3)), CORES["box"])
    assert len(outer_polytope(total, 0.05, 0.05).polytope.b) == 6
    turned = Box(np.zeros(3), Rotation.from_euler("z", 0.7).as_matrix(), np.ones(3))
    assert len(outer_polytope(Difference(turned, CORES["box"]), 0.05, 0.05).polytope.b) == 10


@pytest.mark.parametrize("limit", [0.0, 0.2, 0.6, 1.2, 2.0])
@pytest.mark.parametrize("seed", range(4))
def test_cylinder_holds_every_tilt_and_is_not_larger_than_need_be(seed: int, limit: float) -> None:
    rng = np.random.default_rng(seed)
    points, radii = rng.normal(size=(12, 3)) * [1.0, 1.0, 0.3], rng.uniform(0.0, 0.2, 12)
    core, rounding = upright_cylinder(points, radii, limit)
    angles = np.column_stack(
        [
            rng.uniform(-4, 4, 4000),
            np.linspace(0.0, limit, 4000),
            rng.uniform(-4, 4, 4000),
        ]
    )
    turned = np.einsum("tij,kj->tki", Rotation.from_euler("ZYZ", angles).as_matrix(), points)
    directions = units(300, 3, seed)
    swept = (turned @ directions.T + radii[:, None]).max(axis=(0, 1))
    assert (swept - core.support(directions) - rounding).max() <= 1e-9
    # It is touched from above, from below, and from the side: nothing is given away.
    reach = turned + radii[:, None]
    assert core.centre[2] + core.half + rounding == pytest.approx(reach[..., 2].max(), abs=0.1)
    assert core.centre[2] - core.half - rounding == pytest.approx(
        (turned - radii[:, None])[..., 2].min(), abs=0.1
    )
    across = np.linalg.norm(turned[..., :2], axis=2) + radii
    assert core.radius + rounding == pytest.approx(across.max(), abs=0.1)
