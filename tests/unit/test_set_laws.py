from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from set_samples import (
    CASES,
    NORMS,
    SIZES,
    Sample,
    assert_same,
    directions,
    forget,
    is_curved,
    pair,
    points_of,
    sample,
    supports,
)

from hzmp_planners.errors import ShapeError
from hzmp_planners.sets import (
    ConstrainedZonotope,
    ConvexSet,
    Ellipsotope,
    HybridZonotope,
    Polytope,
    Set,
    Zonotope,
)
from oracles import halfspace_volume, rotation

seeds = st.integers(0, 2**32 - 1)
CONVEX = [case for case in CASES if case[0] != "HybridZonotope"]
POLYTOPAL = [(name, kind) for name, kind in CASES if name[:2] in ("Po", "Zo", "Co", "Hy")]
POLYTOPAL = [case for case in POLYTOPAL if case[0] != "ConstrainedConvexGenerator"]


def law(cases: list[tuple[str, str]], examples: int = 2) -> Callable[[Callable[..., Any]], Any]:
    """Run a test for each type and kind, with a few seeds each; no seed is simpler than another."""

    def decorate(test: Callable[..., Any]) -> Any:
        few = settings(max_examples=examples, phases=[Phase.generate])
        checked = few(given(seed=seeds)(test))
        return pytest.mark.parametrize(("name", "kind"), cases)(checked)

    return decorate


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


