"""The leaves of a planar free space as plain lists, for searches that look at one leaf at a time.

Numbers that are used one by one are several times faster in lists than in arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._links import component_labels
from hzmp_planners._ragged import distinct_points, order_by, starts_of
from hzmp_planners.constants import SPLINTER_TOL
from hzmp_planners.free_space import FreeSpace

_ONE_POINT = 1e-9
"""Ends of faces nearer than this [m at S = 1] are one point."""

Exit = tuple[int, int, float, float, int, float, float, int]
"""A face as the way out of a leaf: face, leaf beyond, left end x, y and number, right end x, y and
number. Numbers are those of corners; -1 where no string bends."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Exits of each leaf, and the corners at which a taut string may bend."""

    exits: list[list[Exit]]
    corners: Floats
    """Shape (C, 2) [m]. Where obstacles touch in one point, each side has its own corner there."""
    corner_leaves: Ints
    """A leaf at each corner, shape (C,)."""
    scale: float
    """Size of the world's coordinates [m]."""


def build_mesh(space: FreeSpace) -> Mesh:
    """The mesh of a free space whose leaves are disjoint.

    Strings bend at vertices of obstacles only: elsewhere on the boundary the free space is locally
    convex, or the boundary straight.
    """
    graph = space.graph
    number, first = _corner_numbers(space)
    left = np.column_stack([-graph.normals[:, 1], graph.normals[:, 0]])
    along = graph.corners[:, 0] - graph.corners[:, 1]
    a_is_left = np.einsum("fn,fn->f", along, left) > 0.0
    # Seen from the first leaf of a face, then from the second: which end is on the left.
    left_end = np.column_stack([~a_is_left, a_is_left]).ravel() + 2 * (
        np.arange(2 * len(graph)) >> 1
    )
    leaf = graph.ends.ravel()
    order = order_by(leaf, len(space))
    one, points = left_end[order], graph.corners.reshape(-1, 2)
    two = one ^ 1
    exits = list(
        zip(
            (order >> 1).tolist(),
            leaf[order ^ 1].tolist(),
            *points[one].T.tolist(),
            number[one].tolist(),
            *points[two].T.tolist(),
            number[two].tolist(),
            strict=True,
        )
    )
    starts = starts_of(np.bincount(leaf, minlength=len(space))).tolist()
    by_leaf = [exits[begin:end] for begin, end in pairwise(starts)]
    return Mesh(by_leaf, points[first], graph.ends[first >> 1, 0], space.scale)


def _corner_numbers(space: FreeSpace) -> tuple[Ints, Ints]:
    """The corner at each end of each face, shape (2 F,), -1 for none; and one end of each corner.

    Ends at one vertex belong to one corner if leaves between them connect them.
    """
    graph = space.graph
    ends = graph.corners.reshape(-1, 2)
    number = np.full(len(ends), -1)
    none = np.zeros(0, dtype=np.int64)
    if not space.obstacles or not len(ends):
        return number, none
    # Most ends are copies of a few vertices, to the last bit.
    first, copy = distinct_points(ends)
    vertices, points = np.concatenate([block.vertices() for block in space.obstacles]), ends[first]
    reach = SPLINTER_TOL * space.scale
    distance, _ = cKDTree(vertices).query(points, distance_upper_bound=reach)
    near = np.flatnonzero(distance <= reach)
    same = cKDTree(points[near]).query_pairs(_ONE_POINT * space.scale, output_type="ndarray")
    place = np.full(len(points), -1)
    place[near] = component_labels(same, len(near))
    place = place[copy]
    bends = (place >= 0).nonzero()[0]
    # Two ends at one place are linked by a leaf that both are of.
    count = len(bends)
    keys = (place[bends, None] * graph.leaf_count + graph.ends[bends >> 1]).ravel()
    _, key = np.unique(keys, return_inverse=True)
    links = np.column_stack([np.arange(2 * count) >> 1, count + key.ravel()])
    labels = component_labels(links, count + int(key.max(initial=-1)) + 1)[:count]
    number[bends] = labels
    # The first end of each corner is written last.
    corner = np.zeros(int(labels.max(initial=-1)) + 1, dtype=np.int64)
    corner[labels[::-1]] = bends[::-1]
    return number, corner
