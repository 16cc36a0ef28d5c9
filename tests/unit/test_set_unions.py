"""Unions: volumes, differences, covers, and operations leaf by leaf."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings

from hzmp_planners.sets import (
    ConstrainedZonotope,
    HybridZonotope,
    Polytope,
    Set,
)
from oracles import rotation
from set_samples import (
    SIZES,
    directions,
    forget,
    sample,
    seeds,
    supports,
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
