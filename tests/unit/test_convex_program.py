"""Verdicts that do not depend on a solver's word: honest, lying and silent solvers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.sparse import csc_array

from hzmp_planners import _convex_program
from hzmp_planners._ball_program import Block, ConvexProgram, conjugate, norm
from hzmp_planners._convex_program import least_residual, minimize
from hzmp_planners.errors import SolverError
from oracles import Floats

seeds = st.integers(0, 2**32 - 1)
NORMS = [1.0, 1.5, 2.0, 4.0, math.inf]


@pytest.mark.parametrize("p", NORMS)
def test_optimum_over_a_ball_is_the_dual_norm(p: float) -> None:
    rng = np.random.default_rng(0)
    for size in (1, 2, 5):
        q = rng.standard_normal(size)
        program = ConvexProgram(q, np.zeros((0, size)), np.zeros(0), (Block(size, p, 3.0),))
        found = minimize(program, "test")
        assert found is not None
        assert found.value == pytest.approx(-3.0 * norm(q, conjugate(p)), abs=1e-7)
        assert found.bound <= found.value + 1e-12
        assert norm(found.v, p) <= 3.0 * (1.0 + 1e-12)


@settings(max_examples=30)
@given(seeds, st.sampled_from(NORMS), st.booleans())
def test_every_vector_of_multipliers_gives_a_lower_bound(seed: int, p: float, top: bool) -> None:
    rng = np.random.default_rng(seed)
    E = rng.standard_normal((2, 6))
    blocks = (Block(2, math.inf), Block(4, p, 2.0, epigraph=top))
    program = ConvexProgram(rng.standard_normal(6), E, np.zeros(2), blocks)
    v = program.clip(rng.standard_normal(6) * 2.0)
    np.testing.assert_allclose(program.clip(v), v, atol=1e-12)
    fixed = ConvexProgram(program.q, E, E @ v, blocks)
    for _ in range(5):
        assert fixed.lower_bound(rng.standard_normal(2)) <= fixed.q @ v + 1e-9
    found = minimize(fixed, "test")
    assert found is not None
    assert found.bound - 1e-9 <= found.value <= fixed.q @ v + 1e-7


@settings(max_examples=30)
@given(seeds)
def test_boxes_agree_with_an_independent_linear_program(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q, E, e = rng.standard_normal(5), rng.standard_normal((2, 5)), 2.0 * rng.standard_normal(2)
    expected = linprog(q, A_eq=E, b_eq=e, bounds=[(-1.0, 1.0)] * 5)
    for matrix in (E, csc_array(E)):
        found = minimize(ConvexProgram(q, matrix, e, (Block(5, math.inf),)), "test")
        assert (found is None) == (expected.status == 2)
        if found is not None:
            assert found.value == pytest.approx(expected.fun, abs=1e-7)


def test_the_least_residual_of_contradicting_equations_is_half_their_gap() -> None:
    E, e = np.array([[1.0, 0.0], [1.0, 0.0]]), np.array([0.25, 0.75])
    program = ConvexProgram(np.zeros(2), E, e, (Block(2, 2.0),))
    found = least_residual(program, "test")
    assert found.value == pytest.approx(0.25, abs=1e-8)
    assert found.bound == pytest.approx(0.25, abs=1e-8)
    assert minimize(program, "test") is None


LINEAR = ConvexProgram(
    np.array([1.0, 1.0]), np.array([[1.0, -1.0]]), np.array([0.5]), (Block(2, math.inf),)
)


def silent(program: ConvexProgram, tolerance: float = 0.0) -> None:
    """A solver that stopped early."""


def careless(program: ConvexProgram, tolerance: float = 0.0) -> tuple[Floats, Floats]:
    """A solver that claims an optimum which is feasible but not one."""
    v = np.linalg.lstsq(np.asarray(program.E), program.e)[0]
    return np.asarray(v, dtype=np.float64), np.zeros(program.e.size)


def wrong(program: ConvexProgram, tolerance: float = 0.0) -> tuple[Floats, Floats]:
    """A solver that claims a point which breaks the equations."""
    return -np.ones(program.q.size), np.zeros(program.e.size)


@pytest.mark.parametrize("solver", [silent, careless, wrong])
def test_a_solver_that_fails_the_check_is_replaced_by_the_other(
    solver: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_convex_program, "solve_by_simplex", solver)
    found = minimize(LINEAR, "test")
    assert found is not None
    assert found.value == pytest.approx(-1.5, abs=1e-7)
    infeasible = ConvexProgram(LINEAR.q, LINEAR.E, np.array([2.5]), LINEAR.blocks)
    assert minimize(infeasible, "test") is None


@pytest.mark.parametrize("solver", [silent, wrong])
def test_without_a_verdict_that_holds_there_is_an_error_that_names_the_question(
    solver: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_convex_program, "solve_by_simplex", solver)
    monkeypatch.setattr(_convex_program, "solve_by_interior_point", solver)
    with pytest.raises(SolverError, match="support of a set: neither HiGHS nor Clarabel"):
        minimize(LINEAR, "support of a set")
