"""Edges of convex obstacles: a shortest path in 3-D bends nowhere else."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.sets import Polytope

_ON_FACET = 4e-9  # distance of a vertex from its facet, relative to the obstacle's coordinates
_ON_LINE = 1e-9  # distance of vertices from an edge, relative to its length


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges, or pieces of them, and vertices at which more than three facets meet.

    Of obstacles so thin that vertices lie on facets they do not belong to, everything that may be
    an edge is here.
    """

    ends: Floats
    """Shape (E, 2, 3) [m]; a vertex has its point twice."""
    normals: Floats
    """Outward unit normals of the two facets at an edge, shape (E, 2, 3); zero at a vertex, and
    where it is not known which facets they are."""
    owner: Ints
    """The obstacle of each edge, shape (E,)."""
    facets: Ints
    """The two facets f < g of an obstacle with m as one number f m + g, shape (E,); -1 at a vertex,
    and where it is not known which facets they are."""

    def __len__(self) -> int:
        return len(self.ends)

    def take(self, rows: Ints) -> Edges:
        """Some of the edges."""
        return Edges(self.ends[rows], self.normals[rows], self.owner[rows], self.facets[rows])


def obstacle_edges(obstacles: Sequence[Polytope]) -> Edges:
    """All edges of all obstacles, and their vertices of more than three facets.

    Two facets meet in an edge where they have vertices in common that lie on one line. Obstacles
    with equally many facets and vertices are worked on together.
    """
    alike: dict[tuple[int, int], list[int]] = defaultdict(list)
    for number, block in enumerate(obstacles):
        alike[len(block.b), len(block.vertices())].append(number)
    parts = [
        _edges_of(np.array(numbers), [obstacles[i] for i in numbers]) for numbers in alike.values()
    ]
    if not parts:
        none = np.zeros(0, dtype=np.int64)
        return Edges(np.zeros((0, 2, 3)), np.zeros((0, 2, 3)), none, none)
    return Edges(
        np.concatenate([part.ends for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.owner for part in parts]),
        np.concatenate([part.facets for part in parts]),
    )


def _edges_of(numbers: Ints, obstacles: Sequence[Polytope]) -> Edges:
    vertices = np.array([block.vertices() for block in obstacles])
    normals = np.array([block.A for block in obstacles])
    offsets = np.array([block.b for block in obstacles])
    gap = np.abs(np.einsum("mvn,mfn->mfv", vertices, normals) - offsets[:, :, None])
    on = gap <= _ON_FACET * np.abs(vertices).max(axis=(1, 2), keepdims=True)
    one, two = np.triu_indices(normals.shape[1], 1)
    common = on[:, one] & on[:, two]
    body, pair = np.nonzero(common.sum(axis=2) >= 2)
    shared = common[body, pair]
    rows = np.arange(len(body))
    points = vertices[body]
    # The vertex farthest from any one of them, and the one farthest from that, are the ends.
    first = last = shared.argmax(axis=1)
    for _ in range(2):
        first = last
        away = np.linalg.norm(points - points[rows, first][:, None], axis=2)
        last = np.where(shared, away, -1.0).argmax(axis=1)
    segment = np.stack([points[rows, first], points[rows, last]], axis=1)
    along = segment[:, 1] - segment[:, 0]
    offset = np.cross(points - segment[:, :1], along[:, None])
    aside = np.where(shared, np.linalg.norm(offset, axis=2), 0.0).max(axis=1)
    size = (along**2).sum(axis=1)
    straight = aside <= _ON_LINE * size
    real = np.flatnonzero((size > 0.0) & straight)
    facets = np.stack([one[pair], two[pair]], axis=1)[real]
    crowded, vertex = np.nonzero(on.sum(axis=1) > 3)
    unsure, ends = _joined(body[~straight], shared[~straight])
    crowded, ends = np.append(crowded, unsure), np.vstack([np.stack([vertex] * 2, axis=1), ends])
    return Edges(
        np.concatenate([segment[real], vertices[crowded[:, None], ends]]),
        np.concatenate([normals[body[real, None], facets], np.zeros((len(ends), 2, 3))]),
        numbers[np.concatenate([body[real], crowded])],
        np.append(facets @ [normals.shape[1], 1], np.full(len(ends), -1)),
    )


def _joined(body: Ints, shared: Bools) -> tuple[Ints, Ints]:
    """All pairs of vertices that two facets share which have more than a line in common.

    The facets are nearly one plane, seen from one side or from two: which of the vertices their
    edge joins is below round-off.

    Args:
        body: of the two facets, shape (c,).
        shared: the vertices on both, shape (c, v).

    Returns:
        Body (s,) and ends (s, 2) of each segment once.
    """
    found = {
        (number, *ends)
        for number, row in zip(body.tolist(), shared, strict=True)
        for ends in combinations(np.flatnonzero(row).tolist(), 2)
    }
    rows = np.array(sorted(found), dtype=np.int64).reshape(-1, 3)
    return rows[:, 0], rows[:, 1:]
