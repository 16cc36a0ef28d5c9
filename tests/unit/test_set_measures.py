"""Vertices, volumes, samples, containment and copies of every type of set."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from hzmp_planners.sets import (
    ConstrainedZonotope,
    ConvexSet,
    Ellipsotope,
    HybridZonotope,
    Polytope,
    Set,
    Zonotope,
)
from oracles import halfspace_volume
from set_samples import (
    CASES,
    NORMS,
    POLYTOPAL,
    assert_same,
    directions,
    is_curved,
    law,
    points_of,
    sample,
    seeds,
    supports,
)


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