@law(POLYTOPAL)
def test_vertices_span_the_set_and_are_extreme(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    V = s.body.vertices()
    assert V.shape[1] == s.n
    assert (len(V) == 0) == (kind == "empty")
    D = directions(rng, s.n, 8)
    np.testing.assert_allclose(
        (V @ D.T).max(axis=0, initial=-math.inf), supports(s.body, D), rtol=0, atol=s.tol
    )
    assert s.body.contains(V, s.tol).all()
    if isinstance(s.body, ConvexSet):
        for i in range(min(len(V), 4)):
            if len(V) > 1:
                rest = Polytope.from_vertices(np.delete(V, i, axis=0))
                assert rest.distance(V[i]) > 1e-9 * s.size
        assert s.body.to_polytope().is_empty() == (kind == "empty")


@law(POLYTOPAL)
def test_volume_is_that_of_the_hull_of_support_points(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    unit = s.size**s.n
    R = rng.standard_normal((s.n, s.n))
    volume = s.body.volume()
    assert (R @ s.body).volume() == pytest.approx(
        abs(np.linalg.det(R)) * volume, rel=1e-6, abs=1e-9 * unit
    )
    if kind != "full":
        assert volume <= 1e-9 * unit
        return
    if isinstance(s.body, ConvexSet):
        D = directions(rng, s.n, 400)
        X = np.array([s.body.support_point(d) for d in D]) / s.size
        if s.n > 1:  # directions spread evenly for a set of about unit extent
            D = D @ np.linalg.inv(np.linalg.cholesky(np.cov(X.T)))
            X = np.vstack([X, [s.body.support_point(d) / s.size for d in D]])
        expected = float(np.ptp(X)) if s.n == 1 else ConvexHull(X).volume
        assert volume == pytest.approx(expected * unit, rel=0.05)
        assert volume >= expected * unit * (1.0 - 1e-7)
        body = s.body.to_polytope()
        if s.n > 1:
            assert volume == pytest.approx(
                halfspace_volume(body.A, body.b / s.size) * unit, rel=1e-6
            )


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("size", SIZES)
def test_volume_of_unions_counts_what_leaves_share_once(n: int, size: float) -> None:
    rng = np.random.default_rng(n)
    lo = rng.random((3, n)) * size
    hi = lo + (0.2 + rng.random((3, n))) * size
    boxes = [Polytope.from_box(*corners) for corners in zip(lo, hi, strict=True)]
    sums = []
    for count in range(1, 8):
        chosen = [i for i in range(3) if count >> i & 1]
        sides = np.maximum(hi[chosen].min(axis=0) - lo[chosen].max(axis=0), 0.0)
        sums.append(np.prod(sides) * (1 if len(chosen) % 2 else -1))
    union = HybridZonotope.from_polytopes(boxes)
    assert union.volume() == pytest.approx(sum(sums), rel=1e-9)
    assert forget(union).volume() == pytest.approx(sum(sums), rel=1e-7)
    turn = rotation(rng, n)
    assert (turn @ union).volume() == pytest.approx(sum(sums), rel=1e-7)
    X = union.sample(4000, rng)
    inside = np.array([((lo[i] <= X) & (hi[i] >= X)).all(axis=1) for i in range(3)])
    assert inside.any(axis=0).all()
    share = np.prod(hi - lo, axis=1) / sum(sums)
    np.testing.assert_allclose(inside.mean(axis=1), share, atol=0.04)


@law([case for case in CASES if case[1] != "empty"], 1)
def test_samples_are_uniform_points_of_the_set(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    X = s.body.sample(600, rng)
    assert X.shape == (600, s.n)
    assert s.body.contains(X[:20], s.tol).all()
    hull = s.body.affine_hull()
    if not len(hull.basis) or (name == "HybridZonotope" and len(hull.basis) != s.dimension):
        return
    # Points of the set by rejection from its box within the affine hull.
    frame = hull.basis
    low = np.array([-s.body.support(-d) - hull.point @ d for d in frame])
    high = np.array([s.body.support(d) - hull.point @ d for d in frame])
    flat = low + rng.random((900 if not is_curved(s.body) else 300, len(frame))) * (high - low)
    kept = flat[s.body.contains(hull.point + flat @ frame, s.tol)]
    if len(kept) > 60:
        drawn = (X - hull.point) @ frame.T
        spread = (high - low) / math.sqrt(len(kept))
        assert (np.abs(kept.mean(axis=0) - drawn.mean(axis=0)) <= 2.2 * spread).all()
        covariance = np.abs(np.cov(kept.T) - np.cov(drawn.T)) / np.outer(high - low, high - low)
        assert (covariance <= 0.6 / math.sqrt(len(kept))).all()


@law(CASES, 1)
def test_containment_of_sets(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    lo, hi = s.body.interval_hull() if kind != "empty" else (-np.ones(s.n), np.ones(s.n))
    box = Polytope.from_box(lo - s.tol, hi + s.tol)
    assert box.contains_set(s.body)
    assert is_curved(s.body) or HybridZonotope.from_convex(box).contains_set(s.body)
    assert s.body.contains_set(Polytope.empty(s.n))
    if kind == "empty":
        assert s.body.contains_set(s.body)
        assert not s.body.contains_set(box)
        return
    if is_curved(s.body):
        part = s.body.convex_parts()[0]
        if not (part.form.is_polytopal or part.form.is_ellipsoid):
            corners = np.array([part.support_point(d) for d in directions(rng, s.n, 6)])
            assert part.contains_set(Polytope.from_vertices(corners))
            assert not part.contains_set(Polytope.from_vertices(corners + 0.1 * s.size))
            return
    assert s.body.contains_set(s.body)
    assert not s.body.contains_set(s.body + 1e-3 * s.size * directions(rng, s.n, 9)[-1])
    if not is_curved(s.body):
        disc = sample(rng, "Zonotope", "full", s.n, s.size).body
        disc = disc + -points_of(disc, rng, 1)[0]
        assert (s.body + disc).contains_set(s.body)
        assert not s.body.contains_set(s.body + disc)


@law(CASES, 1)
def test_removing_redundancy_keeps_the_set(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    cut = Polytope.from_box(np.full(s.n, -3.0 * s.size), np.full(s.n, 0.5 * s.size))
    D = directions(rng, s.n, 6)
    for body in (s.body, s.body & cut, (s.body & s.body) & cut):
        less = body.remove_redundancy()
        assert type(less) is type(body)
        assert less.is_empty() == body.is_empty()
        assert_same(less, body, D, 10.0 * s.tol)
        if isinstance(body, Zonotope | ConstrainedZonotope | Ellipsotope):
            assert isinstance(less, Zonotope | ConstrainedZonotope | Ellipsotope)
            assert less.ng <= body.ng
            assert less.nc <= body.nc
        elif isinstance(body, Polytope):
            assert isinstance(less, Polytope)
            assert len(less.remove_redundancy().b) == len(less.b) <= len(body.b)


@law(CASES, 1)
def test_relaxation_and_text_keep_the_set(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    relaxed = s.body.convex_relaxation()
    D = directions(rng, s.n, 5)
    assert (supports(relaxed, D) >= supports(s.body, D) - s.tol).all()
    again = type(s.body).from_json(s.body.to_json())
    assert again.to_json() == s.body.to_json()
    assert Set.from_json(s.body.to_json()).to_json() == s.body.to_json()
    np.testing.assert_array_equal(supports(again, D), supports(s.body, D))
    for field in ("A", "b", "G", "c", "p", "groups", "balls"):
        np.testing.assert_array_equal(
            np.array(getattr(again, field, 0), dtype=object),
            np.array(getattr(s.body, field, 0), dtype=object),
        )


@law([case for case in CASES if case[1] != "empty"], 1)
def test_no_samples_are_an_empty_array(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    assert s.body.sample(0, rng).shape == (0, s.n)


@law(CASES, 1)
def test_arrays_cannot_be_written(name: str, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, name, kind)
    names = ["A", "b", "G", "c", "binaries", "incidence"]
    arrays = [getattr(s.body, field) for field in names if hasattr(s.body, field)]
    if isinstance(s.body, HybridZonotope):
        arrays += [M.data for M in (s.body.Gc, s.body.Gb, s.body.Ac, s.body.Ab)]
        arrays += [leaf.G for leaf in s.body.leaves()]
    if kind != "empty":
        arrays += [*s.body.interval_hull(), *s.body.affine_hull()]
    if name == "Polytope":
        arrays.append(s.body.vertices())
    for array in arrays:
        assert not array.size or not array.flags.writeable
    with pytest.raises(AttributeError):
        s.body.c = np.zeros(s.n)  # type: ignore[attr-defined]
    G = np.ones((s.n, 2))
    zonotope = Zonotope(G, np.zeros(s.n))
    G[:] = 5.0
    assert zonotope.support(np.ones(s.n)) == 2.0 * s.n


@pytest.mark.parametrize("p", NORMS)
@pytest.mark.parametrize("kind", ["full", "flat", "empty", "point"])
@settings(max_examples=2, phases=[Phase.generate])
@given(seed=seeds, count=st.integers(7, 40))
def test_ellipsotopes_lie_between_their_zonotopes(
    p: float, kind: str, seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    s = sample(rng, "Ellipsotope", kind)
    assert isinstance(s.body, Ellipsotope)
    E = Ellipsotope(s.body.G, s.body.c, s.body.A, s.body.b, s.body.groups, p)
    D = directions(rng, s.n, 5)
    exact = supports(E, D)
    assert (supports(E.enclosing_zonotope(count), D) >= exact - s.tol).all()
    assert (supports(E.enclosed_zonotope(count), D) <= exact + s.tol).all()


def test_many_factors_in_one_ball_are_enclosed_in_moderate_time() -> None:
    E = Ellipsotope(np.random.default_rng(0).standard_normal((2, 16)), np.zeros(2))
    d = np.array([0.6, 0.8])
    assert E.enclosing_zonotope(40).support(d) >= E.support(d) >= E.enclosed_zonotope(40).support(d)


def box_and_union(rng: np.random.Generator, n: int, size: float) -> tuple[Polytope, HybridZonotope]:
    box = Polytope.from_box(np.zeros(n), np.full(n, size))
    parts = []
    for _ in range(3):
        points = (rng.random(n) + 0.4 * rng.standard_normal((n + 3, n))) * size
        parts.append(Polytope.from_vertices(points))
    return box, HybridZonotope.from_polytopes(parts)


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("n", [1, 2, 3])
def test_difference_and_complement_by_points(n: int, size: float, known: bool) -> None:
    rng = np.random.default_rng(n)
    box, union = box_and_union(rng, n, size)
    X = rng.uniform(-0.1, 1.1, (300, n)) * size
    depth = np.max([-leaf.to_polytope().violation(X) for leaf in union.leaves()], axis=0)
    clear = (np.abs(depth) > 1e-6 * size) & (np.abs(box.violation(X)) > 1e-6 * size)
    in_union, in_box = depth > 0.0, box.violation(X) < 0.0
    body = union if known else forget(union)
    left = body.complement(np.zeros(n), np.full(n, size))
    assert (left.contains(X) == (in_box & ~in_union))[clear].all()
    rest = body.difference(box)
    assert (rest.contains(X) == (in_union & ~in_box))[clear].all()
    covered = (body & box).volume()
    assert left.volume() + covered == pytest.approx(size**n, rel=1e-7)
    assert rest.volume() + covered == pytest.approx(body.volume(), rel=1e-7)
    assert body.union(left).contains_set(box)
    assert not left.is_empty()
    assert not left.contains_set(box)
    assert body.difference(body).volume() <= 1e-9 * size**n


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("n", [1, 2, 3])
def test_cells_cover_together_what_none_covers_alone(n: int, size: float) -> None:
    rng = np.random.default_rng(n)
    turn, away = rotation(rng, n), rng.standard_normal(n) * size
    lo, hi = np.zeros(n), np.full(n, size)
    middle = hi * np.append(0.4, np.ones(n - 1))
    box = turn @ Polytope.from_box(lo, hi) + away
    left = turn @ Polytope.from_box(lo, middle) + away
    right = turn @ Polytope.from_box(hi * np.append(0.4, np.zeros(n - 1)), hi) + away
    gap = turn @ Polytope.from_box(hi * np.append(0.4 + 1e-5, np.zeros(n - 1)), hi) + away
    assert HybridZonotope.from_polytopes([left, right]).contains_set(box)
    assert forget(HybridZonotope.from_union([left, right])).contains_set(box)
    assert not HybridZonotope.from_polytopes([left, gap]).contains_set(box)
    assert not HybridZonotope.from_polytopes([left]).contains_set(box)
    assert box.contains_set(HybridZonotope.from_polytopes([left, right]))
    low = np.abs((box.vertices() - away) @ turn[:, 0]) <= 1e-9 * size
    facet = Polytope.from_vertices(box.vertices()[low])
    assert HybridZonotope.from_polytopes([left, right]).contains_set(facet)
    assert HybridZonotope.from_polytopes([box]).remove_redundancy().leaf_count == 1
    nested = HybridZonotope.from_polytopes([left, box, box, right])
    assert nested.remove_redundancy().leaf_count == 1


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_unions_of_unions_give_up_all_their_leaves(count: int) -> None:
    rng = np.random.default_rng(count)
    lo = rng.random((2, count, 2)) * 3.0
    groups = [
        HybridZonotope.from_polytopes([Polytope.from_box(low, low + 1.0) for low in lows])
        for lows in lo
    ]
    union = HybridZonotope.from_union(groups)
    found = forget(union)
    assert union.leaf_count == 2 * count
    assert not found.is_empty()
    assert found.leaf_count == 2 * count
    assert found.contains(lo.reshape(-1, 2) + 0.5).all()


OPERATIONS: dict[str, Callable[[Any, Any], Set]] = {
    "map": lambda Z, W: np.array([[1.0, 2.0], [-0.5, 1.0]]) @ Z,
    "flat map": lambda Z, W: np.array([[1.0, 2.0], [2.0, 4.0]]) @ Z,
    "shift": lambda Z, W: Z + np.ones(2),
    "sum": lambda Z, W: Z + W,
    "intersection": lambda Z, W: Z & W,
    "mapped intersection": lambda Z, W: Z.intersection(W, np.array([[0.0, 1.0], [1.0, 0.0]])),
    "cut": lambda Z, W: Z & Polytope.from_halfspaces([[1.0, 1.0]], [0.5]),
    "product": lambda Z, W: Z.cartesian_product(W),
    "union": lambda Z, W: Z.union(W),
}


ALONE = ("map", "flat map", "shift", "cut")


@pytest.mark.parametrize("operation", OPERATIONS)
@settings(max_examples=2, phases=[Phase.generate])
@given(seed=seeds)
def test_operations_on_unions_are_operations_on_leaves(operation: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    kind = str(rng.choice(["full", "full", "flat", "point", "empty"]))
    one = sample(rng, "HybridZonotope", kind, 2, 1.0)
    two = sample(rng, str(rng.choice(["Zonotope", "HybridZonotope"])), "full", 2, 1.0)
    act = OPERATIONS[operation]
    assert isinstance(one.body, HybridZonotope)
    known = act(one.body, two.body)
    found = act(forget(one.body), two.body)
    assert isinstance(known, HybridZonotope)
    assert isinstance(found, HybridZonotope)
    D = directions(rng, known.n, 8)
    parts = two.body.convex_parts()
    parts = parts[:1] if operation in ALONE else parts
    apart = [act(Z, W) for Z in one.body.leaves() for W in parts]
    if operation == "union":
        apart = [*one.body.leaves(), *two.body.convex_parts()]
    expected = np.array([supports(body, D) for body in apart if not body.is_empty()])
    for body in (known, found, forget(known)):
        leaves = np.array([supports(leaf, D) for leaf in body.leaves()]).reshape(-1, len(D))
        assert len(leaves) == len(expected)
        if not len(leaves):
            assert body.is_empty()
            continue
        apart_by = np.abs(leaves[:, None] - expected).max(axis=2)
        assert max(apart_by.min(axis=0).max(), apart_by.min(axis=1).max()) <= 1e-6
        for i, xi_b in enumerate(body.binaries):
            assert body.leaf_index(xi_b) == i
            section = ConstrainedZonotope(
                body.Gc.toarray(),
                body.c + body.Gb @ xi_b,
                body.Ac.toarray(),
                body.b - body.Ab @ xi_b,
            )
            np.testing.assert_allclose(supports(section, D), leaves[i], atol=1e-6)
