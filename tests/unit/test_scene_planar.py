"""Slices of shapes at a height, against dense samples of the shapes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hzmp_planners._arrays import Floats
from hzmp_sim.scene.geoms import HalfSpace, corners
from hzmp_sim.scene.planar import (
    is_upright_prism,
    slice_halfspace,
    slice_shape,
    slice_support,
    vertical_range,
)
from hzmp_sim.scene.shapes import Box, Capsule, Cylinder, Ellipsoid, Hull, Shape

TILTED = np.asarray(Rotation.from_euler("xyz", [0.5, 0.3, 1.0]).as_matrix())
SHAPES: dict[str, Shape] = {
    "box": Box(np.zeros(3), TILTED, np.array([0.5, 0.3, 0.8])),
    "upright box": Box(np.zeros(3), np.eye(3)[:, [2, 0, 1]], np.array([0.5, 0.3, 0.8])),
    "sphere": Capsule(np.array([[0.1, 0.2, 0.4]] * 2), 0.6),
    "capsule": Capsule(np.array([[-0.5, 0.0, -0.4], [0.4, 0.2, 0.3]]), 0.4),
    "upright capsule": Capsule(np.array([[0.1, 0.0, -0.8], [0.1, 0.0, -0.2]]), 0.4),
    "cylinder": Cylinder(np.zeros(3), TILTED[:, 2], 0.6, 0.3),
    "upright cylinder": Cylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.6, 0.3),
    "ellipsoid": Ellipsoid(np.zeros(3), TILTED, np.array([0.2, 0.5, 0.9])),
    "hull": Hull.from_points(np.random.default_rng(0).normal(size=(12, 3)) * 0.5),
}


def circle(k: int) -> Floats:
    angle = 2.0 * np.pi * np.arange(k) / k
    return np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize(("low", "high"), [(-0.05, 0.05), (0.1, 0.25), (-3.0, 3.0), (0.2, 0.2)])
def test_slice_matches_samples(name: str, low: float, high: float) -> None:
    shape = SHAPES[name]
    bottom, top = vertical_range(shape)
    if bottom >= high or top <= low:  # the same slice where this shape is
        low, high = low + 0.5 * (bottom + top), high + 0.5 * (bottom + top)
    lo, hi = -shape.support(-np.eye(3)), shape.support(np.eye(3))
    lo[2], hi[2] = max(lo[2], low), min(hi[2], high)
    points = np.random.default_rng(1).uniform(lo, hi, (40_000, 3))
    inside = np.linalg.norm(shape.project(points) - points, axis=1) < 1e-12
    directions = circle(24)
    sampled = (points[inside, :2] @ directions.T).max(axis=0)
    exact = slice_support(shape, directions, low, high)
    assert (sampled <= exact + 1e-9).all()
    assert (exact - sampled).max() < 0.08
    flat, excess = slice_shape(shape, low, high, 0.002)
    assert (flat.support(directions) >= exact - 1e-6).all()
    assert (flat.support(directions) - exact).max() <= excess + 1e-6
    assert excess <= 0.002


def test_slice_of_a_cone_like_hull_is_closed_form() -> None:
    """Square pyramid of height 1 and half base 1: at height z its cut is a square of half 1 - z."""
    pyramid = Hull.from_points(
        np.array([[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0], [0, 0, 1.0]])
    )
    flat, excess = slice_shape(pyramid, 0.4, 5.0, 0.01)
    assert excess == 0.0
    np.testing.assert_allclose(flat.support(np.vstack([np.eye(2), -np.eye(2)])), 0.6)
    np.testing.assert_allclose(slice_support(pyramid, np.eye(2), 0.4, 5.0), 0.6, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "low", "high", "expected"),
    [
        ("upright box", -0.4, 0.4, True),
        ("upright box", -0.4, 0.6, False),  # not as high as the range
        ("box", -0.1, 0.1, False),
        ("upright cylinder", -0.3, 0.3, True),
        ("sphere", 0.3, 0.5, False),
        ("upright capsule", -0.8, -0.2, True),
        ("upright capsule", -0.8, -0.1, False),
    ],
)
def test_upright_prism(name: str, low: float, high: float, *, expected: bool) -> None:
    assert is_upright_prism(SHAPES[name], low, high) is expected


def test_upright_prism_of_a_mesh() -> None:
    base = circle(7)
    prism = np.vstack([np.column_stack([base, np.full(7, z)]) for z in (-1.0, 1.0)])
    assert is_upright_prism(Hull.from_points(prism), -1.0, 1.0)
    assert not is_upright_prism(Hull.from_points(prism * [1, 1, 0.5] + [0, 0, 0.5]), -1.0, 1.0)
    leaning = prism + np.column_stack([0.1 * prism[:, 2], np.zeros(14), np.zeros(14)])
    assert not is_upright_prism(Hull.from_points(leaning), -1.0, 1.0)


def test_planes() -> None:
    floor = HalfSpace(np.array([0.0, 0.0, 1.0]), 0.0)
    assert slice_halfspace(floor, 0.0, 0.2) is None  # the body stands on it
    flooded = slice_halfspace(floor, -0.1, 0.1)
    assert flooded is not None
    assert flooded.offset == np.inf
    ramp = slice_halfspace(HalfSpace(np.array([0.6, 0.0, 0.8]), 1.0), 0.0, 0.5)
    assert ramp is not None  # solid where 0.6 x + 0.8 z <= 1: up to x = 1 / 0.6 at z = 0
    np.testing.assert_allclose(ramp.normal, [1.0, 0.0])
    assert ramp.offset == pytest.approx(1.0 / 0.6)


def test_corners_of_a_box() -> None:
    box = Box(np.ones(3), TILTED, np.array([1.0, 2.0, 3.0]))
    local = (corners(box) - 1.0) @ TILTED
    assert sorted(map(tuple, np.round(local, 9))) == sorted(
        (x, y, z) for x in (-1.0, 1.0) for y in (-2.0, 2.0) for z in (-3.0, 3.0)
    )
