"""Shared faces of leaves: the doors that a path may use from one leaf to the next."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hzmp_planners._arrays import Floats, Ints, frozen
from hzmp_planners._links import component_labels
from hzmp_planners.constants import FACE_TOL
from hzmp_planners.free_space.merge import Complex
from hzmp_planners.free_space.planes import PlaneTable


@dataclass(frozen=True, eq=False)
class SharedFace:
    """Common (n-1)-dimensional piece of two leaves' boundaries: Z_i and Z_j in contact.

    Corollary 3.4 of the HZ-MP paper obtains it as the generalised intersection of the two leaves;
    here it is the overlap of two facets on one plane, which is the same set.
    """

    leaves: tuple[int, int]
    vertices: Floats
    """Shape (k, n) [m]: a segment's ends in 2-D, a convex polygon in order in 3-D."""
    normal: Floats
    """Unit normal of the plane, from leaves[0] into leaves[1], shape (n,)."""
    offset: float
    """normal . x on the plane [m]."""


@dataclass(frozen=True, eq=False)
class LeafGraph:
    """Leaves as nodes, shared faces as edges."""

    n: int
    """Dimension of the space."""
    leaf_count: int
    faces: tuple[SharedFace, ...]

    @cached_property
    def ends(self) -> Ints:
        """Leaves on both sides of each face, shape (F, 2)."""
        pairs = [face.leaves for face in self.faces]
        return frozen(np.array(pairs, dtype=np.int64).reshape(-1, 2))

    @cached_property
    def corners(self) -> Floats:
        """Vertices of all faces, shape (F, k, n) [m]; short faces repeat their last vertex."""
        if not self.faces:
            return frozen(np.zeros((0, self.n, self.n)))
        width = max(len(face.vertices) for face in self.faces)
        rows = [
            face.vertices[np.minimum(np.arange(width), len(face.vertices) - 1)]
            for face in self.faces
        ]
        return frozen(np.array(rows))

    @cached_property
    def pairs(self) -> Ints:
        """Pairs of faces of one leaf, shape (E, 3): face, face, leaf."""
        rows = []
        for leaf, faces in enumerate(self.faces_of):
            i, j = np.triu_indices(len(faces), 1)
            rows.append(np.column_stack([faces[i], faces[j], np.full(len(i), leaf)]))
        return frozen(np.concatenate(rows) if rows else np.zeros((0, 3), dtype=np.int64))

    @cached_property
    def faces_of(self) -> tuple[Ints, ...]:
        """Indices of the faces of each leaf."""
        lists: list[list[int]] = [[] for _ in range(self.leaf_count)]
        for index, face in enumerate(self.faces):
            for leaf in face.leaves:
                lists[leaf].append(index)
        return tuple(frozen(np.array(faces, dtype=np.int64)) for faces in lists)

    @cached_property
    def components(self) -> Ints:
        """Connected component of each leaf, shape (N,); two components have no path between."""
        return frozen(component_labels(self.ends, self.leaf_count))


def build_leaf_graph(complex_: Complex, table: PlaneTable, scale: float) -> LeafGraph:
    """Overlay the facets that leaves have on each plane, those below against those above."""
    sides: dict[int, tuple[list[tuple[int, frozenset[int]]], ...]] = defaultdict(lambda: ([], []))
    for number, leaf in enumerate(complex_.leaves):
        for (plane, side), held in leaf.items():
            sides[plane][0 if side > 0 else 1].append((number, held))
    tol = FACE_TOL * scale
    faces: list[SharedFace] = []
    for plane in sorted(sides):
        below, above = sides[plane]
        if not below or not above:
            continue
        normal, offset = table.normals[plane], float(table.offsets[plane])
        overlay = _Overlay(complex_.vertices, normal, tol)
        for i, j, corners in overlay.overlaps(below, above):
            faces.append(SharedFace((i, j), frozen(corners), normal, offset))
    n = complex_.vertices.shape[1]
    return LeafGraph(n, len(complex_.leaves), tuple(faces))


