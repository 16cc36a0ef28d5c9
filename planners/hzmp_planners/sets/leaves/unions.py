"""Building the matrices and leaves of unions of convex sets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csc_array, csr_array, eye_array
from scipy.spatial import cKDTree

from hzmp_planners._arrays import Floats, Ints, frozen
from hzmp_planners._links import component_labels
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope
from hzmp_planners.sets.leaves.leaf_table import LeafTable, StackedPoints
from hzmp_planners.sets.sparse import Matrix, as_sparse, frozen_matrix, ones, stack, zeros

if TYPE_CHECKING:
    from hzmp_planners.sets.convex_set import ConvexSet
    from hzmp_planners.sets.hybrid_zonotope import HybridZonotope

HybridParts = tuple[Matrix, Matrix, Floats, Matrix, Matrix, Floats, Callable[[], LeafTable]]
"""Gc, Gb, c, Ac, Ab, b and the source of the leaves."""


def of_vertices(vertices: Floats, incidence: Matrix) -> HybridParts:
    """The V-rep form; see `HybridZonotope.from_vertices`."""
    nv, n = vertices.shape
    if n == 0:
        raise ShapeError("V must have at least one column: a set needs a space")
    if incidence.shape[0] != nv:
        raise ShapeError(f"M must have {nv} rows, one a vertex, got {incidence.shape[0]}")
    if not np.isin(incidence.data, (0.0, 1.0)).all():
        raise ShapeError("M must hold only 0 and 1")
    M = incidence.copy()
    M.eliminate_zeros()
    counts = np.diff(M.indptr)
    if (counts == 0).any():
        raise ShapeError(f"column {int(np.argmin(counts))} of M selects no vertex")
    N = M.shape[1]
    each = np.arange(nv)
    # Columns one after the other: lam_j is in rows 0 and 2 + j, its slack in 2 + j, beta_i in row 1
    # and in those of its vertices.
    Ac = _columns(
        np.concatenate([np.tile([1.0, 0.5], nv), np.full(nv, 0.5)]),
        np.concatenate([np.column_stack([0 * each, 2 + each]).ravel(), 2 + each]),
        np.concatenate([np.full(nv, 2), np.ones(nv, dtype=np.int64)]),
        nv + 2,
    )
    heads = M.indptr[:-1] + np.arange(N)
    below = np.ones(M.nnz + N, dtype=np.bool_)
    below[heads] = False
    rows, values = np.ones(M.nnz + N, dtype=np.int64), np.where(below, -0.5, 1.0)
    rows[below] = 2 + M.indices
    Ab = _columns(values, rows, counts + 1, nv + 2)
    Gc = _columns(
        vertices.ravel() / 2.0,
        np.tile(np.arange(n), nv),
        np.concatenate([np.full(nv, n), np.zeros(nv, dtype=np.int64)]),
        n,
    )
    degree = np.bincount(M.indices, minlength=nv)
    b = np.concatenate([[2.0 - nv, 2.0 - N], degree / 2.0 - 1.0])
    points = StackedPoints(frozen(vertices[M.indices]), frozen(M.indptr[:-1].astype(np.int64)))

    stops = M.indptr.tolist()

    def make(leaf: int) -> ConstrainedZonotope:
        return ConstrainedZonotope.of_known_vertices(points.points[stops[leaf] : stops[leaf + 1]])

    def source() -> LeafTable:
        return LeafTable(csr_array(eye_array(N, dtype=np.bool_)), make, points, may_be_empty=False)

    return Gc, zeros(n, N), vertices.sum(axis=0) / 2.0, Ac, Ab, b, source


def _columns(values: Floats, rows: Ints, counts: Ints, height: int) -> Matrix:
    """A sparse matrix from its columns' entries one after the other, rows ascending in each."""
    pointers = np.concatenate([[0], np.cumsum(counts)])
    return frozen_matrix(csc_array((values, rows, pointers), shape=(height, len(counts))))


