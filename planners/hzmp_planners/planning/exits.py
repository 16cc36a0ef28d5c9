"""The shared faces of each leaf as plain lists, for searches that look at one leaf at a time."""

from __future__ import annotations

from functools import reduce

import numpy as np

from hzmp_planners.free_space import LeafGraph

Exit = tuple[
    int, int, float, float, float, float, float, float, float, float, float, float
]  # fmt: skip
"""A face as the way out of a leaf: face, leaf beyond, unit normal x, y, z and offset of its plane,
lowest x, y, z, highest x, y, z [m]. In the plane all z are 0."""


class Exits:
    """The ways out of each leaf, listed when a search first comes to it.

    Numbers that are used one by one are several times faster in lists than in arrays.
    """

    def __init__(self, graph: LeafGraph) -> None:
        self._graph = graph
        self._known: dict[int, list[Exit]] = {}
        corners = list(graph.corners.transpose(1, 0, 2))
        self._rows = np.zeros((len(graph), 10))  # an exit without its face and leaf
        self._rows[:, : graph.n] = graph.normals
        self._rows[:, 3] = graph.offsets
        self._rows[:, 4 : 4 + graph.n] = reduce(np.minimum, corners)
        self._rows[:, 7 : 7 + graph.n] = reduce(np.maximum, corners)

    def of(self, leaf: int) -> list[Exit]:
        """The ways out of a leaf."""
        known = self._known.get(leaf)
        if known is None:
            faces = self._graph.faces_at(leaf)
            beyond = self._graph.ends[faces].sum(axis=1) - leaf
            columns = faces.tolist(), beyond.tolist(), *self._rows[faces].T.tolist()
            known = self._known[leaf] = list(zip(*columns, strict=True))
        return known