class _Overlay:
    """Intersections of convex facets that lie in one plane, in the plane's own coordinates."""

    def __init__(self, vertices: Floats, normal: Floats, tol: float) -> None:
        self._vertices = vertices
        self._tol = tol
        # Coordinates without the normal's largest axis: an affine chart of the plane.
        self._dropped = int(np.abs(normal).argmax())
        self._chart = [axis for axis in range(normal.size) if axis != self._dropped]
        self._normal = normal

    def overlaps(
        self, below: list[tuple[int, frozenset[int]]], above: list[tuple[int, frozenset[int]]]
    ) -> list[tuple[int, int, Floats]]:
        """(leaf below, leaf above, corners) of every overlap that is wider than the tolerance."""
        low, high = [self._polygon(h) for _, h in below], [self._polygon(h) for _, h in above]
        low_min, low_max = _boxes(low, self._chart)
        high_min, high_max = _boxes(high, self._chart)
        meet = (low_min[:, None] < high_max[None] - self._tol).all(axis=2)
        meet &= (high_min[None] < low_max[:, None] - self._tol).all(axis=2)
        found = []
        for i, j in np.argwhere(meet).tolist():
            same = below[i][1] == above[j][1]
            corners = low[i] if same else self._intersection(low[i], high[j])
            if corners is not None and self._wide(corners):
                found.append((below[i][0], above[j][0], corners))
        return found

    def _polygon(self, held: frozenset[int]) -> Floats:
        """Vertices of a facet in counter-clockwise order of the chart."""
        points = self._vertices[sorted(held)]
        if len(self._chart) == 1:
            return points[np.argsort(points[:, self._chart[0]])]
        flat = points[:, self._chart]
        offset = flat - flat.mean(axis=0)
        return points[np.argsort(np.arctan2(offset[:, 1], offset[:, 0]))]

    def _intersection(self, one: Floats, two: Floats) -> Floats | None:
        if len(self._chart) == 1:
            axis = self._chart[0]
            start = max(one[0], two[0], key=lambda p: float(p[axis]))
            end = min(one[-1], two[-1], key=lambda p: float(p[axis]))
            return np.array([start, end]) if start[axis] < end[axis] else None
        u, v = self._chart
        corners = [tuple(p) for p in one.tolist()]
        edges = two[:, self._chart].tolist()
        for (ax, ay), (bx, by) in zip(edges, edges[1:] + edges[:1], strict=True):
            dx, dy = bx - ax, by - ay
            length = (dx * dx + dy * dy) ** 0.5
            if length == 0.0:
                continue
            dx, dy = dx / length, dy / length
            height = [dx * (p[v] - ay) - dy * (p[u] - ax) for p in corners]
            corners = _clip(corners, height, 0.1 * self._tol)
            if len(corners) < 3:
                return None
        return np.array(corners)

    def _wide(self, corners: Floats) -> bool:
        """Whether the face has room: its smallest width exceeds the tolerance."""
        if len(self._chart) == 1:
            return float(np.linalg.norm(corners[1] - corners[0])) > self._tol
        if len(corners) < 3:
            return False
        edges = np.roll(corners, -1, axis=0) - corners
        lengths = np.linalg.norm(edges, axis=1)
        long = lengths > 0.0
        inward = np.cross(self._normal, edges[long] / lengths[long, None])
        reach = (corners @ inward.T) - np.einsum("ij,ij->i", corners[long], inward)
        return float(np.abs(reach).max(axis=0).min()) > self._tol


def _boxes(polygons: list[Floats], chart: list[int]) -> tuple[Floats, Floats]:
    flat = [polygon[:, chart] for polygon in polygons]
    return np.array([p.min(axis=0) for p in flat]), np.array([p.max(axis=0) for p in flat])


def _clip(
    corners: list[tuple[float, ...]], height: list[float], tol: float
) -> list[tuple[float, ...]]:
    """The part of a convex polygon with height >= 0 (Sutherland and Hodgman 1974)."""
    if min(height) >= -tol:
        return corners
    kept: list[tuple[float, ...]] = []
    for i, (p, h) in enumerate(zip(corners, height, strict=True)):
        q, g = corners[i - 1], height[i - 1]
        if (h > tol and g < -tol) or (h < -tol and g > tol):
            t = g / (g - h)
            kept.append(tuple(a + t * (b - a) for a, b in zip(q, p, strict=True)))
        if h >= -tol:
            kept.append(p)
    return kept
