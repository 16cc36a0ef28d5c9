"""Laws of the operations on every type of set, full, flat, empty and a single point."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hzmp_planners.errors import ShapeError
from hzmp_planners.sets import (
    Polytope,
    Zonotope,
)
from oracles import rotation
from set_samples import (
    CASES,
    Sample,
    assert_same,
    directions,
    law,
    pair,
    points_of,
    sample,
    supports,
)


@law(CASES)
def test_maps_compose_and_move_the_support_by_the_transpose(
    name: str, kind: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    m = int(rng.integers(1, 4))
    B, A = rng.standard_normal((m, s.n)), rng.standard_normal((2, m))
    D = directions(rng, 2, 5)
    assert_same(A @ (B @ s.body), (A @ B) @ s.body, D, 10.0 * s.tol)
    expected = [s.body.support((A @ B).T @ d) for d in D]
    np.testing.assert_allclose(supports((A @ B) @ s.body, D), expected, rtol=0, atol=10.0 * s.tol)
    square = rotation(rng, s.n) * rng.uniform(0.5, 2.0)
    assert_same(np.linalg.inv(square) @ (square @ s.body), s.body, directions(rng, s.n, 5), s.tol)


@law(CASES, 1)
def test_maps_to_fewer_dimensions_of_rank_one_or_to_a_point(
    name: str, kind: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    rank_one = np.outer(rng.standard_normal(s.n), rng.standard_normal(s.n))
    for R in (rank_one, np.zeros((s.n, s.n)), np.zeros((2, s.n))):
        D = directions(rng, len(R), 4)
        expected = [s.body.support(R.T @ d) for d in D]
        image = R @ s.body
        np.testing.assert_allclose(supports(image, D), expected, rtol=0, atol=10.0 * s.tol)
        assert image.affine_dimension() == min(s.dimension, np.linalg.matrix_rank(R))


@law(CASES, 1)
def test_shifts_add_to_the_support(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    v = rng.standard_normal(s.n) * s.size
    D = directions(rng, s.n, 5)
    moved = s.body + v
    np.testing.assert_allclose(supports(moved, D), supports(s.body, D) + D @ v, rtol=0, atol=s.tol)
    assert type(moved) is type(s.body)
    assert_same(moved + -v, s.body, D, s.tol)


@law(CASES)
def test_support_is_attained_by_a_point_of_the_set(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    for d in directions(rng, s.n, 5):
        if kind == "empty":
            assert s.body.support(d) == -math.inf
            with pytest.raises(ShapeError):
                s.body.support_point(d)
            continue
        point = s.body.support_point(d)
        assert d @ point == pytest.approx(s.body.support(d), rel=1e-12, abs=1e-12 * s.size)
        assert s.body.contains(point).all()
        assert not s.body.contains(point + 1e-3 * s.size * d).any()


@law(CASES)
def test_emptiness_and_dimension_are_known(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    assert s.body.is_empty() == (kind == "empty")
    assert s.body.affine_dimension() == s.dimension
    if kind == "empty":
        assert not s.body.contains(rng.standard_normal((4, s.n)) * s.size).any()
        assert s.body.distance(np.zeros(s.n)) == math.inf
        assert s.body.distance(Zonotope(np.eye(s.n) * s.size, np.zeros(s.n))) == math.inf
        for query in (s.body.interval_hull, s.body.affine_hull, lambda: s.body.sample(1, rng)):
            with pytest.raises(ShapeError):
                query()
        with pytest.raises(ShapeError):
            s.body.project(np.zeros(s.n))
        return
    lo, hi = s.body.interval_hull()
    np.testing.assert_allclose(hi, supports(s.body, np.eye(s.n)), rtol=0, atol=s.tol)
    np.testing.assert_allclose(-lo, supports(s.body, -np.eye(s.n)), rtol=0, atol=s.tol)
    hull = s.body.affine_hull()
    frame = np.vstack([hull.basis, hull.normals])
    np.testing.assert_allclose(frame @ frame.T, np.eye(s.n), atol=1e-9)
    spread = (points_of(s.body, rng, 5) - hull.point) @ hull.normals.T
    np.testing.assert_allclose(spread, 0.0, atol=s.tol)


@law(CASES, 1)
def test_sums_add_supports_and_commute(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    other = str(rng.choice(["Polytope", "Zonotope", "ConstrainedZonotope", "Ellipsotope"]))
    one, two = pair(rng, name, kind, other)
    if name == "HybridZonotope" and other == "Ellipsotope":
        if not two.body.convex_parts()[0].form.is_polytopal:
            with pytest.raises(ShapeError, match="no type holds"):
                one.body + two.body
        return
    D = directions(rng, one.n, 5)
    total = one.body + two.body
    expected = supports(one.body, D) + supports(two.body, D)
    np.testing.assert_allclose(supports(total, D), expected, rtol=0, atol=2.0 * one.tol)
    assert_same(two.body + one.body, total, D, 2.0 * one.tol)
    assert total.is_empty() == (kind == "empty")


@law(CASES, 1)
def test_intersections_commute_and_hold_the_common_points(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    other = str(rng.choice(["Polytope", "Zonotope", "ConstrainedZonotope", "Ellipsotope"]))
    one, two = pair(rng, name, kind, other)
    if name == "HybridZonotope" and other == "Ellipsotope":
        return
    D = directions(rng, one.n, 5)
    if kind != "empty":  # make them meet, well or by chance
        two_body = two.body + (points_of(one.body, rng, 1)[0] - points_of(two.body, rng, 1)[0])
    else:
        two_body = two.body
    both = one.body & two_body
    assert_same(two_body & one.body, both, D, 10.0 * one.tol)
    assert both.is_empty() == (kind == "empty")
    X = np.vstack([points_of(one.body, rng, 5), points_of(two_body, rng, 5)])
    common = one.body.contains(X, 1e-12 * one.size) & two_body.contains(X, 1e-12 * one.size)
    assert both.contains(X[common], one.tol).all()
    for d in D[:3] if kind != "empty" else []:
        point = both.support_point(d)
        assert one.body.contains(point, one.tol).all()
        assert two_body.contains(point, one.tol).all()


@law(CASES, 1)
def test_a_set_is_its_own_intersection(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    D = directions(rng, s.n, 5)
    assert_same(s.body & s.body, s.body, D, 10.0 * s.tol)
    box = Polytope.from_box(np.full(s.n, -1e3 * s.size), np.full(s.n, 1e3 * s.size))
    assert_same(s.body & box, s.body, D, 10.0 * s.tol)
    assert_same(box & s.body, s.body, D, 10.0 * s.tol)


@law(CASES, 1)
def test_unbounded_polytopes_cut_every_set(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    X = points_of(s.body, rng, 8) if kind != "empty" else np.zeros((1, s.n))
    H = rng.standard_normal((int(rng.integers(1, 3)), s.n)) * 10.0 ** rng.uniform(-3.0, 3.0)
    cut = Polytope.from_halfspaces(H, H @ X[0])  # a point of the set is on every plane
    D = directions(rng, s.n, 4)
    for part in (s.body & cut, cut & s.body):
        assert part.is_empty() == (kind == "empty")
        if kind == "empty":
            continue
        assert part.contains(X[cut.violation(X) <= 0.0], s.tol).all()
        assert not part.contains(X[cut.violation(X) > 10.0 * s.tol], s.tol).any()
        corners = np.array([part.support_point(d) for d in D])
        assert cut.violation(corners).max() <= s.tol
        assert s.body.contains(corners, s.tol).all()
    beyond = Polytope.from_halfspaces(-np.eye(s.n)[:1], [-1e2 * s.size])
    assert (s.body & beyond).is_empty()


@law([case for case in CASES if case[1] != "empty"])
def test_a_supporting_plane_cuts_off_a_face(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    d = directions(rng, s.n, 9)[-1]
    top = s.body.support_point(d)
    face = s.body & Polytope.from_halfspaces([-d], [-d @ top])
    assert not face.is_empty()
    assert face.support(d) == pytest.approx(d @ top, rel=0, abs=s.tol)
    assert face.support(-d) == pytest.approx(-d @ top, rel=0, abs=s.tol)
    assert face.contains(top, s.tol).all()
    D = directions(rng, s.n, 4)
    assert (supports(face, D) <= supports(s.body, D) + s.tol).all()
    assert (supports(face, D) >= D @ top - s.tol).all()


@law(CASES)
def test_generalised_intersections_are_what_they_say(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    m = int(rng.integers(1, 4))
    R = rng.standard_normal((m, s.n)) * float(rng.choice([1e-3, 1.0, 1e3]))
    if rng.random() < 0.3:
        R[0] = 0.0
    scale = max(float(np.linalg.norm(R, 2)), 1e-12)
    X = points_of(s.body, rng, 8) if kind != "empty" else np.zeros((1, s.n))
    other = str(rng.choice(["Polytope", "Zonotope", "ConstrainedZonotope"]))
    body = np.eye(m) * scale @ sample(rng, other, "full", m, s.size).body
    body = body + (R @ X[0] - points_of(body, rng, 1)[0])
    both = s.body.intersection(body, R)
    assert both.is_empty() == (kind == "empty")
    if kind == "empty":
        return
    inside = body.contains(X @ R.T, 1e-9 * scale * s.size)
    clear = ~body.contains(X @ R.T, 1e-5 * scale * s.size)
    assert both.contains(X[inside], 10.0 * s.tol).all()
    assert not both.contains(X[clear], s.tol).any()
    corners = np.array([both.support_point(d) for d in directions(rng, s.n, 4)])
    assert s.body.contains(corners, s.tol).all()
    assert body.contains(corners @ R.T, 10.0 * scale * s.tol).all()


@law(CASES, 1)
def test_products_hold_pairs(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    other = str(rng.choice(["Polytope", "Zonotope", "Ellipsotope"]))
    one = sample(rng, name, kind)
    two = sample(rng, other, "full", int(rng.integers(1, 3)), one.size)
    if name == "HybridZonotope" and other == "Ellipsotope":
        return
    for first, second in ((one, two), (two, one)):
        product = first.body.cartesian_product(second.body)
        assert product.n == first.n + second.n
        d, e = rng.standard_normal(first.n), rng.standard_normal(second.n)
        expected = first.body.support(d) + second.body.support(e)
        assert product.support(np.append(d, e)) == pytest.approx(expected, rel=0, abs=9 * one.tol)
        assert product.is_empty() == (kind == "empty")
        if kind != "empty":
            pairs = np.hstack([points_of(body, rng, 3) for body in (first.body, second.body)])
            assert product.contains(pairs, one.tol).all()
            pairs[:, 0] += 1e2 * one.size
            assert not product.contains(pairs, one.tol).any()


@law([case for case in CASES if case[1] != "empty"], 3)
def test_projections_are_nearest_points(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    X = points_of(s.body, rng, 2)
    np.testing.assert_allclose([s.body.project(x) for x in X], X, rtol=0, atol=s.tol)
    for reach in (0.3, 3.0, 30.0):
        x = X[0] + rng.standard_normal(s.n) * reach * s.size
        p = s.body.project(x)
        gap = float(np.linalg.norm(x - p))
        assert s.body.contains(p, s.tol).all()
        assert s.body.distance(x) == pytest.approx(gap, rel=1e-7, abs=s.tol)
        assert np.linalg.norm(s.body.project(p) - p) <= 10.0 * s.tol
        for part in s.body.convex_parts():
            nearest = part.project(x)
            away = x - nearest
            # (x - p).(z - p) <= 0 for every z of the part.
            beyond = part.support(away) - away @ nearest
            assert beyond <= 10.0 * s.tol * max(float(np.linalg.norm(away)), s.size)
            assert np.linalg.norm(away) >= gap - s.tol


@law(CASES)
def test_distances_are_symmetric_and_zero_where_sets_meet(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    other = str(rng.choice(["Polytope", "Zonotope", "Ellipsotope", "HybridZonotope"]))
    one, two = pair(rng, name, kind, other)
    gap = one.body.distance(two.body)
    assert two.body.distance(one.body) == pytest.approx(gap, abs=one.tol)
    if kind == "empty":
        assert gap == math.inf
        return
    x, y = points_of(one.body, rng, 1)[0], points_of(two.body, rng, 1)[0]
    assert gap <= np.linalg.norm(x - y) + one.tol
    assert one.body.distance(two.body + (x - y)) <= one.tol
    # Apart along an axis by a known gap: the supports touch two parallel planes.
    d = directions(rng, one.n, 6)[5]
    far = two.body + d * (one.body.support(d) + two.body.support(-d) + 0.7 * one.size)
    assert one.body.distance(far) >= 0.7 * one.size - one.tol
    assert one.body.distance(one.body) <= one.tol


@law([case for case in CASES if case[1] != "empty"])
def test_distance_of_a_shifted_copy_is_known(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    if name == "HybridZonotope":
        s = Sample(s.body.convex_parts()[0], s.kind, s.n, s.size, s.dimension)
    d = directions(rng, s.n, 8)[-1]
    top, low = s.body.support_point(d), s.body.support_point(-d)
    v = (top - low) + 0.4 * s.size * d
    # top touches the upper plane, low + v is straight above it: nothing is nearer.
    assert s.body.distance(s.body + v) == pytest.approx(0.4 * s.size, abs=s.tol)
    away = s.body.support(d) * d + top - (top @ d) * d + 2.0 * s.size * d
    assert s.body.distance(away) == pytest.approx(2.0 * s.size, abs=s.tol)
