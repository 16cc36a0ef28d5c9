"""Finding the leaves that hold a point by the cuts that made them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.free_space.planes import PlaneTable


@dataclass(frozen=True, eq=False)
class CutTree:
    """Cuts as binary trees: where a point goes at each plane, and the piece that it ends in."""

    planes: Ints
    """Plane of each node, -1 at an end, shape (k,)."""
    children: Ints
    """Nodes below and above the plane, shape (k, 2); -1 for a part without interior."""
    pieces: Ints
    """The piece at each end, shape (k,): below 0 where nothing is free, and at cuts."""

    def renamed(self, number: Ints) -> CutTree:
        """The same cuts when piece i is called number[i] (-1: no longer there)."""
        pieces = self.pieces.copy()
        free = pieces >= 0
        pieces[free] = number[pieces[free]]
        return CutTree(self.planes, self.children, pieces)

    def grafted(self, ends: Ints, other: CutTree, roots: Ints) -> CutTree:
        """Continue at end nodes with trees of another forest: ends[i] with the tree roots[i]."""
        shift = len(self.planes)
        planes = np.concatenate([self.planes, other.planes])
        moved = np.where(other.children >= 0, other.children + shift, -1)
        children = np.concatenate([self.children, moved])
        pieces = np.concatenate([self.pieces, other.pieces])
        planes[ends], children[ends] = other.planes[roots], moved[roots]
        pieces[ends] = other.pieces[roots]
        return CutTree(planes, children, pieces)

    def descend(self, X: Floats, table: PlaneTable, tol: float) -> tuple[Ints, Ints]:
        """All pieces that points may be in; a point within `tol` of a cut goes both ways.

        Args:
            X: shape (k, n) [m].
            table: the planes.
            tol: [m].

        Returns:
            Rows of X and pieces, one entry for each pair.
        """
        point, node = np.arange(len(X)), np.zeros(len(X), dtype=np.int64)
        rows, found = [point[:0]], [node[:0]]
        while len(point):
            plane = self.planes[node]
            ended = plane < 0
            if ended.any():
                piece = self.pieces[node[ended]]
                rows.append(point[ended][piece >= 0])
                found.append(piece[piece >= 0])
                point, node, plane = point[~ended], node[~ended], plane[~ended]
            height = np.einsum("ij,ij->i", X[point], table.normals[plane]) - table.offsets[plane]
            below, above = height <= tol, height >= -tol
            children = self.children[node]
            point = np.concatenate([point[below], point[above]])
            node = np.concatenate([children[below, 0], children[above, 1]])
            point, node = point[node >= 0], node[node >= 0]
        return np.concatenate(rows), np.concatenate(found)

    def descend_from(self, x: list[float], table: PlaneTable, tol: float) -> list[int]:
        """All pieces that one point may be in: `descend`, number by number.

        Arrays of one entry cost ten times as much as the entry.
        """
        plane_of, piece_of, child_of = self.planes.item, self.pieces.item, self.children.item
        normal_of, offset_of = table.normals.item, table.offsets.item
        found: list[int] = []
        nodes = [0]
        while nodes:
            node = nodes.pop()
            plane = plane_of(node)
            if plane < 0:
                found.append(piece_of(node))
                continue
            height = -offset_of(plane)
            for axis, value in enumerate(x):
                height += value * normal_of(plane, axis)
            below, above = child_of(node, 0), child_of(node, 1)
            if height <= tol and below >= 0:
                nodes.append(below)
            if height >= -tol and above >= 0:
                nodes.append(above)
        return [piece for piece in found if piece >= 0]


class TreeBuilder:
    """Trees in the making; the roots are the first nodes."""

    def __init__(self, roots: int) -> None:
        self._size = roots
        self._cuts: list[tuple[Ints, Ints, Ints]] = []
        self._ends: list[tuple[Ints, Ints]] = []

    def cut(self, nodes: Ints, planes: Ints, parent: Ints, side: Ints) -> Ints:
        """Cut the pieces of some nodes; the new nodes of the parts that there are.

        Args:
            nodes: shape (m,).
            planes: of each cut, shape (m,).
            parent: the row of `nodes` that each part is of, shape (k,).
            side: 0 for the part below, 1 above, shape (k,).
        """
        fresh = self._size + np.arange(len(parent))
        self._size += len(parent)
        children = np.full((len(nodes), 2), -1)
        children[parent, side] = fresh
        self._cuts.append((nodes, planes, children))
        return fresh

    def end(self, nodes: Ints, pieces: Ints) -> None:
        """Name the pieces of nodes that are not cut any further."""
        self._ends.append((nodes, pieces))

    def build(self) -> CutTree:
        """The trees as they are now."""
        planes, pieces = np.full(self._size, -1), np.full(self._size, -1)
        children = np.full((self._size, 2), -1)
        for nodes, plane, below_above in self._cuts:
            planes[nodes], children[nodes] = plane, below_above
        for nodes, piece in self._ends:
            pieces[nodes] = piece
        return CutTree(planes, children, pieces)
