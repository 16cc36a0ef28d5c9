"""The leaves of a planar free space as plain lists, for searches that look at one leaf at a time.

Numbers that are used one by one are several times faster in lists than in arrays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._links import component_labels
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
    exits: list[list[Exit]] = [[] for _ in range(len(space))]
    left = np.column_stack([-graph.normals[:, 1], graph.normals[:, 0]])
    along = graph.corners[:, 0] - graph.corners[:, 1]
    rows = zip(
        graph.ends.tolist(),
        graph.corners.tolist(),
        number.reshape(-1, 2).tolist(),
        (np.einsum("fn,fn->f", along, left) > 0.0).tolist(),
        strict=True,
    )
    for face, ((i, j), (a, b), (a_number, b_number), a_is_left) in enumerate(rows):
        one, two = (a[0], a[1], a_number), (b[0], b[1], b_number)
        if not a_is_left:
            one, two = two, one
        exits[i].append((face, j, *one, *two))
        exits[j].append((face, i, *two, *one))
    corners = graph.corners.reshape(-1, 2)[first]
    return Mesh(exits, corners, graph.ends[first >> 1, 0], space.scale)


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
    vertices = np.concatenate([block.vertices() for block in space.obstacles])
    reach = SPLINTER_TOL * space.scale
    distance, _ = cKDTree(vertices).query(ends, distance_upper_bound=reach)
    bends = np.flatnonzero(distance <= reach)
    same = cKDTree(ends[bends]).query_pairs(_ONE_POINT * space.scale, output_type="ndarray")
    place = component_labels(same, len(bends))
    keys = (place[:, None] * graph.leaf_count + graph.ends[bends >> 1]).ravel()
    _, key = np.unique(keys, return_inverse=True)
    count = len(bends)
    links = np.column_stack([np.repeat(np.arange(count), 2), count + key.ravel()])
    labels = component_labels(links, count + int(key.max(initial=-1)) + 1)[:count]
    _, first, label = np.unique(labels, return_index=True, return_inverse=True)
    number[bends] = label.ravel()
    return number, bends[first]
