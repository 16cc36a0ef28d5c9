"""Leaves of an arbitrary hybrid zonotope: an exact depth-first search over its binary factors."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csc_array, csr_array, hstack

from hzmp_planners._arrays import Floats
from hzmp_planners._ball_program import Block, ConvexProgram
from hzmp_planners._convex_program import minimize
from hzmp_planners.constants import RESIDUAL_TOL
from hzmp_planners.errors import LimitError
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope
from hzmp_planners.sets.form.intervals import propagate

if TYPE_CHECKING:
    from hzmp_planners.sets.hybrid_zonotope import HybridZonotope

Sparse = csr_array[np.float64]

_SMALL = 4_000  # entries up to which projections are faster than a linear program
_DENSE = 20_000  # entries up to which dense matrices are faster than sparse ones


def admissible_choices(union: HybridZonotope, time_limit: float = math.inf) -> Iterator[Floats]:
    """Every vector of binary factors for which continuous factors exist, each once; shape (nb,).

    At each node interval arithmetic fixes the binaries that follow from the others; then the
    linear relaxation either is proved infeasible, which closes the node, or proposes the binary
    to branch on. Nothing is closed on a solver's word: see `_convex_program`.

    Args:
        union: the hybrid zonotope.
        time_limit: [s].

    Raises:
        LimitError: the time is up and parts of the tree are still open.
        SolverError: a relaxation ended without a verdict that holds.
    """
    deadline = time.perf_counter() + time_limit
    A, b = _scaled(csr_array(hstack([union.Ac, union.Ab])), union.b)
    binary = np.arange(union.ng + union.nb) >= union.ng
    ones = np.ones(binary.size)
    open_nodes = [(-ones, ones)]
    found = 0
    while open_nodes:
        if time.perf_counter() > deadline:
            raise LimitError(
                f"the search for leaves found {found} in {time_limit:g} s and was not complete "
                f"({len(open_nodes)} open nodes): allow more time"
            )
        bounds = propagate(A, b, *open_nodes.pop(), binary)
        if bounds is None:
            continue
        lo, hi = bounds
        relaxed = _relaxation(A, b, lo, hi)
        if relaxed is None:
            continue
        free = binary & (hi - lo > 1.0)
        if not free.any():
            found += 1
            yield lo[binary]
            continue
        values = (lo + hi) / 2.0
        values[hi - lo > RESIDUAL_TOL] += relaxed * ((hi - lo) / 2.0)[hi - lo > RESIDUAL_TOL]
        branch = int(np.where(free, np.abs(values), np.inf).argmin())
        below, above = hi.copy(), lo.copy()
        below[branch], above[branch] = -1.0, 1.0
        children = [(lo, below), (above, hi)]
        open_nodes += children if values[branch] > 0.0 else children[::-1]


def leaf_of_choice(union: HybridZonotope, choice: Floats) -> ConstrainedZonotope:
    """The leaf < Gc, c + Gb xi, Ac, b - Ab xi > (Bird et al. 2023, theorem 5), made compact.

    Factors that the constraints fix are taken out while the matrices are still sparse, the rest
    by `remove_redundancy`. An inconsistent choice gives an empty leaf.
    """
    c, offset = union.c + union.Gb @ choice, union.b - union.Ab @ choice
    A, b = _scaled(csr_array(union.Ac), offset)
    ones = np.ones(union.ng)
    bounds = propagate(A, b, -ones, ones)
    inner = _Inner(A, b, *((-ones, ones) if bounds is None else bounds))
    rows = np.flatnonzero(inner.live | (np.abs(inner.rest) > RESIDUAL_TOL))
    G = union.Gc[:, inner.free].toarray() * inner.radius
    matrix = inner.columns[rows]
    dense = matrix if isinstance(matrix, np.ndarray) else matrix.toarray()
    leaf = ConstrainedZonotope(G, c + union.Gc @ inner.middle, dense, inner.rest[rows])
    return leaf.remove_redundancy()


def scaled_rows(A: csr_array[np.float64], b: Floats) -> tuple[csr_array[np.float64], Floats]:
    """Equations with rows scaled to unit size."""
    sizes = abs(A).max(axis=1).toarray().ravel() if A.shape[1] else np.zeros(A.shape[0])
    sizes[sizes == 0.0] = 1.0
    return csr_array(A.multiply((1.0 / sizes)[:, None])), b / sizes


def _scaled(A: Sparse, b: Floats) -> tuple[Sparse | Floats, Floats]:
    """Scaled rows, as a dense matrix where that is faster."""
    scaled, offset = scaled_rows(csr_array(A), b)
    small = scaled.shape[0] * scaled.shape[1] <= _DENSE
    return (scaled.toarray() if small else scaled), offset


class _Inner:
    """A xi = b in units of the bounds: xi = middle + radius eta for the factors that are free."""

    def __init__(self, A: Sparse | Floats, b: Floats, lo: Floats, hi: Floats) -> None:
        self.middle, radius = (lo + hi) / 2.0, (hi - lo) / 2.0
        self.free = np.flatnonzero(radius > RESIDUAL_TOL)
        self.radius = radius[self.free]
        part = A[:, self.free]
        self.columns: Any = (
            part * self.radius if isinstance(part, np.ndarray) else csr_array(part * self.radius)
        )
        self.rest: Floats = b - A @ self.middle
        magnitudes: Any = abs(self.columns)
        self.live = np.asarray(magnitudes.sum(axis=1)) > RESIDUAL_TOL


def _relaxation(A: Sparse | Floats, b: Floats, lo: Floats, hi: Floats) -> Floats | None:
    """A solution of A xi = b within the bounds, in units of them; None when there is none."""
    inner = _Inner(A, b, lo, hi)
    if (np.abs(inner.rest[~inner.live]) > 10.0 * RESIDUAL_TOL).any():
        return None
    rows, count = np.flatnonzero(inner.live), len(inner.free)
    matrix, offset = inner.columns[rows], inner.rest[rows]
    if isinstance(matrix, np.ndarray) and matrix.size <= _SMALL:
        guess = _by_projections(matrix, offset)
        if guess is not None:
            return guess
    given = matrix if isinstance(matrix, np.ndarray) else csc_array(matrix)
    program = ConvexProgram(np.zeros(count), given, offset, (Block(count, math.inf),))
    found = minimize(program, "relaxation of a hybrid zonotope")
    return None if found is None else found.v


def _by_projections(A: Floats, b: Floats) -> Floats | None:
    """A solution inside the box by alternating projections; None says nothing.

    Where solutions inside a slightly smaller box exist a few rounds find one, without a program.
    """
    inverse = np.linalg.pinv(A, rcond=1e-12)
    guess = inverse @ b
    for _ in range(30):
        gap = float(np.abs(A @ guess - b).max(initial=0.0))
        if gap > 0.1 * RESIDUAL_TOL:
            return None  # on no round can the equations be met
        if np.abs(guess).max(initial=0.0) <= 1.0:
            return np.asarray(guess)
        inside = np.clip(guess, -0.999, 0.999)
        guess = inside + inverse @ (b - A @ inside)
    return None
