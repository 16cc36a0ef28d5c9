"""Obstacle edges enumerated anew, vertex by vertex, and which parts of them are free."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope

Interval = tuple[float, float]
"""Part of a segment, from 0 at its first end to 1 at its second."""

_ON_FACET = 3e-9
"""A vertex this near to a facet, relative to the obstacle's coordinates, is on it: vertices that
are computed from half-spaces are merged when they are 1e-9 apart."""


@dataclass(frozen=True, eq=False)
class Edge:
    """A segment that two facets of an obstacle share, or a vertex of more than three facets."""

    ends: Floats
    """Shape (2, 3) [m]; a vertex has its point twice."""
    normals: Floats
    """Outward unit normals of the two facets, shape (2, 3); of a vertex (0, 3)."""
    owner: int
    """Number of the obstacle."""
    facets: int
    """Facets f < g of an obstacle with m as one number f m + g; -1 of a vertex."""


def list_edges(obstacles: Sequence[Polytope]) -> list[Edge]:
    """Every edge and crowded vertex of every obstacle.

    Two vertices on two common facets are joined by an edge, and where more facets meet every two
    of them may be those between which a string is taut.
    """
    found: list[Edge] = []
    for owner, block in enumerate(obstacles):
        points, normals = block.vertices(), block.A
        near = _ON_FACET * float(np.abs(points).max())
        on = np.abs(points @ normals.T - block.b) <= near
        facets = [frozenset(row.nonzero()[0].tolist()) for row in on]
        for one, two in combinations(range(len(points)), 2):
            for pair in combinations(sorted(facets[one] & facets[two]), 2):
                name = pair[0] * len(normals) + pair[1]
                found.append(Edge(points[[one, two]], normals[list(pair)], owner, name))
        for vertex, meeting in enumerate(facets):
            if len(meeting) > 3:
                found.append(Edge(points[[vertex, vertex]], np.zeros((0, 3)), owner, -1))
    return found


def open_parts(
    edge: Edge, others: Iterable[Polytope], bounds: tuple[Floats, Floats], depth: float
) -> list[Interval]:
    """Parts of an edge inside the workspace that no other obstacle has in its interior.

    Args:
        edge: of one obstacle.
        others: obstacles near it.
        bounds: corners of the workspace [m].
        depth: how deep inside an obstacle a point must be to be covered [m]. Of two obstacles that
            touch on the edge, the point between them is not.
    """
    lo, hi = bounds
    walls = np.concatenate([edge.ends - hi, lo - edge.ends], axis=1)
    inside = _where_negative(walls - depth)
    if inside is None:
        return []
    covers = [_where_negative(edge.ends @ block.A.T - block.b + depth) for block in others]
    return without([inside], [part for part in covers if part is not None])


def overlap(parts: list[Interval], other: Interval | None) -> list[Interval]:
    """What intervals have in common with another one."""
    low, high = other or (math.inf, -math.inf)
    both = [(max(a, low), min(b, high)) for a, b in parts]
    return [(a, b) for a, b in both if a <= b]


def without(parts: list[Interval], covers: list[Interval]) -> list[Interval]:
    """What is left of intervals when the insides of others are taken away: closed intervals."""
    for enter, leave in covers:
        cut = [(low, high) for low, high in parts if high <= enter or low >= leave]
        cut += [(low, enter) for low, high in parts if low <= enter < high]
        cut += [(leave, high) for low, high in parts if low < leave <= high]
        parts = cut
    return parts


def _where_negative(heights: Floats) -> Interval | None:
    """Where affine functions with the values (2, f) at both ends are negative; None: nowhere."""
    first, last = 0.0, 1.0
    for start, end in heights.T.tolist():
        if start >= 0.0 and end >= 0.0:
            return None
        if start >= 0.0:
            first = max(first, start / (start - end))
        elif end >= 0.0:
            last = min(last, start / (start - end))
    return (first, last) if first < last else None
