"""The parts of obstacle edges that a short path can touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.planning.bends.blockers import Blockers, below
from hzmp_planners.planning.bends.edges import Edges

_WIDER = 1e-9
"""Parts reach this much farther [m at S = 1] than they are computed to: none may be missed."""


def exposed_edges(
    edges: Edges,
    blockers: Blockers,
    bounds: tuple[Floats, Floats],
    foci: tuple[Floats, Floats],
    cost: float,
    scale: float,
) -> Edges:
    """Edges clipped to the workspace and the informed set, without what other obstacles cover.

    Args:
        edges: of all obstacles.
        blockers: the obstacles, by the numbers that `edges.owner` uses.
        bounds: corners of the workspace [m].
        foci: start and goal, each (3,) [m].
        cost: paths this long or longer are not of interest [m].
        scale: size of the world's coordinates [m].
    """
    wider = _WIDER * scale
    ends, (lo, hi) = edges.ends, bounds
    walls = np.concatenate([ends - hi, lo - ends], axis=2) - wider
    first, last = below(walls[:, 0], walls[:, 1])
    enters, leaves = _inside_ellipsoid(ends, foci, cost + wider)
    first, last = np.maximum(first, enters), np.minimum(last, leaves)
    rows = np.flatnonzero(first <= last)
    edges = edges.take(rows)
    chosen, share = _uncovered(first[rows], last[rows], *_covers(edges, blockers, wider))
    origin = edges.ends[chosen, :1]
    pieces = origin + share[:, :, None] * (edges.ends[chosen, 1:] - origin)
    return replace(edges.take(chosen), ends=pieces)


def _inside_ellipsoid(
    ends: Floats, foci: tuple[Floats, Floats], cost: float
) -> tuple[Floats, Floats]:
    """The part of each segment (E, 2, 3) where |x - s| + |x - g| <= cost, as parameters (E,)."""
    s, g = foci
    distance = float(np.linalg.norm(g - s))
    axis = (g - s) / distance if distance > 0.0 else np.zeros(3)
    # x'Qx = 1 on the surface: half the cost along the axis, less across it.
    across, along = (cost * cost - distance * distance) / 4.0, cost * cost / 4.0
    Q = np.eye(3) / across + np.outer(axis, axis) * (1.0 / along - 1.0 / across)
    x = ends[:, 0] - (s + g) / 2.0
    d = ends[:, 1] - ends[:, 0]
    a = np.einsum("ei,ij,ej->e", d, Q, d)
    b = np.einsum("ei,ij,ej->e", d, Q, x)
    c = np.einsum("ei,ij,ej->e", x, Q, x) - 1.0
    room = b * b - a * c
    root = np.sqrt(np.maximum(room, 0.0))
    meets = (room >= 0.0) & ((a > 0.0) | (c <= 0.0))
    long = np.where(a > 0.0, a, np.inf)  # a single point, inside, gets the interval from 0 to 0
    return np.where(meets, (-b - root) / long, np.inf), np.where(meets, (-b + root) / long, -np.inf)


def _covers(edges: Edges, blockers: Blockers, wider: float) -> tuple[Ints, Floats, Floats]:
    """Where the interiors of other obstacles cover edges: edge, from, to, each (c,)."""
    lows, highs = edges.ends.min(axis=1), edges.ends.max(axis=1)
    near = (blockers.lows < highs[:, None]) & (blockers.highs > lows[:, None])
    edge, body = near.all(axis=2).nonzero()
    other = body != edges.owner[edge]
    edge, body = edge[other], body[other]
    A, b = blockers.A[body], blockers.b[body]
    heights = np.einsum("ckn,cfn->ckf", edges.ends[edge], A) - b[:, None] + wider
    enters, leaves = below(heights[:, 0], heights[:, 1])
    covered = enters < leaves
    return edge[covered], enters[covered], leaves[covered]


def _uncovered(
    first: Floats, last: Floats, edge: Ints, enters: Floats, leaves: Floats
) -> tuple[Ints, Floats]:
    """What covers leave of the interval of each edge: edge (p,), from and to (p, 2).

    Covers are a little short, so that the single point between two of them is left over, too.
    """
    covers: dict[int, list[tuple[float, float]]] = {}
    for number, low, high in zip(edge.tolist(), enters.tolist(), leaves.tolist(), strict=True):
        covers.setdefault(number, []).append((low, high))
    numbers: list[int] = []
    parts: list[tuple[float, float]] = []
    for number, (low, high) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
        begin = low
        for enter, leave in sorted(covers.get(number, ())):
            if begin < enter and begin <= high:
                numbers.append(number)
                parts.append((begin, min(enter, high)))
            begin = max(begin, leave)
        if begin <= high:
            numbers.append(number)
            parts.append((begin, high))
    return np.array(numbers, dtype=np.int64), np.array(parts).reshape(-1, 2)
