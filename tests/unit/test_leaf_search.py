"""Leaves of hybrid zonotopes that are known by their matrices alone."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_array, csr_array

from hzmp_planners.errors import LimitError, ShapeError
from hzmp_planners.sets import HybridZonotope, Polytope
from hzmp_planners.sets.form.intervals import propagate
from oracles import Floats, minimum

seeds = st.integers(0, 2**32 - 1)


def matrices_only(union: HybridZonotope) -> HybridZonotope:
    return HybridZonotope(union.Gc, union.Gb, union.c, union.Ac, union.Ab, union.b)


def random_union(rng: np.random.Generator, ng: int, nb: int, nc: int) -> HybridZonotope:
    Ac, Ab = rng.standard_normal((nc, ng)), rng.integers(-2, 3, (nc, nb)).astype(float)
    b = Ac @ rng.uniform(-1.0, 1.0, ng) + Ab @ rng.choice([-1.0, 1.0], nb)
    Gc, Gb = rng.standard_normal((2, ng)), 3.0 * rng.standard_normal((2, nb))
    blocks = (csc_array(block) for block in (Gc, Gb, Ac, Ab))
    gc, gb, ac, ab = blocks
    return HybridZonotope(gc, gb, rng.standard_normal(2), ac, ab, b)


def choices_by_enumeration(union: HybridZonotope) -> list[tuple[float, ...]]:
    """Every sign vector, one linear program each."""
    Ac, Ab = union.Ac.toarray(), union.Ab.toarray()
    A = np.vstack([Ac, -Ac, np.eye(union.ng), -np.eye(union.ng)])
    found = []
    for signs in product((-1.0, 1.0), repeat=union.nb):
        rest = union.b - Ab @ np.array(signs)
        b = np.concatenate([rest, -rest, np.ones(2 * union.ng)])
        if minimum(np.zeros(union.ng), A, b) is not None:
            found.append(signs)
    return found


@settings(max_examples=15)
@given(seeds, st.integers(1, 6), st.integers(0, 3))
def test_the_search_finds_each_admissible_choice_once(seed: int, nb: int, nc: int) -> None:
    union = random_union(np.random.default_rng(seed), 3, nb, nc)
    expected = choices_by_enumeration(union)
    found = [tuple(row) for row in union.binaries.tolist()]
    assert sorted(found) == sorted(expected)
    assert len(union.leaves()) == len(expected)
    for index, signs in enumerate(found):
        assert union.leaf_index(signs) == index
    for signs in set(product((-1.0, 1.0), repeat=nb)) - set(expected):
        with pytest.raises(ShapeError, match="no leaf"):
            union.leaf_index(signs)


def test_leaves_of_a_known_union_are_found_again_and_compact() -> None:
    lattice = [(i, j) for i in range(4) for j in range(3)]
    cells = [Polytope.from_box([i, j], [i + 1, j + 1]) for i, j in lattice]
    union = HybridZonotope.from_polytopes(cells)
    again = matrices_only(union)
    low = sorted(tuple(np.round(leaf.interval_hull()[0], 9) + 0.0) for leaf in again.leaves())
    assert low == [(float(i), float(j)) for i, j in lattice]
    assert {(leaf.ng, leaf.nc) for leaf in again.leaves()} == {(4, 1)}
    assert again.volume() == pytest.approx(12.0)
    assert not matrices_only(union).is_empty()


def test_a_limit_that_stops_the_search_says_so() -> None:
    rng = np.random.default_rng(0)
    many = HybridZonotope(
        csc_array((2, 0)), csc_array(rng.standard_normal((2, 14))), np.zeros(2),
        csc_array((0, 0)), csc_array((0, 14)), np.zeros(0),
    )  # fmt: skip
    with pytest.raises(LimitError, match=r"found \d+ in 0.05 s and was not complete"):
        many.leaves(time_limit=0.05)
    assert not many.is_empty()


def test_contradicting_binaries_leave_nothing() -> None:
    # xi_1 + xi_2 = 1 has no solution in {-1, 1}, though its relaxation has.
    union = HybridZonotope(
        csc_array(np.eye(2)), csc_array((2, 2)), np.zeros(2),
        csc_array((1, 2)), csc_array([[1.0, 1.0]]), np.ones(1),
    )  # fmt: skip
    assert not union.convex_relaxation().is_empty()
    assert union.is_empty()
    assert union.leaves() == ()
    assert union.support([1.0, 0.0]) == -np.inf
    assert not union.contains([[0.0, 0.0]]).any()
    assert union.volume() == 0.0


@settings(max_examples=40)
@given(seeds, st.integers(1, 4), st.integers(1, 6))
def test_intervals_hold_every_solution(seed: int, m: int, k: int) -> None:
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((m, k)) * (rng.random((m, k)) < 0.6)
    solution = rng.choice([-1.0, 1.0, 0.3], k)
    binary = np.abs(solution) == 1.0
    lo, hi = -np.ones(k), np.ones(k)
    bounds = propagate(csr_array(A), A @ solution, lo, hi, binary)
    assert bounds is not None
    assert_within(solution, bounds)
    tighter = propagate(A, A @ solution, lo, hi)
    assert tighter is not None
    assert_within(solution, tighter)


def assert_within(x: Floats, bounds: tuple[Floats, Floats]) -> None:
    assert (bounds[0] - 1e-9 <= x).all()
    assert (x <= bounds[1] + 1e-9).all()


def test_intervals_find_what_one_row_forces_and_excludes() -> None:
    A = np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]])
    ones = np.ones(3)
    forced = propagate(A, np.array([2.0, 0.0]), -ones, ones)
    assert forced is not None
    np.testing.assert_allclose(forced, [[1.0, 1.0, -1.0], [1.0, 1.0, -1.0]], atol=1e-12)
    assert propagate(A, np.array([2.1, 0.0]), -ones, ones) is None
