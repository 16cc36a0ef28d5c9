"""The free space of a point (the body's centre) as a union of convex leaves."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array

from hzmp_planners._arrays import Bools, Floats, Ints, as_floats, as_point, as_points, frozen
from hzmp_planners.constants import MEMBERSHIP_TOL
from hzmp_planners.errors import ShapeError
from hzmp_planners.free_space.decompose import box_cell, subtract_obstacles
from hzmp_planners.free_space.leaf_graph import LeafGraph, build_leaf_graph
from hzmp_planners.free_space.merge import Complex, build_complex, merge_convex_unions
from hzmp_planners.free_space.planes import PlaneTable, build_plane_table
from hzmp_planners.sets import HybridZonotope, Polytope


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """Workspace box minus the interiors of convex obstacles, as leaves with disjoint interiors.

    Build one with `FreeSpace.decompose`.
    """

    bounds: tuple[Floats, Floats]
    """Corners (lo, hi) of the workspace [m], each (n,)."""
    obstacles: tuple[Polytope, ...]
    _complex: Complex
    _table: PlaneTable

    @classmethod
    def decompose(
        cls, bounds: tuple[ArrayLike, ArrayLike], obstacles: Iterable[Polytope] = ()
    ) -> FreeSpace:
        """Exact convex decomposition of a box minus convex obstacles, in 2-D or 3-D.

        Obstacles may touch, overlap, repeat, and stick out of the box. Obstacles without interior
        (flat or empty) remove nothing and are left out.

        Args:
            bounds: corners (lo, hi) of the box [m], each (n,) with n = 2 or 3.
            obstacles: polytopes of dimension n.

        Raises:
            ShapeError: wrong dimensions, lo >= hi, or an obstacle of another dimension.
        """
        lo, hi = as_floats(bounds[0], "bounds[0]", 1), as_floats(bounds[1], "bounds[1]", 1)
        if lo.shape != hi.shape or lo.size not in (2, 3):
            raise ShapeError(
                f"bounds must be two corners of 2 or 3 coordinates, got {lo.size} and {hi.size}"
            )
        if (lo >= hi).any():
            axis = int(np.argmax(lo - hi))
            raise ShapeError(
                f"bounds must have lo < hi, but axis {axis} runs from {lo[axis]} to {hi[axis]}"
            )
        blocks = tuple(obstacles)
        for number, block in enumerate(blocks):
            if block.n != lo.size:
                raise ShapeError(
                    f"obstacle {number} has dimension {block.n}, the bounds have {lo.size}"
                )
        scale = max(1.0, float(np.abs([lo, hi]).max()))
        solid = tuple(block for block in blocks if _has_interior(block))
        box = Polytope.from_box(lo, hi)
        table = build_plane_table([box, *solid], scale)
        workspace = box_cell(lo, hi, list(table.facets[0]))
        cells = subtract_obstacles(workspace, solid, table.facets[1:], table, scale)
        if cells:
            leaves = merge_convex_unions(build_complex(cells, scale), table, scale)
        else:
            leaves = Complex(np.zeros((0, lo.size)), ())
        return cls((lo, hi), solid, leaves, table)

    @property
    def n(self) -> int:
        """Dimension, 2 or 3."""
        return int(self.bounds[0].size)

    @property
    def scale(self) -> float:
        """Largest absolute coordinate of the workspace, at least 1 m: unit of the tolerances."""
        return max(1.0, float(np.abs(self.bounds).max()))

    @property
    def vertices(self) -> Floats:
        """Distinct vertices of all leaves, shape (nv, n) [m]."""
        return self._complex.vertices

    @cached_property
    def incidence(self) -> csc_array[np.bool_]:
        """Sparse bool (nv, N): column i marks the vertices of leaf i."""
        columns = [sorted(frozenset().union(*leaf.values())) for leaf in self._complex.leaves]
        pointers = np.concatenate([[0], np.cumsum([len(column) for column in columns])])
        rows = np.array([v for column in columns for v in column], dtype=np.int64)
        shape = (len(self.vertices), len(columns))
        data = frozen(np.ones(rows.size, dtype=np.bool_))
        return csc_array((data, frozen(rows), frozen(pointers.astype(np.int64))), shape=shape)

    @cached_property
    def leaves(self) -> tuple[Polytope, ...]:
        """The convex leaves, in the order of the columns of `incidence`."""
        A, b, starts = self._halfspaces
        pointers, rows = self.incidence.indptr, self.incidence.indices
        stops = [*starts.tolist(), len(b)][1:]
        return tuple(
            Polytope.from_both_forms(
                A[start:stop], b[start:stop], self.vertices[rows[pointers[i] : pointers[i + 1]]]
            )
            for i, (start, stop) in enumerate(zip(starts.tolist(), stops, strict=True))
        )

    @cached_property
    def obstacle_boxes(self) -> tuple[tuple[Floats, Floats], ...]:
        """Axis-aligned bounds (lo, hi) of each obstacle [m]."""
        return tuple(block.interval_hull() for block in self.obstacles)

    @cached_property
    def graph(self) -> LeafGraph:
        """Leaves and their shared faces."""
        graph = build_leaf_graph(self._complex, self._table, self.scale)
        # Computed now: what all queries share should not cost the first one its time.
        _ = graph.corners, graph.pairs, graph.components
        return graph

    def hybrid_zonotope(self) -> HybridZonotope:
        """The free space as one hybrid zonotope in the V-rep form (ng = 2 nv, nb = N)."""
        return HybridZonotope.from_vertices(self.vertices, self.incidence)

    @property
    def volume(self) -> float:
        """Total volume (area in 2-D) of the leaves [m^n]."""
        return math.fsum(leaf.volume() for leaf in self.leaves)

    def contains(self, X: ArrayLike) -> Bools:
        """Which of the points (k, n) lie in a closed leaf, up to 1e-9 m at unit scale; (k,)."""
        points = as_points(X, "X", self.n)
        inside = np.zeros(len(points), dtype=np.bool_)
        for start in range(0, len(points), 256):
            depth = self._violations(points[start : start + 256])
            inside[start : start + 256] = (depth <= MEMBERSHIP_TOL * self.scale).any(axis=1)
        return inside

    def leaves_at(self, x: ArrayLike) -> Ints:
        """Indices of all leaves that contain the point x (n,): several on a shared face."""
        depth = self._violations(as_point(x, "x", self.n)[None])[0]
        return np.flatnonzero(depth <= MEMBERSHIP_TOL * self.scale)

    def _violations(self, points: Floats) -> Floats:
        """How far each point is beyond the worst facet of each leaf [m], shape (k, N)."""
        A, b, starts = self._halfspaces
        if not starts.size:
            return np.zeros((len(points), 0))
        return np.asarray(np.maximum.reduceat(points @ A.T - b, starts, axis=1))

    @cached_property
    def _halfspaces(self) -> tuple[Floats, Floats, Ints]:
        """Facets of all leaves one after the other, and where each leaf's begin."""
        facets = [facet for leaf in self._complex.leaves for facet in leaf]
        planes = np.array([plane for plane, _ in facets], dtype=np.int64)
        sides = np.array([float(side) for _, side in facets])
        counts = [len(leaf) for leaf in self._complex.leaves]
        starts = np.cumsum([0, *counts])[:-1].astype(np.int64)
        A = self._table.normals[planes] * sides[:, None]
        return frozen(A), frozen(self._table.offsets[planes] * sides), starts


def _has_interior(block: Polytope) -> bool:
    return len(block.vertices()) > block.n and block.volume() > 0.0
