"""The shortest-path relaxation over shared faces, as one second-order cone program.

It is the graph-of-convex-sets relaxation (Marcucci, Umenberger, Parrilo and Tedrake 2024) with
faces as vertices, stated in its dual: affine potentials on faces, as steep as the distances of
consecutive faces allow. The dual variables of the rows are the flows, which suggest paths.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._clarabel import Cone, second_order_cones, solve_socp
from hzmp_planners.planning.certificate import (
    SOURCE,
    TARGET,
    Certificate,
    CrossingGraph,
    Cuts,
)

_PROOF_TIME = 4e-6  # [s] that the bound takes for a pair once the potentials are known (measured)


@dataclass(frozen=True, eq=False)
class Relaxation:
    """Potentials that prove a bound, and the flow that attains it."""

    certificate: Certificate
    flow: Floats
    """Flow of each pair, shape (E,), in [0, 1]."""
    tails: Floats
    """Where the flow of each pair leaves its first face, shape (E, n) [m]."""
    heads: Floats
    """Where it meets its second face, shape (E, n) [m]."""
    solved: bool


def solve_relaxation(
    graph: CrossingGraph,
    threshold: float,
    time_limit: float,
    parent: Certificate | None = None,
    cuts: Cuts | None = None,
) -> Relaxation | None:
    """Best affine potentials for a crossing graph.

    Args:
        graph: nodes and pairs; start and goal must be connected.
        threshold: see `Certificate.threshold`.
        time_limit: [s], in which the bound can be found, too.
        parent: see `Certificate`.
        cuts: see `Certificate`.

    Returns:
        None when the solver did not produce finite numbers. A solution that was stopped early is
        still a proof, of a lower bound: the certificate's arithmetic does not trust the solver.
    """
    corners, pairs = graph.corners, graph.pairs
    nodes, k, n = corners.shape
    count = len(pairs)
    deadline = time.perf_counter() + time_limit - _PROOF_TIME * count
    scale = max(float(np.ptp(corners.reshape(-1, n), axis=0).max()), 1e-9)
    charts = _affine_charts(corners / scale)
    e, part, c = _vertex_rows(graph)
    A, top = _constraints(corners / scale, charts, pairs, (e, part, c)), len(e)
    b = np.zeros(A.shape[0])
    b[top :: n + 1] = 1.0
    cost = np.zeros(A.shape[1])
    cost[TARGET * n] = -1.0
    used = np.diff(A.indptr) > 0
    cones: list[Cone] = [("nonnegative", top), *second_order_cones(n + 1, count)]
    left = deadline - time.perf_counter()
    solution = solve_socp(cost[used], csc_array(A[:, used]), b, cones, left)
    if not (np.isfinite(solution.x).all() and np.isfinite(solution.z).all()):
        return None
    x = np.zeros(A.shape[1])
    x[used] = solution.x
    coefficients = x[: nodes * n].reshape(nodes, n)
    potentials = np.einsum("mkd,md->mk", charts, coefficients) * scale
    u = x[nodes * n :].reshape(count, n + 1)[:, :n]
    u = u / np.maximum(1.0, np.linalg.norm(u, axis=1, keepdims=True))
    weights = np.zeros((count, 2, k))
    weights[e, part, c] = np.maximum(solution.z[:top], 0.0)
    behind, ahead = weights[:, 0], weights[:, 1]
    return Relaxation(
        Certificate(graph, potentials, u, threshold, parent, cuts or {}),
        np.clip(ahead.sum(axis=1), 0.0, 1.0),
        _average(corners[pairs[:, 0]], behind),
        _average(corners[pairs[:, 1]], ahead),
        solution.solved,
    )


def _vertex_rows(graph: CrossingGraph) -> tuple[Ints, Ints, Ints]:
    """Pair, part (0 tail, 1 head) and corner of each row: every corner once, padding left out."""
    corners = graph.corners
    real = np.ones(corners.shape[:2], dtype=np.bool_)
    real[:, 1:] = (corners[:, 1:] != corners[:, :-1]).any(axis=2)
    parts = [np.nonzero(real[graph.pairs[:, part]]) for part in (0, 1)]
    part = np.repeat([0, 1], [len(pair) for pair, _ in parts])
    pair, corner = (np.concatenate([rows[i] for rows in parts]) for i in (0, 1))
    return pair, part, corner


def _constraints(
    corners: Floats, charts: Floats, pairs: Ints, vertex_rows: tuple[Ints, Ints, Ints]
) -> csc_array[np.float64]:
    """Rows that bound the potentials at corners, then the cones |u| <= 1.

    Columns: n potential coefficients of every node, then (u, t) of every pair. With m the middle of
    the tail's face, a corner z of the head gives phi_j(z) - u.(z - m) - t <= 0, a corner x of the
    tail u.(x - m) - phi_i(x) + t <= 0. phi(start) = 0 has no coefficients.
    """
    _nodes, _, n = corners.shape
    count, first_pair = len(pairs), len(corners) * n
    e, part, c = vertex_rows
    row, axis = np.arange(len(e)), np.arange(n)
    node = pairs[e, part]
    sign = np.where(part == 0, 1.0, -1.0)[:, None]
    middle = corners.mean(axis=1)[pairs[e, 0]]
    pair_columns = first_pair + e[:, None] * (n + 1) + np.arange(n + 1)
    u_and_t = np.hstack([corners[node, c] - middle, np.ones((len(e), 1))])
    phi = charts[node, c] * (node != SOURCE)[:, None]
    cone = np.arange(count)[:, None] * (n + 1)
    triplets = [
        (np.broadcast_to(row[:, None], pair_columns.shape), pair_columns, sign * u_and_t),
        (np.broadcast_to(row[:, None], phi.shape), node[:, None] * n + axis, -sign * phi),
        (len(e) + cone + 1 + axis, first_pair + cone + axis, -np.ones((count, n))),
    ]
    rows, columns, values = (np.concatenate([t[i].ravel() for t in triplets]) for i in range(3))
    kept = values != 0.0
    shape = (len(e) + count * (n + 1), first_pair + count * (n + 1))
    entries = rows[kept].astype(np.int64), columns[kept].astype(np.int64)
    return csc_array((values[kept], entries), shape=shape, dtype=np.float64)


def _affine_charts(corners: Floats) -> Floats:
    """Basis of the affine functions on each face, evaluated at its corners: (M, k, d), d = n.

    Column 0 is the constant; the others are coordinates along the face from its middle, so that
    the coefficients are as independent as the face allows.
    """
    nodes, k, n = corners.shape
    offset = corners - corners.mean(axis=1, keepdims=True)
    _, _, axes = np.linalg.svd(offset, full_matrices=False)
    tangents = axes[:, : n - 1]
    charts = np.ones((nodes, k, n))
    charts[:, :, 1:] = offset @ tangents.transpose(0, 2, 1)
    # A direction in which a face has no extent must not look like a variable.
    charts[np.abs(charts) < 1e-13 * np.abs(corners).max()] = 0.0
    return charts


def _average(corners: Floats, weights: Floats) -> Floats:
    """Weighted mean of corners (E, k, n) with weights (E, k); the plain mean where all are 0."""
    total = weights.sum(axis=1, keepdims=True)
    shares = np.where(
        total > 0.0, weights / np.where(total > 0.0, total, 1.0), 1.0 / corners.shape[1]
    )
    return np.asarray(np.einsum("ek,ekn->en", shares, corners))
