"""The shortest-path relaxation over shared faces, as one second-order cone program.

It is the graph-of-convex-sets relaxation (Marcucci, Umenberger, Parrilo and Tedrake 2024) with
faces as vertices, stated in its dual: affine potentials on faces, as steep as the distances of
consecutive faces allow. The dual variables of the rows are the flows, which suggest paths.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._clarabel import Cone, second_order_cones, solve_socp
from hzmp_planners.planning.certificate import TARGET, Certificate, CrossingGraph, Cuts


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
        time_limit: [s].
        parent: see `Certificate`.
        cuts: see `Certificate`.

    Returns:
        None when the solver did not produce finite numbers. A solution that was stopped early is
        still a proof, of a lower bound: the certificate's arithmetic does not trust the solver.
    """
    corners, pairs = graph.corners, graph.pairs
    nodes, k, n = corners.shape
    count = len(pairs)
    scale = max(float(np.ptp(corners.reshape(-1, n), axis=0).max()), 1e-9)
    charts = _affine_charts(corners / scale)
    dof = charts.shape[2]
    # Columns: potential coefficients of every node, then (u, t) of every pair. phi(start) = 0 is
    # fixed by leaving its columns out of the rows; goal's slopes meet a single vertex only.
    first_pair = nodes * dof
    width = first_pair + count * (n + 1)
    middle = corners.mean(axis=1) / scale
    rows: list[Ints] = []
    columns: list[Ints] = []
    values: list[Floats] = []
    # Rows of a pair: k of phi_j(z) - u.(z - m) - t <= 0, k of u.(x - m) - phi_i(x) + t <= 0,
    # with m the middle of face i; then the cone |u| <= 1.
    e, c, a = np.meshgrid(np.arange(count), np.arange(k), np.arange(n), indexing="ij")
    origin = middle[pairs[:, 0]][e, a]
    pair_column = first_pair + e * (n + 1) + a
    for part, sign in ((1, -1.0), (0, 1.0)):
        node = pairs[:, part]
        row = e * (2 * k) + (0 if part else k) + c
        rows.append(row.ravel())
        columns.append(pair_column.ravel())
        values.append((sign * (corners[node][e, c, a] / scale - origin)).ravel())
        rows.append(row[:, :, 0].ravel())
        columns.append((first_pair + e[:, :, 0] * (n + 1) + n).ravel())
        values.append(np.full(count * k, sign))
        ee, cc, dd = np.meshgrid(np.arange(count), np.arange(k), np.arange(dof), indexing="ij")
        phi = charts[node][ee, cc, dd] * np.where(node[ee] == 0, 0.0, 1.0)
        rows.append((ee * (2 * k) + (0 if part else k) + cc).ravel())
        columns.append((node[ee] * dof + dd).ravel())
        values.append((-sign * phi).ravel())
    top = count * 2 * k
    axis_rows = top + np.arange(count)[:, None] * (n + 1) + 1 + np.arange(n)
    axis_columns = first_pair + np.arange(count)[:, None] * (n + 1) + np.arange(n)
    rows.append(axis_rows.ravel())
    columns.append(axis_columns.ravel())
    values.append(-np.ones(count * n))
    height = top + count * (n + 1)
    b = np.zeros(height)
    b[top :: n + 1] = 1.0
    data = np.concatenate(values)
    kept = data != 0.0
    entries = np.concatenate(rows)[kept], np.concatenate(columns)[kept]
    A = csc_array((data[kept], entries), shape=(height, width), dtype=np.float64)
    cost = np.zeros(width)
    cost[TARGET * dof] = -1.0
    used = np.diff(A.indptr) > 0
    cones: list[Cone] = [("nonnegative", top), *second_order_cones(n + 1, count)]
    solution = solve_socp(cost[used], csc_array(A[:, used]), b, cones, time_limit)
    if not (np.isfinite(solution.x).all() and np.isfinite(solution.z).all()):
        return None
    x = np.zeros(width)
    x[used] = solution.x
    coefficients = x[:first_pair].reshape(nodes, dof)
    coefficients[0] = 0.0
    potentials = np.einsum("mkd,md->mk", charts, coefficients) * scale
    u = x[first_pair:].reshape(count, n + 1)[:, :n]
    u = u / np.maximum(1.0, np.linalg.norm(u, axis=1, keepdims=True))
    weights = np.maximum(solution.z[:top], 0.0).reshape(count, 2, k)
    ahead, behind = weights[:, 0], weights[:, 1]
    return Relaxation(
        Certificate(graph, potentials, u, threshold, parent, cuts or {}),
        np.clip(ahead.sum(axis=1), 0.0, 1.0),
        _average(corners[pairs[:, 0]], behind),
        _average(corners[pairs[:, 1]], ahead),
        solution.solved,
    )


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
    return charts


def _average(corners: Floats, weights: Floats) -> Floats:
    """Weighted mean of corners (E, k, n) with weights (E, k); the plain mean where all are 0."""
    total = weights.sum(axis=1, keepdims=True)
    shares = np.where(
        total > 0.0, weights / np.where(total > 0.0, total, 1.0), 1.0 / corners.shape[1]
    )
    return np.asarray(np.einsum("ek,ekn->en", shares, corners))
