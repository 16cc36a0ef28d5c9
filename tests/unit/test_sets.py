from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_array
from scipy.spatial import ConvexHull

from hzmp_planners.errors import HzmpError, QueryError, ShapeError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import (
    ConstrainedZonotope,
    Ellipsotope,
    HybridZonotope,
    Polytope,
    Zonotope,
)
from oracles import Floats, random_world

seeds = st.integers(0, 2**32 - 1)


def signs(count: int) -> Floats:
    return np.array(list(product((-1.0, 1.0), repeat=count))).reshape(2**count, count)


def section_vertices(A: Floats, b: Floats) -> Floats:
    """Vertices of {|xi| <= 1, A xi = b}: all but rank(A) factors at a bound."""
    nc, ng = A.shape
    found = []
    for free in np.array(list(product((False, True), repeat=ng))):
        if free.sum() != nc or np.linalg.matrix_rank(A[:, free]) < nc:
            continue
        for fixed in signs(ng - nc):
            xi = np.empty(ng)
            xi[~free] = fixed
            xi[free] = np.linalg.solve(A[:, free], b - A[:, ~free] @ fixed)
            if np.abs(xi).max() <= 1.0 + 1e-12:
                found.append(xi)
    return np.array(found).reshape(-1, ng)


@settings(max_examples=40)
@given(seeds, st.integers(1, 3), st.integers(0, 6))
def test_zonotope_is_the_hull_of_its_sign_combinations(seed: int, n: int, ng: int) -> None:
    rng = np.random.default_rng(seed)
    zonotope = Zonotope(rng.standard_normal((n, ng)), rng.standard_normal(n))
    corners = zonotope.c + signs(ng) @ zonotope.G.T
    d = rng.standard_normal(n)
    assert zonotope.support(d) == pytest.approx((corners @ d).max(), abs=1e-12)
    lo, hi = zonotope.interval_hull()
    np.testing.assert_allclose([lo, hi], [corners.min(axis=0), corners.max(axis=0)], atol=1e-12)
    hull = Polytope.from_vertices(corners)
    points = zonotope.c + 1.2 * rng.uniform(-1.0, 1.0, (6, n)) * (hi - lo + 0.1) / 2.0
    clear = np.abs(hull.violation(points)) > 1e-8
    assert (zonotope.contains(points) == hull.contains(points))[clear].all()
    assert zonotope.contains(corners).all()


@settings(max_examples=40)
@given(seeds, st.integers(1, 3), st.integers(2, 6), st.integers(1, 2))
def test_constrained_zonotope_against_vertex_enumeration(
    seed: int, n: int, ng: int, nc: int
) -> None:
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((min(nc, ng), ng))
    b = A @ rng.uniform(-1.5, 1.5, ng)  # now and then out of reach: empty
    zonotope = ConstrainedZonotope(rng.standard_normal((n, ng)), rng.standard_normal(n), A, b)
    corners = zonotope.c + section_vertices(A, b) @ zonotope.G.T
    d = rng.standard_normal(n)
    assert zonotope.is_empty() == (len(corners) == 0)
    assert zonotope.support(d) == pytest.approx((corners @ d).max(initial=-math.inf), abs=1e-8)
    if not len(corners):
        assert not zonotope.contains(zonotope.c).any()
        return
    hull = Polytope.from_vertices(corners)
    weights = rng.dirichlet(np.ones(len(corners)), 4)
    points = np.vstack([weights @ corners, corners[:3], rng.standard_normal((4, n)) * 2.0])
    clear = hull.violation(points) > 1e-7
    assert zonotope.contains(points[:-4], 1e-8).all()
    assert not zonotope.contains(points[clear]).any()


@settings(max_examples=40)
@given(seeds, st.integers(2, 3), st.integers(1, 8), st.sampled_from([1e-4, 1.0, 1e4]))
def test_vertices_become_a_zonotope_with_one_constraint(
    seed: int, n: int, k: int, size: float
) -> None:
    rng = np.random.default_rng(seed)
    V = rng.standard_normal((k, n)) * size
    leaf = ConstrainedZonotope.from_vertices(V)
    assert (leaf.ng, leaf.nc) == (k, 1)
    d = rng.standard_normal(n)
    assert leaf.support(d) == pytest.approx((V @ d).max(), abs=1e-9 * size)
    inside = rng.dirichlet(np.ones(k), 4) @ V
    assert leaf.contains(inside, 1e-9 * size).all()
    away = V[np.argmax(V @ d)] + 1e-3 * size * d / np.linalg.norm(d)
    assert not leaf.contains(away, 1e-9 * size).any()


