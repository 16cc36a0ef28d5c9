"""Leaves as an ellipsotope sees them: bounds for all at once against one exact test a leaf."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_array

from hzmp_planners.errors import ShapeError
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.sets import Activity, Ellipsotope, HybridZonotope, Polytope
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope
from oracles import Floats, random_free_points, random_world

seeds = st.integers(0, 2**32 - 1)


def random_leaves(rng: np.random.Generator, n: int, count: int) -> list[ConstrainedZonotope]:
    centres = rng.uniform(-3.0, 3.0, (count, 1, n))
    points = centres + rng.standard_normal((count, n + 3, n)) * rng.uniform(0.1, 1.5, (count, 1, 1))
    return [ConstrainedZonotope.from_vertices(V) for V in points]


@settings(max_examples=20)
@given(seeds, st.integers(2, 3), st.sampled_from([1e-4, 1.0, 1e4]))
def test_classes_agree_with_the_exact_intersection(seed: int, n: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    leaves = [size * np.eye(n) @ leaf for leaf in random_leaves(rng, n, 30)]
    s, g = rng.uniform(-2.0, 2.0, (2, n)) * size
    informed = Ellipsotope.informed(s, g, math.dist(s, g) * rng.uniform(1.0001, 1.5))
    found = informed.classify([leaf for leaf in leaves if isinstance(leaf, ConstrainedZonotope)])
    for leaf, activity in zip(leaves, found, strict=True):
        V = leaf.vertices()
        farthest = (np.linalg.norm(V - s, axis=1) + np.linalg.norm(V - g, axis=1)).max()
        cost = 2.0 * np.linalg.svd(informed.G, compute_uv=False).max()
        assert (activity == Activity.ACTIVE) == (farthest <= cost)
        # The constrained convex generators of leaf and ellipsotope together: exact, one at a time.
        assert (activity == Activity.INACTIVE) == (informed & leaf).is_empty()


def test_classes_agree_with_the_shortest_detour_through_each_face() -> None:
    rng = np.random.default_rng(4)
    world = random_world(rng, "rotated", 2, 12)
    space = world.free_space()
    s, g = random_free_points(rng, world, 2)
    corners = space.graph.corners
    detour, _ = least_detour(corners, s, g)
    faces = [ConstrainedZonotope.from_vertices(face) for face in corners]
    costs = np.quantile(detour, [0.1, 0.5, 0.9])
    for cost in costs:
        reached = Ellipsotope.informed(s, g, cost + 1e-7).classify(faces) > Activity.INACTIVE
        clear = np.abs(detour - cost) > 1e-6
        assert (reached == (detour <= cost))[clear].all()
        assert 0 < reached.sum() < len(faces)


def grid(side: int) -> HybridZonotope:
    """side x side unit squares as one union."""
    lattice = np.array([[i, j] for i in range(side + 1) for j in range(side + 1)], dtype=float)
    low = np.array([i * (side + 1) + j for i in range(side) for j in range(side)])
    corners = (low[:, None] + np.array([0, 1, side + 1, side + 2])).astype(np.int64)
    columns = np.repeat(np.arange(side * side), 4)
    shape = (len(lattice), side * side)
    M = csc_array((np.ones(columns.size), (corners.ravel(), columns)), shape=shape)
    return HybridZonotope.from_vertices(lattice, M)


def test_a_union_is_classified_without_making_its_leaves() -> None:
    union = grid(30)
    informed = Ellipsotope.informed([8.0, 9.0], [21.0, 18.0], 19.0)
    found = informed.classify(union)
    assert not union.leaf_table._made
    assert (found == informed.classify(union.leaves())).all()
    assert set(found.tolist()) == {0, 1, 2}
    # Area between that of the active squares and that of all squares that are reached.
    assert (found == Activity.ACTIVE).sum() <= informed.volume() <= (found > 0).sum()


def test_touching_counts_as_partial_and_whole_covers_as_active() -> None:
    ball = Ellipsotope(np.eye(2), np.zeros(2))

    def activity(points: list[list[float]]) -> Activity:
        return Activity(ball.classify([Polytope.from_vertices(points)])[0])

    assert activity([[1, -1], [2, -1], [2, 1], [1, 1]]) is Activity.PARTIAL
    assert activity([[1 + 1e-6, -1], [2, -1], [2, 1], [1 + 1e-6, 1]]) is Activity.INACTIVE
    assert activity([[1, 0]]) is Activity.ACTIVE
    assert activity([[0.6, 0.8], [-0.6, 0.8], [0, -1]]) is Activity.ACTIVE
    assert activity([[-3, -3], [3, -3], [3, 3], [-3, 3]]) is Activity.PARTIAL
    assert activity([[2, 2]]) is Activity.INACTIVE


def test_straight_lines_and_ellipsotopes_with_groups_are_classified_one_by_one() -> None:
    squares = [Polytope.from_box([x, 0.0], [x + 1.0, 1.0]) for x in (0.0, 1.5, 3.0, 4.1)]
    line = Ellipsotope.informed([0.5, 0.5], [3.5, 0.5], 3.0)
    assert line.classify(squares).tolist() == [1, 1, 1, 0]
    diamond = Ellipsotope(np.eye(2), np.array([0.5, 0.5]), p=1.0)
    assert diamond.classify(squares).tolist() == [Activity.ACTIVE, Activity.PARTIAL, 0, 0]
    cut = Ellipsotope(4.0 * np.eye(2), np.array([0.5, 0.5]), np.array([[1.0, 0.0]]), np.zeros(1))
    assert cut.classify(squares).tolist() == [Activity.PARTIAL, 0, 0, 0]


def nothing() -> ConstrainedZonotope:
    return ConstrainedZonotope(np.eye(2), np.zeros(2), np.ones((1, 2)), np.array([3.0]))


def test_what_cannot_be_classified_is_refused() -> None:
    ball = Ellipsotope(np.eye(2), np.zeros(2))
    with pytest.raises(ShapeError, match="dimensions"):
        ball.classify([Polytope.from_box([0, 0, 0], [1, 1, 1])])
    with pytest.raises(ShapeError, match="leaf 1 is empty"):
        ball.classify([Polytope.from_box([0, 0], [1, 1]), nothing()])
    with pytest.raises(ShapeError, match="curved"):
        ball.classify([ball])
    assert ball.classify([]).shape == (0,)


@pytest.mark.parametrize("directions", [3, 8, 24])
def test_an_ellipsotope_lies_between_its_constrained_zonotopes(directions: int) -> None:
    def area(V: Floats) -> float:
        return Polytope.from_vertices(V).volume()

    informed = Ellipsotope.informed([0.0, 0.0], [3.0, 1.0], 3.6)
    outer, inner = informed.enclosing_zonotope(directions), informed.enclosed_zonotope(directions)
    assert outer.contains_set(informed)
    assert informed.contains_set(inner)
    ratio = math.cos(math.pi / directions)
    assert area(inner.vertices()) <= informed.volume() <= area(outer.vertices())
    for d in np.random.default_rng(0).standard_normal((20, 2)):
        middle = informed.c @ d
        assert outer.support(d) - middle <= (informed.support(d) - middle) / ratio + 1e-9
        assert inner.support(d) - middle >= (informed.support(d) - middle) * ratio - 1e-9
