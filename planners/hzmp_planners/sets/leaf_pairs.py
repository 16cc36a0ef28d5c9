"""Proposition 3.2 of the HZ-MP paper: which leaves of a hybrid zonotope meet, and how."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, vstack

from hzmp_planners._arrays import Floats
from hzmp_planners._ball_program import Block, ConvexProgram
from hzmp_planners._convex_program import minimize
from hzmp_planners.constants import RESIDUAL_TOL, SET_TOL
from hzmp_planners.sets.contact import Contact, ContactKind, contact
from hzmp_planners.sets.convex_set import ConvexSet
from hzmp_planners.sets.hybrid_zonotope import HybridZonotope
from hzmp_planners.sets.leaves.leaf_search import scaled_rows
from hzmp_planners.sets.leaves.operations import near_pairs
from hzmp_planners.sets.polytope import Polytope
from hzmp_planners.sets.sparse import stack, zeros


@dataclass(frozen=True, eq=False)
class LeafSystem:
    """The linear system of proposition 3.2 for two leaves i and j.

    M dxi = N dxi_b,  Ac xi = r,  |xi| <= 1,  |xi + dxi| <= 1, with xi the continuous factors of
    leaf i, xi + dxi those of leaf j, and dxi_b the difference of their binary factors.
    """

    M: csr_array[np.float64]
    """[Gc; Ac], shape (n + nc, ng)."""
    N: csr_array[np.float64]
    """[Gb; Ab], shape (n + nc, nb)."""
    delta_b: Floats
    """xi_b of leaf i minus xi_b of leaf j, shape (nb,)."""
    r: Floats
    """b - Ab xi_b of leaf i, shape (nc,)."""


def leaf_system(union: HybridZonotope, i: int, j: int) -> LeafSystem:
    """The matrices of proposition 3.2 for leaves i and j."""
    chosen = 2.0 * union.leaf_table.choices[[i, j]].toarray() - 1.0
    return LeafSystem(
        csr_array(vstack([union.Gc, union.Ac])),
        csr_array(vstack([union.Gb, union.Ab])),
        chosen[0] - chosen[1],
        union.b - union.Ab @ chosen[0],
    )


def common_point(union: HybridZonotope, i: int, j: int) -> Floats | None:
    """A point of both leaves, or None when the system is proved infeasible: proposition 3.2 (a).

    The system as it stands in the paper, on the full matrices; `contact` on the compact leaves is
    the fast way.

    Raises:
        SolverError: no verdict that holds.
    """
    system = leaf_system(union, i, j)
    ng = union.ng
    Ac = union.Ac
    # Unknowns xi_i and xi_j = xi_i + dxi: the same system, with a box for each.
    E = csr_array(stack([[Ac, zeros(union.nc, ng)], [-system.M, system.M]]))
    A, b = scaled_rows(E, np.append(system.r, np.asarray(system.N @ system.delta_b)))
    blank = np.diff(A.indptr) == 0
    if (np.abs(b[blank]) > RESIDUAL_TOL).any():
        return None
    program = ConvexProgram(
        np.zeros(2 * ng), A[~blank].tocsc(), b[~blank], (Block(2 * ng, math.inf),)
    )
    found = minimize(program, "intersection of two leaves")
    if found is None:
        return None
    chosen = 2.0 * union.leaf_table.choices[[i]].toarray()[0] - 1.0
    return np.asarray(union.c + union.Gc @ found.v[:ng] + union.Gb @ chosen)


def consistency_matrix(union: HybridZonotope) -> Floats:
    """L = (I - M M+) N of proposition 3.2 (b), shape (n + nc, nb).

    M dxi = N dxi_b has a solution, bounds aside, iff L dxi_b = 0. The matrix is what a
    least-squares fit of N by M leaves over.
    """
    M = vstack([union.Gc, union.Ac]).toarray()
    N = vstack([union.Gb, union.Ab]).toarray()
    return np.asarray(N - M @ np.linalg.lstsq(M, N)[0] if M.shape[1] else N)


def is_consistent(union: HybridZonotope, i: int, j: int) -> bool:
    """The necessary condition of proposition 3.2 (b) for leaves i and j to meet."""
    system = leaf_system(union, i, j)
    size = max(float(abs(system.N).max()) if system.N.nnz else 0.0, 1.0)
    return bool(np.abs(consistency_matrix(union) @ system.delta_b).max() <= SET_TOL * size)


def leaf_contact(union: HybridZonotope, i: int, j: int) -> Contact:
    """How leaves i and j meet, with a certificate: proposition 3.2 (c) and corollary 3.3."""
    return contact(union.leaf_table.part(i), union.leaf_table.part(j))


def adjacency_matrix(union: HybridZonotope, least_dimension: int = 0) -> csr_array[np.bool_]:
    """Which leaves meet: remark 3.1 and proposition 3.2 (d), symmetric, shape (N, N).

    Of pairs whose boxes meet most are settled by their vertices and facets: a vertex of one in the
    other, or a facet that separates them. The rest are decided by `contact`.

    Args:
        union: the hybrid zonotope.
        least_dimension: only count contacts of this dimension or more; n - 1 for shared faces.

    Raises:
        SolverError: no verdict that holds.
    """
    parts = union.leaf_table.parts
    pairs = near_pairs(union, union)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    bodies = {i: parts[i].to_polytope() for i in np.unique(pairs).tolist()}
    meet = [
        _meet(parts[i], parts[j], bodies[i], bodies[j], least_dimension) for i, j in pairs.tolist()
    ]
    found = pairs[np.array(meet, dtype=np.bool_)]
    both = np.concatenate([found, found[:, ::-1]])
    shape = (len(parts), len(parts))
    return csr_array((np.ones(len(both), dtype=np.bool_), (both[:, 0], both[:, 1])), shape=shape)


def _meet(
    one: ConvexSet, two: ConvexSet, first: Polytope, second: Polytope, least_dimension: int
) -> bool:
    room = SET_TOL * max(one.form.size, two.form.size)
    for outer, inner in ((first, second), (second, first)):
        beyond = inner.vertices() @ outer.A.T - outer.b
        if beyond.min(axis=0).max() > room:
            return False
        if least_dimension == 0 and beyond.max(axis=1).min() <= room:
            return True
    verdict = contact(one, two)
    return verdict.kind is not ContactKind.APART and verdict.dimension >= least_dimension
