"""The outer polytope contains the grown shape, and its error is what it says."""

from dataclasses import replace

import numpy as np
import pytest
from shape_samples import SHAPES, rotation, units

from hzmp_sim.scene.copies import outer_of_copy
from hzmp_sim.scene.minkowski import Difference
from hzmp_sim.scene.outer import outer_polytope
from hzmp_sim.scene.shapes import Box, Capsule, Cylinder, Ellipsoid, Hull, Shape, farthest


@pytest.mark.parametrize("name", SHAPES)
def test_nearest_point_is_optimal(name: str) -> None:
    """p in a convex set is its nearest point to x exactly when h(x - p) = (x - p).p."""
    shape = SHAPES[name]()
    n = shape.centre.size
    points = shape.centre + 2.0 * np.random.default_rng(1).normal(size=(300, n))
    nearest = shape.project(points)
    away = points - nearest
    np.testing.assert_allclose(shape.support(away), (away * nearest).sum(axis=1), atol=1e-6)
    directions = units(200, n)
    assert (nearest @ directions.T - shape.support(directions)).max() < 1e-7  # p is in the set


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize(("grow", "tolerance"), [(0.15, 0.1125), (0.25, 0.1875), (0.2, 0.03)])
def test_contains_the_grown_shape_within_the_tolerance(
    name: str, grow: float, tolerance: float
) -> None:
    shape = SHAPES[name]()
    outer = outer_polytope(shape, grow, tolerance)
    n = shape.centre.size
    # Every half-space supports the grown shape: contains it, and touches it.
    support = shape.support(outer.polytope.A) + grow
    np.testing.assert_allclose(outer.polytope.b, support, atol=1e-9)
    # The error is the largest distance of its corners, found here by the class itself.
    corners = outer.polytope.vertices()
    beyond = np.linalg.norm(corners - shape.project(corners), axis=1) - grow
    assert outer.error <= tolerance
    assert outer.error == pytest.approx(max(0.0, float(beyond.max())), abs=1e-6)
    # The same seen from random directions: h_polytope - h_grown never exceeds the error.
    directions = units(500, n, seed=5)
    excess = (corners @ directions.T).max(axis=0) - shape.support(directions) - grow
    assert excess.min() >= -1e-9
    assert excess.max() <= outer.error + 1e-7


@pytest.mark.parametrize("name", SHAPES)
def test_copies_are_contained_within_the_same_error(name: str) -> None:
    """Of a second copy, elsewhere and turned, half-spaces touch and the error is as stated."""
    shape = SHAPES[name]()
    n = shape.centre.size
    core = Box(np.full(n, 0.05), np.eye(n), np.full(n, 0.1))
    copies = [shape, moved(shape)]
    for copy in [*copies, *(Difference(copy, core) for copy in copies)]:
        outer = outer_of_copy(copy, 0.2, 0.1)
        corners = outer.polytope.vertices()
        np.testing.assert_allclose(outer.vertices, corners)
        np.testing.assert_allclose(
            outer.polytope.b, copy.support(outer.polytope.A) + 0.2, atol=1e-9
        )
        beyond = np.linalg.norm(corners - copy.project(corners), axis=1) - 0.2
        assert outer.error == pytest.approx(max(0.0, float(beyond.max())), abs=1e-6)
        assert outer.error <= 0.1


def moved(shape: Shape) -> Shape:
    """A copy that is turned, if it is a box, ellipsoid or polyhedron, and shifted."""
    n = shape.centre.size
    turn, shift = rotation(9) if n == 3 else np.array([[0.6, -0.8], [0.8, 0.6]]), np.full(n, 7.0)
    if isinstance(shape, Hull):
        return shape.moved(turn, shift)
    if isinstance(shape, Capsule):
        return Capsule(shape.ends + shift, shape.radius)
    if isinstance(shape, Box | Ellipsoid):
        return replace(shape, centre=shape.centre + shift, axes=turn @ shape.axes)
    assert isinstance(shape, Cylinder)
    return replace(shape, centre=shape.centre + shift)


@pytest.mark.parametrize(
    ("name", "facets"),
    [("box", 6), ("sphere", 14), ("cylinder", 10), ("rectangle", 4), ("disc", 8)],
)
def test_few_facets_at_the_default_tolerance(name: str, facets: int) -> None:
    outer = outer_polytope(SHAPES[name](), 0.25, 0.1875)
    assert len(outer.polytope.b) == facets


def test_balls_take_the_smallest_of_three_patterns() -> None:
    ball = Capsule(np.zeros((2, 3)), 0.5)
    for tolerance, facets in ((0.74, 6), (0.73, 14), (0.241, 14), (0.239, 26), (0.13, 26)):
        outer = outer_polytope(ball, 0.5, tolerance)
        assert len(outer.polytope.b) == facets
        assert outer.error <= tolerance


def test_finer_tolerance_costs_facets() -> None:
    counts = [len(outer_polytope(SHAPES["sphere"](), 0.2, t).polytope.b) for t in (0.6, 0.1, 0.02)]
    assert counts[0] == 6
    assert counts[0] < counts[1] < counts[2] < 300


@pytest.mark.parametrize(
    "shape",
    [
        Capsule(np.array([[0.0, 0.0, -1000.5]] * 2), 1000.0),
        Cylinder(np.array([0.0, -60.0, -80.0]), np.array([0.0, 0.6, 0.8]), 800.0, 100.0),
        Ellipsoid(np.array([0.0, 0.0, -20.5]), np.eye(3), np.array([900.0, 50.0, 20.0])),
        Box(np.array([0.0, 0.0, -50.0]), np.eye(3), np.array([500.0, 500.0, 50.0])),
    ],
)
def test_a_huge_shape_is_cut_off_at_the_window(shape: Shape) -> None:
    low, high = np.full(3, -2.0), np.full(3, 2.0)
    outer = outer_polytope(shape, 0.2, 0.1, (low, high))
    assert len(outer.polytope.b) < 40
    assert outer.error <= 0.1
    points = np.random.default_rng(0).uniform(low, high, (20_000, 3))
    distance = np.linalg.norm(points - shape.project(points), axis=1)
    inside = outer.polytope.contains(points)
    assert 0 < inside.sum() < len(points)
    assert inside[distance <= 0.2].all()
    assert distance[inside].max() <= 0.3 + 1e-6


@pytest.mark.parametrize("seed", range(20))
def test_farthest_point_of_an_ellipsoid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, k = (3, 3) if seed % 2 else (2, 3)
    centre, generators = rng.normal(size=n), rng.normal(size=(n, k))
    if seed < 4:
        centre *= 0.0  # the hard case of the trust-region problem
    sampled = np.linalg.norm(centre + units(200_000, k, seed) @ generators.T, axis=1).max()
    assert sampled <= farthest(centre, generators) + 1e-9
    assert farthest(centre, generators) == pytest.approx(float(sampled), rel=1e-3)


def test_a_box_gets_a_bevel_along_each_edge_before_its_corners_are_cut() -> None:
    box = Box(np.zeros(3), rotation(6), np.array([1.0, 0.7, 0.5]))
    outers = [outer_polytope(box, 0.2, 0.2 * share) for share in (0.75, 0.6, 0.23, 0.13)]
    assert [len(outer.polytope.b) for outer in outers] == [6, 18, 18, 26]
    errors = np.array([outer.error for outer in outers]) / 0.2
    np.testing.assert_allclose(
        errors, [3**0.5 - 1.0, 1.5**0.5 - 1.0, 1.5**0.5 - 1.0, 0.1281], atol=1e-4
    )
