from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, minimize_scalar

from hzmp_planners.errors import HzmpError
from hzmp_planners.sets import (
    Ball,
    ConstrainedConvexGenerator,
    ConstrainedZonotope,
    Ellipsotope,
    HybridZonotope,
    Polytope,
    Set,
    Zonotope,
)
from oracles import Floats, minimum
from set_samples import NORMS, SIZES, directions, supports

seeds = st.integers(0, 2**32 - 1)
TRAITS = (
    "plain",
    "fixed factors",
    "dependent rows",
    "zero rows",
    "contradictory rows",
    "out of reach",
    "no generators",
    "no constraints",
)


def solved(cost: Floats, A: Floats, b: Floats) -> float:
    """Least cost.xi with A xi = b and |xi| <= 1, inf when there is none, by scipy alone."""
    if not len(cost):
        return 0.0 if not np.any(np.abs(b) > 1e-9) else math.inf
    found = linprog(cost, A_eq=A, b_eq=b, bounds=(-1.0, 1.0), method="highs")
    if found.status == 2:
        return math.inf
    assert found.status == 0
    assert found.fun is not None
    return float(found.fun)


def matrices(rng: np.random.Generator, trait: str, size: float) -> tuple[Floats, ...]:
    """G, c, A, b of a constrained zonotope with a peculiarity; feasible by at least 1e-3 or not."""
    n, ng, nc = int(rng.integers(1, 4)), int(rng.integers(3, 8)), int(rng.integers(1, 3))
    ng = 0 if trait == "no generators" else ng
    nc = 0 if trait == "no constraints" else nc
    G, c = rng.standard_normal((n, ng)) * size, rng.standard_normal(n) * size
    A, inner = rng.standard_normal((nc, ng)), rng.uniform(-0.8, 0.8, ng)
    if trait == "fixed factors":
        fixed = np.eye(ng)[rng.permutation(ng)[:2]]
        A, inner = np.vstack([A, fixed]), np.where(fixed.any(axis=0), rng.choice([-1, 1]), inner)
    if trait == "dependent rows":
        A = np.vstack([A, rng.standard_normal((2, len(A))) @ A])
    if trait in ("zero rows", "no generators"):
        A = np.vstack([A * (trait == "zero rows"), np.zeros((2, ng))])
    b = A @ inner
    if trait == "contradictory rows":
        A, b = np.vstack([A, A[:1]]), np.append(b, b[0] + rng.choice([-1.0, 1.0]) * 1e-3)
    if trait == "out of reach":
        a = rng.standard_normal(ng)
        A, b = np.vstack([A, a]), np.append(b, np.abs(a).sum() * 1.001)
    return G, c, A, b


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("trait", TRAITS)
@settings(max_examples=2, phases=[Phase.generate])
@given(seed=seeds)
def test_constrained_zonotopes_against_linear_programs(trait: str, size: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    G, c, A, b = matrices(rng, trait, size)
    Z = ConstrainedZonotope(G, c, A, b)
    empty = solved(np.zeros(Z.ng), A, b) == math.inf
    assert empty == (trait in ("contradictory rows", "out of reach"))
    assert Z.is_empty() == empty
    for d in rng.standard_normal((3, Z.n)):
        expected = d @ c - solved(-d @ G / size, A, b) * size
        assert Z.support(d) == pytest.approx(expected, rel=1e-8, abs=1e-7 * size)
    X = c + rng.uniform(-1.0, 1.0, (6, Z.n)) * np.abs(G).sum(axis=1)
    for x, inside in zip(X, Z.contains(X), strict=True):
        inner = solved(np.zeros(Z.ng), np.vstack([A, G / size]), np.append(b, (x - c) / size))
        if Z.affine_dimension() == Z.n:
            assert inside == (inner < math.inf)
    less = Z.remove_redundancy()
    D = directions(rng, Z.n, 5)
    np.testing.assert_allclose(supports(less, D), supports(Z, D), rtol=0, atol=1e-7 * size)
    assert less.is_empty() == empty


@pytest.mark.parametrize("scales", [(1e-6, 1e-6), (1e6, 1e6), (1.0, 1e-6), (1.0, 1e6), (1e-6, 1e6)])
@pytest.mark.parametrize("trait", ["plain", "fixed factors", "dependent rows", "out of reach"])
@settings(max_examples=1, phases=[Phase.generate])
@given(seed=seeds)
def test_rows_in_other_units_are_the_same_constraints(
    trait: str, scales: tuple[float, float], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    G, c, A, b = matrices(rng, trait, 1.0)
    factors = rng.permutation(np.resize(scales, len(b)))
    D = directions(rng, len(c), 5)
    plain = ConstrainedZonotope(G, c, A, b)
    scaled = ConstrainedZonotope(G, c, A * factors[:, None], b * factors)
    for body in (scaled, scaled.remove_redundancy()):
        assert body.is_empty() == plain.is_empty()
        np.testing.assert_allclose(supports(body, D), supports(plain, D), rtol=0, atol=1e-6)
    curved = [
        ConstrainedConvexGenerator(G, c, M, f, (Ball(len(G.T), 2.0),))
        for M, f in ((A, b * 0.3), (scaled.A, scaled.b * 0.3))
    ]
    assert curved[0].is_empty() == curved[1].is_empty()
    np.testing.assert_allclose(supports(curved[1], D), supports(curved[0], D), rtol=0, atol=1e-6)
    union = HybridZonotope(G, np.zeros((len(c), 0)), c, scaled.A, np.zeros((len(b), 0)), scaled.b)
    assert union.is_empty() == plain.is_empty()


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("kind", ["box and cuts", "unbounded", "contradictory", "flat"])
@settings(max_examples=4, phases=[Phase.generate])
@given(seed=seeds)
def test_polytopes_against_linear_programs(kind: str, size: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    A = np.vstack([np.eye(n), -np.eye(n), rng.standard_normal((4, n))])
    b = np.concatenate([np.ones(2 * n), rng.uniform(0.1, 1.0, 4)])
    gap = float(rng.choice([1e-3, 0.5, 30.0]))
    if kind == "unbounded":
        A, b = A[:1], b[:1]
    if kind == "contradictory":
        A, b = np.vstack([A, -A[-1:]]), np.append(b, -b[-1] - gap)
    if kind == "flat":
        A, b = np.vstack([A, -A[-1:]]), np.append(b, -b[-1])
    b = (b + A @ rng.standard_normal(n)) * size
    order = rng.permutation(len(b))
    P = Polytope.from_halfspaces(A[order], b[order])
    less = P.remove_redundancy()
    fresh = Polytope.from_halfspaces(A[order], b[order])
    found = minimum(np.zeros(n), A, b / size)
    assert fresh.is_empty() == less.is_empty() == (found is None)
    if kind == "unbounded":
        assert not len(less.b) > 1
        return
    for d in rng.standard_normal((4, n)):
        best = minimum(-d, A, b / size)
        expected = -math.inf if best is None else -best[0] * size
        assert P.support(d) == pytest.approx(expected, abs=1e-7 * size)
        assert less.support(d) == pytest.approx(expected, abs=1e-7 * size)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("p", NORMS)
@settings(max_examples=3, phases=[Phase.generate])
@given(seed=seeds)
def test_curved_sets_between_sampled_factors_and_dual_norms(
    p: float, size: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    n, sizes = 2, rng.integers(1, 4, 2)
    ng = int(sizes.sum())
    G, c = rng.standard_normal((n, ng)) * size, rng.standard_normal(n) * size
    raw = rng.standard_normal((4000, ng)) * rng.choice([1.0, 0.05], (4000, ng))
    q = math.inf if p == 1.0 else 1.0 if p == math.inf else p / (p - 1.0)
    spans = [slice(0, sizes[0]), slice(sizes[0], ng)]
    for span in spans:
        raw[:, span] /= np.linalg.norm(raw[:, span], p, axis=1, keepdims=True)
    inner = 0.5 * raw[0]
    a = rng.standard_normal((1, ng))
    groups = [list(range(ng))[span] for span in spans]
    free = Ellipsotope(G, c, groups=groups, p=p)
    bound = Ellipsotope(G, c, a, a @ inner, groups, p)
    # Points of the constrained set: chords from the inner point, and between both sides of a.
    side = (raw - inner) @ a[0]
    up, down = raw[side > 0.0], raw[side < 0.0]
    pairs = rng.integers(0, [len(up), len(down)], (4000, 2))
    high, low = up[pairs[:, 0]], down[pairs[:, 1]]
    share = ((inner - low) @ a[0] / ((high - low) @ a[0]))[:, None]
    chords = low + share * (high - low)
    for d in rng.standard_normal((2, n)):
        w = d @ G
        closed = d @ c + sum(float(np.linalg.norm(w[span], q)) for span in spans)
        assert free.support(d) == pytest.approx(closed, rel=1e-9, abs=1e-9 * size)
        assert bound.support(d) >= ((c + chords @ G.T) @ d).max() - 1e-7 * size

        # Duality: each multiplier of the constraint gives an upper bound, the best one is tight.
        def dual(multiplier: float, w: Floats = w) -> float:
            rest = w / size - multiplier * a[0]
            total = sum(float(np.linalg.norm(rest[span], q)) for span in spans)
            return multiplier * float(a[0] @ inner) + total

        best = minimize_scalar(dual, (-1.0, 1.0), tol=1e-14).fun
        assert bound.support(d) == pytest.approx(d @ c + best * size, rel=0, abs=1e-7 * size)
        assert not bound.contains(free.support_point(d) + 1e-3 * size * d, 1e-7 * size).any()
    assert bound.contains(c + chords[:5] @ G.T, 1e-7 * size).all()


def test_constraints_out_of_reach_of_a_sum_of_magnitudes() -> None:
    # The largest value of a.xi over |xi|_1 <= 1 is max |a|, a thousandth less than b.
    a = [1.3016, 1.1978, 1.3125, 0.1438]
    assert Ellipsotope(np.eye(2, 4), np.zeros(2), [a], [1.3138], p=1.0).is_empty()


def test_the_sum_of_a_curved_set_and_nothing_is_nothing() -> None:
    E = Ellipsotope([[1.0, 1.0, 2.0]], [0.0], [[2.0, 0.6, 0.9]], [0.1], p=1.5)
    assert (Polytope.empty(1) + E).is_empty()


def test_half_spaces_that_exclude_each_other_by_far() -> None:
    u, v = [0.2983, -0.9545], [-0.2983, 0.9545]
    A = [u, [0.2874, -0.9578], [0.9852, 0.1715], [0.2453, 0.9694], u, v]
    assert Polytope(A, [4844, 6735, 7799, 6001, -4981, 569]).is_empty()


@pytest.mark.parametrize("seed", [0, 5, 7, 13])
def test_a_tangent_plane_touches_a_cut_ellipsoid_in_a_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, G = rng.standard_normal((1, 5)), rng.standard_normal((2, 5))
    E = Ellipsotope(G, ZERO, A, A @ (rng.uniform(-0.6, 0.6, 5) / 5.0))
    top = E.support_point([1.0, 0.0])
    face = E & Polytope([[-1.0, 0.0]], [-top[0]])
    assert not face.is_empty()
    # Within 1e-8 of the plane the set is about the root of that wide.
    assert face.support([0.0, 1.0]) == pytest.approx(top[1], abs=1e-3)


@pytest.mark.parametrize("seed", range(8))
def test_a_half_space_up_to_a_point_keeps_it(seed: int) -> None:
    x, h = np.array([0.1, 0.7]), np.random.default_rng(seed).standard_normal(2)
    union = HybridZonotope.from_polytopes([Polytope.from_vertices([x])])
    assert not (union & Polytope([h], [h @ x])).is_empty()
    assert not (union.leaves()[0] & Polytope([h], [h @ x])).is_empty()


def test_a_tolerance_is_a_distance_for_long_ellipsoids() -> None:
    E = Ellipsotope(np.diag([100.0, 1.0]), np.zeros(2))
    point = [99.0, 0.6]
    assert E.distance(point) < 0.46
    assert E.contains(point, 0.5).all()


@pytest.mark.parametrize("size", SIZES)
def test_a_point_at_the_origin_has_no_size_of_its_own(size: float) -> None:
    P = Polytope.from_vertices(np.array([[-1.0, -0.4], [2.0, -0.7], [0.3, 1.9]]) * size)
    origin = Zonotope(np.zeros((2, 0)), np.zeros(2))
    assert origin.distance(P + np.array([3.0 * size, 0.0])) == pytest.approx(
        2.0 * size, abs=0.2 * size
    )
    assert origin.distance(P) <= 1e-8 * size


@pytest.mark.parametrize("name", ["Zonotope", "ConstrainedZonotope", "Ellipsotope", "Polytope"])
@pytest.mark.parametrize("reach", [0.5, 5.0])
def test_rows_that_a_map_sends_to_zero_hold_everywhere_or_nowhere(name: str, reach: float) -> None:
    square = Polytope.from_box([-1.0, -1.0], [1.0, 1.0])
    bodies: dict[str, Set] = {
        "Zonotope": Zonotope(np.eye(2), np.zeros(2)),
        "ConstrainedZonotope": ConstrainedZonotope.from_vertices(square.vertices()),
        "Ellipsotope": Ellipsotope(np.eye(2), np.zeros(2)),
        "Polytope": square,
    }
    union = HybridZonotope.from_polytopes([square])
    away = Polytope.from_box([-reach, reach - 1.0], [reach, reach + 1.0])  # 0 in it, or not
    for body in (bodies[name], union):
        both = body.intersection(away, [[1.0, 0.0], [0.0, 0.0]])
        assert both.is_empty() == (reach > 1.0)
        if reach < 1.0:
            assert both.support([1.0, 0.0]) == pytest.approx(0.5, abs=1e-7)


def test_the_relations_of_an_equation_need_both_sides() -> None:
    square = np.vstack([np.eye(2), -np.eye(2)])
    with pytest.raises(HzmpError):
        Polytope.from_halfspaces(square, np.ones(4), A_eq=[[1.0, 1.0]])
    with pytest.raises(HzmpError):
        Polytope.from_halfspaces([[1.0, 0.0]], [1.0, 2.0, 3.0], [[0.0, 1.0], [1.0, 1.0]], [0.0])


EYE, ZERO = np.eye(2), np.zeros(2)
NO_ROWS = np.zeros((0, 2))
PLANE: dict[str, Set] = {
    "P": Polytope.from_box(ZERO, [1.0, 1.0]),
    "Z": Zonotope(EYE, ZERO),
    "CZ": ConstrainedZonotope(EYE, ZERO, [[1.0, 1.0]], [0.0]),
    "E": Ellipsotope(EYE, ZERO),
    "CCG": ConstrainedConvexGenerator(EYE, ZERO, NO_ROWS, [], [(2, 2.0)]),
    "H": HybridZonotope.from_polytopes([Polytope.from_box(ZERO, [1.0, 1.0])] * 2),
}
BINARY: dict[str, Callable[[Any, Any], object]] = {
    "+": lambda one, two: one + two,
    "&": lambda one, two: one & two,
    "distance": lambda one, two: one.distance(two),
    "contains_set": lambda one, two: one.contains_set(two),
    "union": lambda one, two: one.union(two),
    "R": lambda one, two: one.intersection(two, EYE),
    "difference": lambda one, two: HybridZonotope.from_union([one]).difference(two),
}


def lifted(body: Set, n: int) -> Set:
    return np.eye(n, 2) @ body + np.full(n, 3.0)


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("operation", BINARY)
@pytest.mark.parametrize("one", PLANE)
def test_other_dimensions_are_one_clear_line(one: str, operation: str, n: int) -> None:
    for two in PLANE.values():
        with pytest.raises(HzmpError) as caught:
            BINARY[operation](PLANE[one], lifted(two, n))
        assert "\n" not in str(caught.value)


SQUARE, H, E = PLANE["P"], PLANE["H"], PLANE["E"]
PART = json.loads(H.to_json())
NAN = np.nan * EYE
BAD: dict[str, Callable[[], object]] = {
    "nan G": lambda: Zonotope(NAN, ZERO),
    "nan c": lambda: Ellipsotope(EYE, [0.0, math.nan]),
    "infinite b": lambda: ConstrainedZonotope(EYE, ZERO, [[1.0, 0.0]], [math.inf]),
    "nan M": lambda: HybridZonotope.from_vertices(EYE, [[math.nan], [1.0]]),
    "nan Gc": lambda: HybridZonotope(NAN, EYE, ZERO, NO_ROWS, NO_ROWS, []),
    "nan points": lambda: E.contains([[0.0, math.nan]]),
    "nan shift": lambda: E + np.array([math.nan, 0.0]),
    "nan map": lambda: NAN @ E,
    "ragged points": lambda: E.contains([[1.0, 2.0], [3.0]]),
    "words": lambda: E.contains("here"),
    "points without columns": lambda: E.contains(np.zeros((2, 0))),
    "no space": lambda: Zonotope(np.zeros((0, 1)), []),
    "map to no space": lambda: np.zeros((0, 2)) @ PLANE["Z"],
    "map from another space": lambda: np.eye(3) @ E,
    "R of another shape": lambda: E.intersection(E, np.eye(3)),
    "A without b": lambda: Ellipsotope(EYE, ZERO, [[1.0, 0.0]]),
    "M of halves": lambda: HybridZonotope.from_vertices(EYE, [[0.5], [1.0]]),
    "M of another height": lambda: HybridZonotope.from_vertices(EYE, [[1.0]]),
    "V without columns": lambda: HybridZonotope.from_vertices(np.zeros((2, 0)), [[1.0], [1.0]]),
    "singular Q": lambda: Ellipsotope.from_shape_matrix(np.ones((2, 2)), ZERO),
    "indefinite Q": lambda: Ellipsotope.from_shape_matrix([[1.0, 2.0], [2.0, 1.0]], ZERO),
    "oblique Q": lambda: Ellipsotope.from_shape_matrix([[1.0, 2.0], [0.0, 1.0]], ZERO),
    "wide Q": lambda: Ellipsotope.from_shape_matrix([[1.0, 0.0]], [0.0]),
    "groups that miss": lambda: Ellipsotope(EYE, ZERO, groups=[[0]]),
    "groups that repeat": lambda: Ellipsotope(EYE, ZERO, groups=[[0, 1], [1]]),
    "groups of fractions": lambda: Ellipsotope(EYE, ZERO, groups=[[0.5], [1.2]]),  # type: ignore[list-item]
    "a flat group": lambda: Ellipsotope(EYE, ZERO, groups=[0, 1]),  # type: ignore[list-item]
    "p below 1": lambda: Ellipsotope(EYE, ZERO, p=0.5),
    "p nan": lambda: Ellipsotope(EYE, ZERO, p=math.nan),
    "balls below 1": lambda: ConstrainedConvexGenerator(EYE, ZERO, NO_ROWS, [], [Ball(2, 0.9)]),
    "balls that miss": lambda: ConstrainedConvexGenerator(EYE, ZERO, NO_ROWS, [], [Ball(1, 2.0)]),
    "negative ball": lambda: ConstrainedConvexGenerator(
        EYE, ZERO, NO_ROWS, [], [Ball(3, 2.0), Ball(-1, 2.0)]
    ),
    "a ball without norm": lambda: ConstrainedConvexGenerator(EYE, ZERO, NO_ROWS, [], [2]),  # type: ignore[list-item]
    "curved and hybrid &": lambda: H & E,
    "curved and hybrid +": lambda: E + H,
    "curved and hybrid x": lambda: H.cartesian_product(E),
    "curved union": lambda: E.union(SQUARE),
    "curved difference": lambda: HybridZonotope.from_union([SQUARE]).difference(E),
    "curved in hybrid": lambda: H.contains_set(E),
    "curved vertices": lambda: E.vertices(),
    "union of nothing": lambda: HybridZonotope.from_union([]),
    "unbounded sum": lambda: E + Polytope([[1.0, 0.0]], [0.0]),
    "unbounded union": lambda: SQUARE.union(Polytope([[1.0, 0.0]], [0.0])),
    "unbounded volume": lambda: Polytope([[1.0, 0.0]], [0.0]).volume(),
    "zero row": lambda: Polytope([[0.0, 0.0]], [0.0]),
    "box upside down": lambda: Polytope.from_box([1.0], [0.0]),
    "empty set of no space": lambda: Polytope.empty(0),
    "complement in another space": lambda: HybridZonotope.from_union([SQUARE]).complement([0], [1]),
    "leaf of no binaries": lambda: HybridZonotope.from_union([SQUARE]).leaf_index([]),
    "too few directions": lambda: Ellipsotope(EYE, ZERO).enclosing_zonotope(2),
    "text of nothing": lambda: Set.from_json("{}"),
    "text of another type": lambda: Polytope.from_json(E.to_json()),
    "text without leaves": lambda: Set.from_json(
        json.dumps(PART | {"leaves": PART["leaves"] | {"parts": []}})
    ).vertices(),
    "negative count": lambda: SQUARE.sample(-1, np.random.default_rng(0)),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_clear_line(name: str) -> None:
    with pytest.raises(HzmpError) as caught:
        BAD[name]()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("other", [[1.0, 2.0], None, "set"])
@pytest.mark.parametrize("name", PLANE)
def test_what_is_no_set_is_refused(name: str, other: Any) -> None:
    body = PLANE[name]
    for act in (body.intersection, body.cartesian_product, body.contains_set, body.union):
        with pytest.raises((HzmpError, TypeError)):
            act(other)
    with pytest.raises((HzmpError, TypeError)):
        body & other