def merged_vertices(bodies: Sequence[ConvexSet]) -> tuple[Floats, csc_array[Any]]:
    """Distinct vertices (nv, n) of bounded polytopal sets, and their incidence (nv, N)."""
    if not bodies:
        raise ShapeError("a union needs at least one set")
    if len({body.n for body in bodies}) > 1:
        raise ShapeError(f"a union needs sets of one dimension, got {[body.n for body in bodies]}")
    corners = [body.vertices() for body in bodies]
    corners = [points for points in corners if len(points)]
    if not corners:
        return np.zeros((0, bodies[0].n)), csc_array((0, 0))
    points = np.concatenate(corners)
    size = float(np.ptp(points, axis=0).max())
    pairs = cKDTree(points).query_pairs(1e-11 * size, output_type="ndarray")
    labels = component_labels(pairs.astype(np.int64), len(points))
    _, first, rows = np.unique(labels, return_index=True, return_inverse=True)
    columns = np.repeat(np.arange(len(corners)), [len(c) for c in corners])
    entries = np.unique(np.column_stack([rows, columns]), axis=0)
    shape = (len(first), len(corners))
    M = csc_array((np.ones(len(entries)), (entries[:, 0], entries[:, 1])), shape=shape)
    return points[first], M


def disaggregated(parts: Sequence[HybridZonotope]) -> HybridParts:
    r"""Union in which each set keeps its factors and has a binary of its own.

    In 0/1 factors, set i is switched by :math:`\beta_i`: :math:`x = \sum_i 2 G_i \zeta_i + c'_i
    \beta_i`, :math:`2 A_i \zeta_i = b'_i \beta_i`, :math:`1^T\zeta_i + m_i s_i = m_i \beta_i` (all
    factors of an unchosen set are 0), :math:`1^T\beta = 1`; binaries of the sets are treated like
    their other factors.
    """
    if len({part.n for part in parts}) != 1:
        raise ShapeError(f"a union needs sets of one dimension, got {[part.n for part in parts]}")
    N, n = len(parts), parts[0].n
    Gc, Gb, shifts = [], [], np.zeros((n, N))
    rows: list[list[Any]] = []
    binaries: list[list[Any]] = []
    for i, part in enumerate(parts):
        shifts[:, i] = part.c - part.Gc.sum(axis=1) - part.Gb.sum(axis=1)
        offset = part.b + part.Ac.sum(axis=1) + part.Ab.sum(axis=1)
        m = part.ng + part.nb
        Gc.append(stack([[2.0 * part.Gc, zeros(n, 1)]]))
        Gb.append(2.0 * part.Gb)
        tops: list[Any] = [zeros(part.nc + 1, p.ng + 1) for p in parts]
        tops[i] = stack([[2.0 * part.Ac, zeros(part.nc, 1)], [ones(1, part.ng), [[float(m)]]]])
        rows.append(tops)
        switches = np.zeros((part.nc + 1, N))
        switches[:, i] = np.append(-offset, -float(m))
        own: list[Any] = [zeros(part.nc + 1, p.nb) for p in parts]
        own[i] = stack([[2.0 * part.Ab], [ones(1, part.nb)]])
        binaries.append([*own, switches])
    rows.append([zeros(1, p.ng + 1) for p in parts])
    binaries.append([*(zeros(1, p.nb) for p in parts), np.ones((1, N))])
    b = np.zeros(1 + sum(part.nc + 1 for part in parts))
    b[-1] = 1.0
    matrices = _signed(stack([Gc]), stack([[*Gb, shifts]]), stack(rows), stack(binaries), b)

    def source() -> LeafTable:
        choices: list[Matrix] = []
        leaves: list[ConstrainedZonotope] = []
        start = 0
        for i, part in enumerate(parts):
            table = part.leaf_table
            width = sum(p.nb for p in parts) + N
            count = len(table)
            rest = zeros(count, width - N - part.nb - start)
            switch = np.zeros((count, N))
            switch[:, i] = 1.0
            choices.append(stack([[zeros(count, start), table.choices, rest, switch]]))
            leaves += table.parts
            start += part.nb
        stacked = csr_array(stack([[choice] for choice in choices]) > 0.5)
        return LeafTable(stacked, leaves.__getitem__, may_be_empty=False)

    return *matrices, source


def _signed(
    Gc: Matrix, Gb: Matrix, Ac: Matrix, Ab: Matrix, b: Floats
) -> tuple[Matrix, Matrix, Floats, Matrix, Matrix, Floats]:
    """A form without centre from 0/1 factors to -1/1 factors: z = (1 + xi) / 2."""
    c = (Gc.sum(axis=1) + Gb.sum(axis=1)) / 2.0
    offset = b - (Ac.sum(axis=1) + Ab.sum(axis=1)) / 2.0
    half = [as_sparse(block / 2.0, "a block") for block in (Gc, Gb, Ac, Ab)]
    return half[0], half[1], c, half[2], half[3], offset
