"""The shared faces of each leaf as plain lists, for searches that look at one leaf at a time."""

from __future__ import annotations

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

    def of(self, leaf: int) -> list[Exit]:
        """The ways out of a leaf."""
        known = self._known.get(leaf)
        if known is None:
            graph, faces = self._graph, self._graph.faces_at(leaf)
            ends = graph.ends.take(faces, axis=0)
            beyond = ends[:, 0] + ends[:, 1] - leaf
            corners = graph.corners.take(faces, axis=0)
            rows = np.zeros((10, len(faces)))  # exits without their faces and leaves
            rows[: graph.n] = graph.normals.take(faces, axis=0).T
            rows[3] = graph.offsets.take(faces)
            rows[4 : 4 + graph.n] = np.minimum.reduce(corners, axis=1).T
            rows[7 : 7 + graph.n] = np.maximum.reduce(corners, axis=1).T
            columns = faces.tolist(), beyond.tolist(), *rows.tolist()
            known = self._known[leaf] = list(zip(*columns, strict=True))
        return known
