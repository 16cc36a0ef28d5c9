"""The shortest path through a fixed sequence of faces: one second-order cone program."""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import csc_array

from hzmp_planners._arrays import Floats
from hzmp_planners._clarabel import Cone, second_order_cones, solve_socp
from hzmp_planners.planning.detour import least_detour

FACE_TIME = 4e-4
"""What `refine` takes for each face [s] (measured)."""
SWEEP_TIME = 4e-6
"""What `rank_together` takes for each face of all routes and each sweep [s] (measured)."""


def refine(start: Floats, goal: Floats, corners: Floats, time_limit: float = math.inf) -> Floats:
    r"""Minimise :math:`\sum_k |p_{k+1} - p_k|` over points p_k of given faces.

    Args:
        start: shape (n,) [m].
        goal: shape (n,) [m].
        corners: faces in the order of travel, shape (K-1, k, n) [m], padded by repetition.
        time_limit: [s].

    Returns:
        Waypoints (K+1, n) with p_0 = start, p_K = goal, each p_k a convex combination of its
        face's corners. If the solver stops early the result is still a path, only longer.
    """
    if not len(corners):
        return np.array([start, goal])
    if len(corners) == 1:
        _, point = least_detour(corners, start, goal)
        return np.array([start, point[0], goal])
    weights = _solve(start, goal, corners, time_limit)
    points = np.einsum("fk,fkn->fn", weights, corners)
    return _polish(np.vstack([start, points, goal]), corners)


def rank_together(start: Floats, goal: Floats, routes: list[Floats], sweeps: int) -> Floats:
    """Approximate optimal lengths of many face sequences, all improved at the same time.

    Alternating sweeps move every second waypoint of every route to its exact optimum between its
    neighbours. Cheap enough to compare dozens of sequences before the best are refined exactly.

    Args:
        start: shape (n,) [m].
        goal: shape (n,) [m].
        routes: for each sequence its faces, (K_i - 1, k, n) [m].
        sweeps: how many passes over all waypoints.

    Returns:
        Length of each route after the sweeps [m]: an upper bound of its optimum.
    """
    longest = max(len(route) for route in routes)
    k, n = routes[0].shape[1:]
    corners = np.empty((len(routes), longest, k, n))
    corners[:] = goal  # shorter routes wait at the goal
    for index, route in enumerate(routes):
        corners[index, : len(route)] = route
    points = np.empty((len(routes), longest + 2, n))
    points[:, 0], points[:, -1] = start, goal
    points[:, 1:-1] = corners.mean(axis=2)
    swept = sweep(points, corners, sweeps)
    return np.asarray(np.linalg.norm(np.diff(swept, axis=1), axis=2).sum(axis=1))


def sweep(points: Floats, corners: Floats, sweeps: int) -> Floats:
    """Move every second waypoint of routes to its optimum between its neighbours, in turns.

    Args:
        points: start, a point for each face, and goal of each route, shape (R, K+1, n) [m].
        corners: faces of each route in the order of travel, shape (R, K-1, k, n) [m].
        sweeps: how many passes over all waypoints.

    Returns:
        The moved points, on their faces after the first sweep, shape (R, K+1, n) [m].
    """
    points = points.copy()
    routes, count, k, n = corners.shape
    for turn in range(2 * sweeps):
        inner = np.arange(1 + turn % 2, count + 1, 2)
        if not len(inner):
            continue
        _, moved = least_detour(
            corners[:, inner - 1].reshape(-1, k, n),
            points[:, inner - 1].reshape(-1, n),
            points[:, inner + 1].reshape(-1, n),
        )
        points[:, inner] = moved.reshape(routes, len(inner), n)
    return points


def _solve(start: Floats, goal: Floats, corners: Floats, time_limit: float) -> Floats:
    """Barycentric weights of the optimum, shape (K-1, k), non-negative, rows summing to 1.

    Variables: segment lengths tau (K), then weights w of corners 1..k-1 of each face;
    p = v_0 + sum_i w_i (v_i - v_0), w >= 0, sum_i w_i <= 1.
    """
    count, k, n = corners.shape
    segments, free = count + 1, k - 1
    spokes = corners[:, 1:] - corners[:, :1]
    base = np.vstack([start, corners[:, 0], goal])
    width = segments + count * free
    scale = max(float(np.linalg.norm(goal - start)), float(np.abs(spokes).max()), 1e-9)
    # Rows: w >= 0; 1 - sum w >= 0; then one cone (tau_k, p_{k+1} - p_k) a segment.
    w = segments + np.arange(count * free)
    rows = [np.arange(count * free), count * free + np.repeat(np.arange(count), free)]
    columns = [w, w]
    values = [-np.ones(count * free), np.ones(count * free)]
    top = count * free + count
    cone = top + np.arange(segments) * (n + 1)
    rows.append(cone)
    columns.append(np.arange(segments))
    values.append(-np.ones(segments))
    face, spoke, axis = np.meshgrid(np.arange(count), np.arange(free), np.arange(n), indexing="ij")
    column = (segments + face * free + spoke).ravel()
    value = (spokes[face, spoke, axis] / scale).ravel()
    for segment, sign in ((face, -1.0), (face + 1, 1.0)):  # as the head of one, tail of the next
        rows.append((top + segment * (n + 1) + 1 + axis).ravel())
        columns.append(column)
        values.append(sign * value)
    height = top + segments * (n + 1)
    b = np.zeros(height)
    b[count * free : top] = 1.0
    b[(cone[:, None] + 1 + np.arange(n)).ravel()] = (np.diff(base, axis=0) / scale).ravel()
    A = csc_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(height, width),
    )
    cost = np.concatenate([np.ones(segments), np.zeros(count * free)])
    cones: list[Cone] = [("nonnegative", top), *second_order_cones(n + 1, segments)]
    solution = solve_socp(cost, A, b, cones, time_limit)
    found = solution.x[segments:].reshape(count, free)
    if not np.isfinite(found).all():
        found = np.full((count, free), 1.0 / k)
    found = np.clip(found, 0.0, 1.0)
    found /= np.maximum(found.sum(axis=1, keepdims=True), 1.0)
    return np.hstack([1.0 - found.sum(axis=1, keepdims=True), found])


def _polish(points: Floats, corners: Floats) -> Floats:
    """One sweep of exact single-point minimisation removes the interior-point method's residue."""
    best = points.copy()
    for k in range(1, len(points) - 1):
        _, better = least_detour(corners[k - 1 : k], best[k - 1], best[k + 1])
        best[k] = better[0]
    before = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    after = np.linalg.norm(np.diff(best, axis=0), axis=1).sum()
    return best if after < before else points
