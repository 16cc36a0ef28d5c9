"""Our matrices next to those of zonoopt: the same forms, and the same sets at small sizes.

Traps of zonoopt that are avoided here: its operations and form conversions write into their
operands, and it takes no read-only arrays.
"""

from __future__ import annotations

import importlib
import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.optimize import linprog
from scipy.sparse import csc_matrix

from hzmp_planners.sets import ConstrainedZonotope, HybridZonotope, Polytope
from oracles import Floats

zono: Any = importlib.import_module("zonoopt")  # it has no types

FIELDS = ("Gc", "Gb", "c", "Ac", "Ab", "b")


def dense(matrix: Any) -> Floats:
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix)


def sparse(matrix: ArrayLike) -> Any:
    return csc_matrix(np.array(matrix))


def fields(body: Any) -> dict[str, Floats]:
    return {name: dense(getattr(body, name)) for name in FIELDS}


def theirs(union: HybridZonotope) -> Any:
    """The same matrices as a set of zonoopt."""
    Gc, Gb, c, Ac, Ab, b = (np.array(matrix) for matrix in fields(union).values())
    return zono.HybZono(sparse(Gc), sparse(Gb), c, sparse(Ac), sparse(Ab), b)


def ours(leaf: Any) -> ConstrainedZonotope:
    """A leaf of zonoopt in factors of [-1, 1]."""
    leaf.to_canonical_form()
    return ConstrainedZonotope(dense(leaf.G), leaf.c, dense(leaf.A), leaf.b)


def random_union(
    rng: np.random.Generator, n: int = 2, nv: int = 9, N: int = 3
) -> tuple[Floats, Floats]:
    """V and M in the order of zonoopt: vertices as the cells bring them, none unused."""
    M = np.zeros((nv, N))
    for i in range(N):
        M[rng.choice(nv, n + 1 + i % 2, replace=False), i] = 1.0
    order = list(dict.fromkeys(np.flatnonzero(M.T.ravel()) % nv))
    return rng.standard_normal((len(order), n)), M[order]


def cells_of(V: Floats, M: Floats) -> list[Floats]:
    return [V[column > 0.0] for column in M.T]


def zero_one(union: HybridZonotope) -> dict[str, Floats]:
    """Matrices of the same set for factors in [0, 1]: xi = 2 z - 1."""
    f = fields(union)
    return {
        "c": f["c"] - f["Gc"].sum(axis=1) - f["Gb"].sum(axis=1),
        "b": f["b"] + f["Ac"].sum(axis=1) + f["Ab"].sum(axis=1),
        **{name: 2.0 * f[name] for name in ("Gc", "Gb", "Ac", "Ab")},
    }


def unit_rows(form: dict[str, Floats]) -> Floats:
    """[Ac Ab b] with rows scaled to unit size."""
    rows = np.column_stack([form["Ac"], form["Ab"], form["b"]])
    return np.asarray(rows / np.abs(rows).max(axis=1)[:, None])


def best(form: dict[str, Floats], beta: Floats, d: Floats) -> float:
    """Largest d.z over the continuous factors of a choice of 0/1 binaries; -inf if it has none."""
    rest = form["b"] - form["Ab"] @ beta
    found = linprog(-d, A_eq=form["Ac"], b_eq=rest, bounds=(0.0, 1.0), method="highs")
    return -math.inf if found.fun is None else -float(found.fun)