def test_zonotopes_without_generators_are_points() -> None:
    none = np.zeros((2, 0))
    centre = np.array([1.0, 2.0])
    point = ConstrainedZonotope(none, centre, np.zeros((0, 0)), np.zeros(0))
    nothing = ConstrainedZonotope(none, centre, np.zeros((1, 0)), np.ones(1))
    assert point.support([1.0, 1.0]) == 3.0
    assert nothing.support([1.0, 1.0]) == -math.inf
    assert (point.is_empty(), nothing.is_empty()) == (False, True)
    for body in (point, Zonotope(none, centre)):
        assert body.contains([[1.0, 2.0], [1.0, 2.1]]).tolist() == [True, False]
        nobody = body.contains(np.zeros((0, 2)))
        assert nobody.shape == (0,)
        assert nobody.dtype == np.bool_


def unnamed(union: HybridZonotope) -> HybridZonotope:
    """The same set without the leaves that are known by construction."""
    return HybridZonotope(union.Gc, union.Gb, union.c, union.Ac, union.Ab, union.b)


@pytest.mark.parametrize("seed", range(6))
def test_union_of_leaves_from_vertices_and_incidence(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, nv, N = 2 + seed % 2, 8, 1 + seed
    V = rng.standard_normal((nv, n))
    M = rng.random((nv, N)) < 0.5
    M[rng.integers(nv, size=N), np.arange(N)] = True
    union = HybridZonotope.from_vertices(V, M)
    assert (union.n, union.ng, union.nb, union.nc) == (n, 2 * nv, N, nv + 2)
    D = rng.standard_normal((5, n))
    expected = np.array([(V[M[:, i]] @ D.T).max(axis=0) for i in range(N)])
    known = np.array([[leaf.support(d) for d in D] for leaf in union.leaves()])
    np.testing.assert_allclose(known, expected, atol=1e-9)
    # Found again from the matrices alone, in any order.
    found = np.array([[leaf.support(d) for d in D] for leaf in unnamed(union).leaves()])
    assert found.shape == expected.shape
    order, match = (np.lexsort(np.round(rows, 7).T) for rows in (expected, found))
    np.testing.assert_allclose(found[match], expected[order], atol=1e-7)


def test_hybrid_zonotope_of_a_free_space_is_that_free_space() -> None:
    rng = np.random.default_rng(5)
    world = random_world(rng, "rotated", 2, 2)
    space = world.free_space()
    union = space.hybrid_zonotope()
    nv, N = space.incidence.shape
    assert (union.ng, union.nb, union.nc) == (2 * nv, N, nv + 2)
    points = rng.random((60, 2))
    inside = space.contains(points)
    assert 0 < inside.sum() < 60
    assert (union.contains(points) == inside).all()
    generic = unnamed(union)
    assert len(generic.leaves()) == N
    assert (generic.contains(points[:15]) == inside[:15]).all()


def test_any_hybrid_zonotope_gives_up_its_leaves() -> None:
    # Four unit boxes at (+-3, +-2), of which a constraint on the binaries forbids (1, 1).
    union = HybridZonotope(
        csc_array(np.eye(2, 3)),
        csc_array(np.diag([3.0, 2.0])),
        np.zeros(2),
        csc_array([[0.0, 0.0, 1.0]]),
        csc_array([[1.0, 1.0]]),
        np.array([-1.0]),
    )
    centres = sorted(tuple(leaf.c) for leaf in union.leaves())
    assert centres == [(-3.0, -2.0), (-3.0, 2.0), (3.0, -2.0)]
    points = [[2.5, -2.5], [2.5, 2.5], [0.0, 0.0], [-4.0, 3.0]]
    assert union.contains(points).tolist() == [True, False, False, True]
    assert not union.is_empty()


def test_empty_hybrid_zonotopes() -> None:
    blocked = FreeSpace.decompose(([0, 0], [1, 1]), [Polytope.from_box([-1, -1], [2, 2])])
    for union in (blocked.hybrid_zonotope(), unnamed(blocked.hybrid_zonotope())):
        assert union.is_empty()
        assert union.leaves() == ()
        assert not union.contains([0.5, 0.5]).any()


@given(seeds, st.integers(2, 3), st.floats(1.001, 3.0), st.sampled_from([1e-2, 1.0, 1e3]))
def test_informed_set_is_where_the_two_distances_sum_to_the_cost(
    seed: int, n: int, ratio: float, size: float
) -> None:
    rng = np.random.default_rng(seed)
    s, g = rng.standard_normal((2, n)) * size
    cost = ratio * float(np.linalg.norm(g - s))
    informed = Ellipsotope.informed(s, g, cost)
    lo, hi = informed.interval_hull()
    points = lo + (hi - lo) * rng.uniform(-0.1, 1.1, (200, n))
    total = np.linalg.norm(points - s, axis=1) + np.linalg.norm(points - g, axis=1)
    clear = np.abs(total - cost) > 1e-6 * cost
    assert (informed.contains(points, 1e-12 * size) == (total <= cost))[clear].all()
    # Its boundary is where the distances sum to the cost; its support is attained there.
    d = rng.standard_normal(n)
    top = informed.c + informed.G @ (informed.G.T @ d) / np.linalg.norm(informed.G.T @ d)
    assert math.dist(top, s) + math.dist(top, g) == pytest.approx(cost, rel=1e-9)
    assert informed.support(d) == pytest.approx(top @ d, rel=1e-9, abs=1e-9 * size)
    directions = rng.standard_normal((500, n))
    sphere = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    assert informed.support(d) >= ((informed.c + sphere @ informed.G.T) @ d).max() - 1e-9 * size


def test_informed_set_of_the_straight_line_and_of_one_point() -> None:
    line = Ellipsotope.informed([0.0, 0.0], [3.0, 4.0], 5.0)
    points = [[1.5, 2.0], [3.0, 4.0], [3.3, 4.4], [1.5, 2.1]]
    assert line.contains(points).tolist() == [True, True, False, False]
    ball = Ellipsotope.informed([1.0, 1.0], [1.0, 1.0], 2.0)
    assert ball.contains([[1.0, 2.0], [1.0, 2.01]]).tolist() == [True, False]
    with pytest.raises(QueryError, match="cost"):
        Ellipsotope.informed([0.0, 0.0], [3.0, 4.0], 4.9)


def test_ellipsotope_with_more_or_fewer_generators_than_axes() -> None:
    rng = np.random.default_rng(0)
    wide = Ellipsotope(rng.standard_normal((2, 5)), np.zeros(2))
    xi = rng.standard_normal((50, 5))
    xi /= np.linalg.norm(xi, axis=1, keepdims=True)
    assert wide.contains(xi @ wide.G.T).all()
    hull = ConvexHull(xi @ wide.G.T)
    assert not wide.contains(
        1.5 * wide.G @ wide.G.T @ np.eye(2)[0] / np.linalg.norm(wide.G[0])
    ).any()
    assert hull.volume <= math.pi * math.sqrt(np.linalg.det(wide.G @ wide.G.T))
    flat = Ellipsotope(np.ones((2, 1)), np.zeros(2))
    assert flat.contains([[0.5, 0.5], [0.5, 0.6], [1.1, 1.1]]).tolist() == [True, False, False]


EYE, ZERO = np.eye(2), np.zeros(2)
BAD: dict[str, Callable[[], object]] = {
    "rows and centre": lambda: Zonotope(EYE, np.zeros(3)),
    "nan": lambda: Zonotope(np.nan * EYE, ZERO),
    "constraint columns": lambda: ConstrainedZonotope(EYE, ZERO, np.ones((1, 3)), np.ones(1)),
    "constraint rows": lambda: ConstrainedZonotope(EYE, ZERO, np.ones((1, 2)), ZERO),
    "no vertex": lambda: ConstrainedZonotope.from_vertices(np.zeros((0, 2))),
    "hybrid shapes": lambda: HybridZonotope(
        csc_array(EYE), csc_array(EYE), ZERO, csc_array(EYE[:1]), csc_array(EYE), np.ones(1)
    ),
    "incidence rows": lambda: HybridZonotope.from_vertices(np.eye(3), np.ones((2, 1))),
    "incidence values": lambda: HybridZonotope.from_vertices(EYE, [[2.0], [1.0]]),
    "leaf without vertices": lambda: HybridZonotope.from_vertices(EYE, [[1, 0], [1, 0]]),
    "ellipsotope": lambda: Ellipsotope(EYE, np.zeros(1)),
    "points of another dimension": lambda: Zonotope(EYE, ZERO).contains([[1, 2, 3]]),
    "direction of another dimension": lambda: Zonotope(EYE, ZERO).support([1, 2, 3]),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_clear_line(name: str) -> None:
    with pytest.raises(ShapeError) as caught:
        BAD[name]()
    assert isinstance(caught.value, HzmpError)
    assert "\n" not in str(caught.value)
