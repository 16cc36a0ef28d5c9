"""How sets meet: against closed forms for boxes, and against the geometric leaf graph."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_array

from hzmp_planners.errors import ShapeError
from hzmp_planners.sets import (
    ConstrainedZonotope,
    Contact,
    ContactKind,
    ConvexSet,
    Ellipsotope,
    HybridZonotope,
    Polytope,
    Zonotope,
    contact,
    intersects,
    shared_face,
)
from hzmp_planners.sets.form.queries import interior_slack
from hzmp_planners.sets.leaf_pairs import (
    common_point,
    consistency_matrix,
    is_consistent,
    leaf_contact,
    leaf_system,
)
from oracles import Floats, random_world, rotation

seeds = st.integers(0, 2**32 - 1)
TINY = 1e-6


def check_certificate(one: ConvexSet, two: ConvexSet, found: Contact, size: float) -> None:
    """A verdict proves itself: a common point, or a normal with a gap."""
    tol = 1e-7 * size
    if found.kind is ContactKind.APART:
        assert found.point is None
        assert found.normal is not None
        slab = -two.support(-found.normal) - one.support(found.normal)
        assert slab == pytest.approx(found.distance, rel=1e-4, abs=tol)
        assert slab > 0.0
        return
    assert found.distance == 0.0
    assert found.point is not None
    assert one.contains(found.point, tol)[0]
    assert two.contains(found.point, tol)[0]
    if found.kind is ContactKind.TOUCHING and found.normal is not None:
        assert one.support(found.normal) <= -two.support(-found.normal) + tol


def box_contact(
    low: Floats, high: Floats, lo: Floats, hi: Floats
) -> tuple[ContactKind, int, float]:
    """Kind, dimension and distance of two axis-aligned boxes with interior, from their sides."""
    overlap = np.minimum(high, hi) - np.maximum(low, lo)
    if overlap.min() < 0.0:
        return ContactKind.APART, -1, float(np.linalg.norm(np.minimum(overlap, 0.0)))
    kind = ContactKind.OVERLAPPING if overlap.min() > 0.0 else ContactKind.TOUCHING
    return kind, int((overlap > 0.0).sum()), 0.0


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_boxes_meet_as_their_sides_say(n: int, size: float) -> None:
    rng = np.random.default_rng(n)
    kinds = []
    for trial in range(200):
        # Corners on a coarse grid, moved by one millionth now and then: every case is frequent.
        low, lo = rng.integers(0, 4, (2, n)).astype(float)
        high, hi = low + rng.integers(1, 3, n), lo + rng.integers(1, 3, n)
        nudge = TINY * rng.integers(-1, 2, n)
        lo, hi = lo + nudge, hi + nudge
        kind, dimension, distance = box_contact(low, high, lo, hi)
        # In the coordinates as they are, and turned and moved at another size.
        for turned in (np.eye(n), rotation(rng, n)):
            bodies = [
                ConstrainedZonotope.from_vertices(
                    Polytope.from_box(a, b).vertices() @ turned.T * size
                )
                for a, b in ((low, high), (lo, hi))
            ]
            if trial % 3 and turned is not np.eye(n):
                bodies.reverse()
            one, two = bodies
            found = contact(one, two)
            assert (found.kind, found.dimension) == (kind, dimension)
            assert found.distance == pytest.approx(distance * size, rel=1e-4, abs=1e-8 * size)
            check_certificate(one, two, found, 4.0 * size)
        kinds.append((kind, dimension))
    assert len(set(kinds)) >= 4


@pytest.mark.parametrize(("kind", "n"), [("grid", 2), ("rotated", 2), ("rotated", 3), ("grid", 3)])
def test_leaves_touch_in_a_face_exactly_where_the_leaf_graph_has_one(kind: str, n: int) -> None:
    rng = np.random.default_rng(11)
    leaves = 0
    for count in (6, 10, 14) if n == 2 else (4, 6):
        space = random_world(rng, kind, n, count).free_space()
        faces = {tuple(sorted(face.leaves)) for face in space.graph.faces}
        union = space.hybrid_zonotope()
        leaves += union.leaf_count
        found = union.adjacency_matrix(least_dimension=n - 1).tocoo()
        assert {(i, j) for i, j in zip(*found.coords, strict=True) if i < j} == faces
        touching = union.adjacency_matrix().toarray()
        assert (touching >= found.toarray()).all()
        for i, j in list(faces)[:6]:
            face = shared_face(union.leaves()[i], union.leaves()[j])
            assert face.affine_dimension() == n - 1
            (geometric,) = [f for f in space.graph.faces if tuple(sorted(f.leaves)) == (i, j)]
            assert face.contains(geometric.vertices, 1e-9).all()
            low = geometric.vertices.min(axis=0)
            assert low == pytest.approx(face.interval_hull()[0], abs=1e-9)
    assert leaves > 12


@settings(max_examples=25)
@given(seeds, st.integers(2, 3))
def test_any_two_polytopes_meet_as_their_distance_and_intersection_say(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    one = ConstrainedZonotope.from_vertices(rng.standard_normal((n + 3, n)))
    G, shift = rng.standard_normal((n, 4)) / 2.0, rng.standard_normal(n) * 2.5
    two = ConstrainedZonotope(G, shift, rng.standard_normal((1, 4)), rng.random(1) / 4.0)
    found = contact(one, two)
    assert intersects(one, two) == (found.kind is not ContactKind.APART)
    assert (one & two).is_empty() == (found.kind is ContactKind.APART)
    assert one.distance(two) == pytest.approx(found.distance, abs=1e-7)
    assert found.dimension == (-1 if found.kind is ContactKind.APART else n)
    check_certificate(one, two, found, 4.0)
    back = contact(two, one)
    assert (back.kind, back.dimension) == (found.kind, found.dimension)


def test_flat_sets_points_and_empty_sets_meet() -> None:
    square = Polytope.from_box([0, 0], [1, 1])
    inside = Polytope.from_vertices([[0.2, 0.5], [0.8, 0.5]])
    edge = Polytope.from_vertices([[1, 0.2], [1, 0.7]])
    along = Polytope.from_vertices([[1, 0.5], [1, 2.0]])
    corner = Polytope.from_vertices([[1, 1]])
    nothing = Polytope.empty(2)
    verdicts = {
        (square, inside): (ContactKind.OVERLAPPING, 1),
        (square, edge): (ContactKind.TOUCHING, 1),
        (square, corner): (ContactKind.TOUCHING, 0),
        (edge, along): (ContactKind.OVERLAPPING, 1),
        (inside, edge): (ContactKind.APART, -1),
        (inside, inside + np.array([0.0, 0.1])): (ContactKind.APART, -1),
        (inside, inside + np.array([0.1, TINY])): (ContactKind.APART, -1),
        (inside, inside + np.array([0.6, 0.0])): (ContactKind.TOUCHING, 0),
        (corner, corner): (ContactKind.OVERLAPPING, 0),
        (square, nothing): (ContactKind.APART, -1),
    }
    for (one, two), expected in verdicts.items():
        assert isinstance(two, ConvexSet)
        found = contact(one, two)
        assert (found.kind, found.dimension) == expected
        if not two.is_empty():
            check_certificate(one, two, found, 2.0)
    assert contact(square, nothing).distance == math.inf


def test_a_factor_that_the_constraints_fix_does_not_turn_an_overlap_into_a_contact() -> None:
    fixed = ConstrainedZonotope(
        np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5]]), np.zeros(2), np.eye(3)[2:], np.ones(1)
    )
    square = Zonotope(np.eye(2), np.full(2, 0.5))
    plain = interior_slack(fixed.form, square.form)
    assert plain is not None
    assert plain.value == pytest.approx(0.0, abs=1e-9)  # corollary 3.3 on the form as it stands
    found = contact(fixed, square)
    assert (found.kind, found.dimension) == (ContactKind.OVERLAPPING, 2)


def test_curved_sets_meet() -> None:
    disc = Ellipsotope(np.eye(2), np.zeros(2))
    for shift, kind, dimension in (
        (1.5, ContactKind.OVERLAPPING, 2),
        (2.0, ContactKind.TOUCHING, 0),
        (2.0 + TINY, ContactKind.APART, -1),
        (5.0, ContactKind.APART, -1),
    ):
        d = np.array([0.6, 0.8])
        turned = np.column_stack([d, [-0.8, 0.6]])  # a square that faces the disc
        for other in (disc + shift * d, turned @ Zonotope(np.eye(2), np.array([shift, 0.0]))):
            assert isinstance(other, ConvexSet)
            found = contact(disc, other)
            assert (found.kind, found.dimension) == (kind, dimension)
            check_certificate(disc, other, found, 4.0)


def two_cells(shift: list[float]) -> HybridZonotope:
    square = Polytope.from_box([0, 0], [1, 1])
    other = square + shift
    far = square + np.array([9.0, 9.0])
    return HybridZonotope.from_polytopes(
        [c for c in (square, other, far) if isinstance(c, Polytope)]
    )


@pytest.mark.parametrize(
    ("shift", "meets", "kind", "dimension", "slack"),
    [
        ([0.5, 0.5], True, ContactKind.OVERLAPPING, 2, 0.25),
        ([1.0, 0.5], True, ContactKind.TOUCHING, 1, 0.0),
        ([1.0, 1.0], True, ContactKind.TOUCHING, 0, 0.0),
        ([1.0 - TINY, 0.0], True, ContactKind.OVERLAPPING, 2, TINY / 2.0),
        ([1.0 + TINY, 0.0], False, ContactKind.APART, -1, -math.inf),
        ([3.0, 0.0], False, ContactKind.APART, -1, -math.inf),
    ],
)
def test_proposition_3_2_on_the_matrices_agrees_with_the_compact_leaves(
    shift: list[float], meets: bool, kind: ContactKind, dimension: int, slack: float
) -> None:
    union = two_cells(shift)
    for i, j in ((0, 1), (1, 0)):
        point = common_point(union, i, j)
        assert (point is not None) == meets
        if point is not None:
            assert union.leaves()[i].contains(point, 1e-8)[0]
            assert union.leaves()[j].contains(point, 1e-8)[0]
        assert is_consistent(union, i, j)
        found = leaf_contact(union, i, j)
        assert (found.kind, found.dimension) == (kind, dimension)
        assert found.slack == pytest.approx(slack, abs=1e-3 * TINY)
    assert common_point(union, 0, 2) is None
    adjacent = union.adjacency_matrix().toarray()
    assert (adjacent == adjacent.T).all()
    assert adjacent[0, 1] == meets
    assert not adjacent[2].any()


def test_the_consistency_matrix_is_the_projection_of_proposition_3_2_b() -> None:
    # Boxes at (+-3, 0) and (0, +-2), each flat in the other axis: no two have a common point.
    union = HybridZonotope(
        csc_array([[1.0], [0.0]]),
        csc_array([[3.0, 0.0], [0.0, 2.0]]),
        np.zeros(2),
        csc_array([[0.0]]),
        csc_array([[0.0, 0.0]]),
        np.zeros(1),
    )
    M = np.vstack([union.Gc.toarray(), union.Ac.toarray()])
    N = np.vstack([union.Gb.toarray(), union.Ab.toarray()])
    L = (np.eye(3) - M @ np.linalg.pinv(M)) @ N
    np.testing.assert_allclose(consistency_matrix(union), L, atol=1e-12)
    for i in range(union.leaf_count):
        for j in range(union.leaf_count):
            system = leaf_system(union, i, j)
            solvable = np.abs(L @ system.delta_b).max() < 1e-9
            assert is_consistent(union, i, j) == solvable
            assert (common_point(union, i, j) is not None) == (i == j)
            np.testing.assert_allclose(system.r, union.b - union.Ab @ union.binaries[i])


def test_sets_of_different_dimensions_are_refused() -> None:
    with pytest.raises(ShapeError, match="dimensions 2 and 3"):
        contact(Polytope.from_box([0, 0], [1, 1]), Polytope.from_box([0, 0, 0], [1, 1, 1]))