@pytest.mark.parametrize("seed", range(10))
def test_vertex_form_is_that_of_zonoopt_but_for_the_slack_of_shared_vertices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, N = 2 + seed % 2, 1 + seed
    V, M = random_union(rng, n, 10, N)
    nv = len(V)
    union = HybridZonotope.from_vertices(V, M)
    known = zono.vrep_2_hybzono(cells_of(V, M))
    assert known.is_0_1_form()
    assert (union.ng, union.nb, union.nc) == (known.nGc, known.nGb, known.nC) == (2 * nv, N, nv + 2)

    one, two = zero_one(union), fields(known)
    for name in ("Gc", "Gb", "c"):
        np.testing.assert_allclose(one[name], two[name], atol=1e-14)
    # lam + s = M beta with s in [0, 1] asks the same of lam as lam + deg s = M beta, since
    # 1'beta = 1 keeps M beta in [0, 1]. zonoopt's slacks have the degree, ours have 1.
    two["Ac"][2:, nv:] /= M.sum(axis=1)[:, None]
    np.testing.assert_allclose(unit_rows(one), unit_rows(two), atol=1e-14)

    known.to_canonical_form()
    np.testing.assert_allclose(fields(union)["Gc"], dense(known.Gc), atol=1e-14)
    np.testing.assert_allclose(union.c, known.c, atol=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_constraints_have_the_solutions_of_those_of_zonoopt(seed: int) -> None:
    rng = np.random.default_rng(seed)
    V, M = random_union(rng, 2, 7, 1 + seed)
    one = zero_one(HybridZonotope.from_vertices(V, M))
    two = fields(zono.vrep_2_hybzono(cells_of(V, M)))
    slack = np.zeros(len(V))  # the slack follows from the other factors
    for beta in product((0.0, 1.0), repeat=M.shape[1]):
        for d in rng.standard_normal((5, len(V))):
            values = [best(form, np.array(beta), np.append(d, slack)) for form in (one, two)]
            assert values[0] == pytest.approx(values[1], abs=1e-9)
            assert math.isfinite(values[0]) == (sum(beta) == 1.0)


@pytest.mark.parametrize("seed", range(6))
def test_leaves_are_those_of_zonoopt(seed: int) -> None:
    rng = np.random.default_rng(seed)
    V, M = random_union(rng, 2 + seed % 2, 9, 2 + seed % 3)
    union = HybridZonotope.from_vertices(V, M)
    found = [ours(leaf) for leaf in zono.vrep_2_hybzono(cells_of(V, M)).get_leaves()]
    ways = rng.standard_normal((40, V.shape[1]))
    one, two = (
        np.array([[leaf.support(d) for d in ways] for leaf in leaves])
        for leaves in (union.leaves(), found)
    )
    alike = np.abs(one[:, None] - two[None]).max(axis=2) < 1e-8
    assert alike.shape == (M.shape[1], M.shape[1])
    assert (alike.sum(axis=0) == 1).all()
    assert (alike.sum(axis=1) == 1).all()


def same(one: Any, two: Any) -> None:
    assert not two.is_0_1_form()
    assert (one.n, one.ng, one.nb, one.nc) == (two.n, two.nGc, two.nGb, two.nC)
    for name, matrix in fields(one).items():
        np.testing.assert_allclose(matrix, dense(getattr(two, name)), atol=1e-12, err_msg=name)


@pytest.mark.parametrize("seed", range(5))
def test_operations_have_the_matrices_of_zonoopt(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, two = (HybridZonotope.from_vertices(*random_union(rng)) for _ in range(2))
    R, v = rng.standard_normal((3, 2)), rng.standard_normal(2)
    same(one & two, zono.intersection(theirs(one), theirs(two)))
    same(one + two, zono.minkowski_sum(theirs(one), theirs(two)))
    same(one.cartesian_product(two), zono.cartesian_product(theirs(one), theirs(two)))
    same(R @ one, zono.affine_map(theirs(one), sparse(R)))
    same(one + v, zono.affine_map(theirs(one), sparse(np.eye(2)), v))
    line = HybridZonotope.from_vertices(*random_union(rng, 1))
    same(one.intersection(line, R[:1]), zono.intersection(theirs(one), theirs(line), sparse(R[:1])))


@pytest.mark.parametrize("seed", range(5))
def test_a_cut_has_the_matrices_of_zonoopt_for_a_unit_normal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one = HybridZonotope.from_vertices(*random_union(rng))
    h = rng.standard_normal((1, 2))
    h /= np.linalg.norm(h)
    f = h @ one.c  # through the centre: a half-space that does not cut adds nothing in ours
    same(one & Polytope(h, f), zono.halfspace_intersection(theirs(one), sparse(h), f.copy()))


@pytest.mark.parametrize("seed", range(5))
def test_supports_of_convex_sets_are_those_of_zonoopt(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, ng, nc = 2 + seed % 2, 7, 2
    G, c, A = rng.standard_normal((n, ng)), rng.standard_normal(n), rng.standard_normal((nc, ng))
    b = A @ rng.uniform(-0.5, 0.5, ng)
    body, known = ConstrainedZonotope(G, c, A, b), zono.ConZono(sparse(G), c, sparse(A), b)
    settings = zono.OptSettings()
    settings.eps_prim = settings.eps_dual = 1e-8
    settings.k_max_admm = 200_000
    converged = 0
    for d in rng.standard_normal((20, n)):
        solution = zono.OptSolution()
        value = known.support(d, settings=settings, solution=solution)
        if solution.converged:
            converged += 1
            assert body.support(d) == pytest.approx(value, abs=1e-6)
    assert converged >= 10
