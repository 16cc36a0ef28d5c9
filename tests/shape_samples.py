"""Shapes of every kind, in the plane and in space, and random directions."""

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from hzmp_planners._arrays import Floats
from hzmp_sim.scene.shapes import Box, Capsule, Cylinder, Ellipsoid, Hull, Shape


def rotation(seed: int) -> Floats:
    return np.asarray(Rotation.random(random_state=seed).as_matrix())


def round_hull() -> Hull:
    points = np.random.default_rng(3).normal(size=(150, 3))
    return Hull.from_points(points / np.linalg.norm(points, axis=1)[:, None])


SHAPES: dict[str, Callable[[], Shape]] = {
    "box": lambda: Box(np.array([1.0, -2.0, 0.5]), rotation(1), np.array([0.5, 0.2, 1.0])),
    "sphere": lambda: Capsule(np.full((2, 3), 0.3), 0.5),
    "capsule": lambda: Capsule(np.array([[0.0, 0.0, 0.0], [0.3, 0.2, 1.0]]), 0.3),
    "cylinder": lambda: Cylinder(np.zeros(3), rotation(2)[:, 0], 0.5, 0.7),
    "coin": lambda: Cylinder(np.zeros(3), rotation(3)[:, 0], 1.0, 0.01),
    "ellipsoid": lambda: Ellipsoid(np.ones(3), rotation(4), np.array([0.3, 0.5, 1.0])),
    "pancake": lambda: Ellipsoid(np.ones(3), rotation(5), np.array([0.02, 0.5, 1.0])),
    "hull": lambda: Hull.from_points(np.random.default_rng(0).normal(size=(12, 3))),
    "round hull": round_hull,
    "flat hull": lambda: Hull.from_points(
        np.column_stack([np.random.default_rng(1).normal(size=(9, 2)), np.zeros(9)])
    ),
    "needle": lambda: Hull.from_points(np.array([[0.0, 0.0, 0.0], [3.0, 0.1, 0.0]])),
    "disc": lambda: Capsule(np.ones((2, 2)), 0.5),
    "stadium": lambda: Capsule(np.array([[0.0, 0.0], [1.0, 0.5]]), 0.2),
    "rectangle": lambda: Box(np.zeros(2), np.eye(2), np.array([1.0, 2.0])),
    "ellipse": lambda: Ellipsoid(np.zeros(2), np.eye(2), np.array([0.3, 1.0])),
    "polygon": lambda: Hull.from_points(np.random.default_rng(2).normal(size=(8, 2))),
}


def units(k: int, n: int, seed: int = 0) -> Floats:
    directions = np.random.default_rng(seed).normal(size=(k, n))
    return np.asarray(directions / np.linalg.norm(directions, axis=1)[:, None])
