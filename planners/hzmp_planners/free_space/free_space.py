"""The free space of a point (the body's centre) as a union of convex leaves."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array

from hzmp_planners._arrays import Bools, Floats, Ints, as_floats, as_point, as_points, frozen
from hzmp_planners._ragged import counts_of, reduced, spans, starts_of
from hzmp_planners.constants import MEMBERSHIP_TOL, PLANE_TOL
from hzmp_planners.errors import ShapeError
from hzmp_planners.free_space.complexes import Complex
from hzmp_planners.free_space.cover import Cover, build_door_graph, maximal_cover
from hzmp_planners.free_space.export import to_networkx, write_graphml, write_leaves
from hzmp_planners.free_space.halfspaces import (
    Halfspaces,
    leaf_halfspaces,
    update_halfspaces,
)
from hzmp_planners.free_space.leaf_graph import LeafGraph
from hzmp_planners.free_space.shared_faces import build_leaf_graph, update_leaf_graph
from hzmp_planners.free_space.storage import load_parts, save_space
from hzmp_planners.free_space.trace import trace
from hzmp_planners.free_space.world import (
    World,
    add_obstacles,
    build_world,
    remove_obstacles,
    reorder_obstacles,
)
from hzmp_planners.sets import HybridZonotope, Polytope

if TYPE_CHECKING:
    import networkx as nx

_FEW_POINTS = 8192  # are located at a time: their arrays fit into the cache


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """Workspace box minus the interiors of convex obstacles, as leaves with disjoint interiors.

    Build one with `FreeSpace.decompose`; follow obstacles that move with `with_obstacles`.
    """

    bounds: tuple[Floats, Floats]
    """Corners (lo, hi) of the workspace [m], each (n,)."""
    obstacles: tuple[Polytope, ...]
    """The obstacles that have an interior."""
    _world: World = field(repr=False)
    _cover: Cover | None = field(default=None, repr=False)

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
        scale = float(np.abs([lo, hi]).max())
        solid = _solid(obstacles, lo.size, scale)
        return cls((lo, hi), solid, build_world(lo, hi, solid, scale))

    def with_obstacles(
        self, moved: Iterable[Polytope] | Mapping[int, Polytope | None]
    ) -> FreeSpace:
        """The free space when obstacles come, move or go; this one stays as it is.

        Only the leaves that such obstacles touch are cut anew; the others and their shared faces
        are taken over. Called again and again on the space of the static obstacles, with where the
        moving ones are now, it does not wear that space out. With numbers, the space without those
        obstacles is built once and kept for the next call that moves the same ones.

        Args:
            moved: obstacles in addition to those of this space; or the new shape of some of its
                `obstacles` by their number, None for one that is gone.

        Raises:
            ShapeError: an obstacle of another dimension, or a number that no obstacle has.
        """
        if not self.disjoint:
            return self._alone.with_obstacles(moved).overlapping()
        if isinstance(moved, Mapping):
            return self._with_moved(dict(cast("Mapping[int, Polytope | None]", moved)))
        return self._with_more(_solid(moved, self.n, self.scale))

    def _with_moved(self, moved: dict[int, Polytope | None]) -> FreeSpace:
        for number in moved:
            if not isinstance(number, int | np.integer) or not 0 <= number < len(self.obstacles):
                raise ShapeError(
                    f"obstacles are numbered from 0 to {len(self.obstacles) - 1}, got {number!r}"
                )
        rest = self._without(frozenset(moved))
        shapes = {
            number: block
            for number in sorted(moved)
            if (shape := moved[number]) is not None
            for block in _solid([shape], self.n, self.scale, number)
        }
        grown = rest._with_more(tuple(shapes.values()))
        # Moved obstacles keep their places among the others.
        places = np.array([i for i in range(len(self.obstacles)) if i not in moved] + list(shapes))
        order = places.argsort(kind="stable")
        obstacles = tuple(grown.obstacles[i] for i in order.tolist())
        again = FreeSpace(self.bounds, obstacles, reorder_obstacles(grown._world, order))
        return again._knowing(grown.graph, grown.halfspaces)

    def overlapping(self) -> FreeSpace:
        """The same free space as maximal leaves that overlap: fewer and larger ones.

        Each leaf is grown until obstacles or the workspace stop it, and those that the others make
        superfluous are dropped. Its graph has the doors between leaves that overlap or touch;
        plans in it have fewer segments, and room to cut corners.
        """
        if not self.disjoint:
            return self
        made = FreeSpace(self.bounds, self.obstacles, self._world, maximal_cover(self))
        vars(made)["_alone"] = self
        return made

    @property
    def disjoint(self) -> bool:
        """Whether the interiors of the leaves are disjoint: not after `overlapping`."""
        return self._cover is None

    @cached_property
    def _alone(self) -> FreeSpace:
        """The same space with disjoint leaves."""
        return self if self.disjoint else FreeSpace(self.bounds, self.obstacles, self._world)

    @property
    def _complex(self) -> Complex:
        return self._world.leaves if self._cover is None else self._cover.leaves

    def save(self, path: str | PathLike[str]) -> None:
        """Write the space with its leaf graph to an npz file, so that it is decomposed once.

        Raises:
            OSError: the file cannot be written; an old one of that name stays as it was.
        """
        save_space(self, path)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> FreeSpace:
        """The space that `save` wrote: the same leaves in the same order.

        Raises:
            OSError: the file cannot be read.
            ShapeError: it is not a saved free space.
        """
        parts = load_parts(path)
        graph = parts.pop("graph")
        return cls(**parts)._knowing(graph)

    def write_leaves(self, path: str | PathLike[str]) -> None:
        """Write all leaves as plain arrays (npz), for programs that know nothing of this one.

        A, b, halfspace_starts: leaf i is {x : A[r] x <= b[r]} for the rows r from
        halfspace_starts[i] up to halfspace_starts[i+1]; vertices, vertex_starts: its corners,
        likewise; face_leaves (F, 2), face_vertices (F, k, n), of which face_sizes (F,) count;
        bounds (2, n). Lengths are in metres.
        """
        write_leaves(self, path)

    def to_networkx(self) -> nx.Graph[int]:
        """The leaf graph for networkx and its algorithms.

        Nodes are numbers of leaves, with a point of it (x, y, z) [m] and its volume [m^n]; edges
        have the number of the shared face, its middle (x, y, z) [m] and its size [m^(n-1)].
        """
        return to_networkx(self)

    def write_graphml(self, path: str | PathLike[str]) -> None:
        """Write the leaf graph of `to_networkx` as GraphML, for Gephi, yEd and others."""
        write_graphml(self, path)

    def plot(
        self,
        ax: Any = None,
        *,
        explode: float = 0.0,
        faces: bool = False,
        labels: bool = False,
        alpha: float | None = None,
    ) -> Any:
        """Draw leaves and obstacles on matplotlib axes: see `plot_leaves` of `free_space.plot`."""
        from hzmp_planners.free_space.plot import plot_leaves

        return plot_leaves(self, ax, explode=explode, faces=faces, labels=labels, alpha=alpha)

    @cached_property
    def _compact(self) -> Complex:
        """The leaves on the vertices they have: an update leaves some behind that none has."""
        return self._complex.compact()

    def _with_more(self, more: tuple[Polytope, ...]) -> FreeSpace:
        if not more:
            return self
        world, number = add_obstacles(self._world, more)
        grown = FreeSpace(self.bounds, self.obstacles + more, world)
        where = number, world.leaves, world.table, self.scale
        graph = update_leaf_graph(self.graph, *where)
        return grown._knowing(graph, update_halfspaces(self.halfspaces, *where))

    def _knowing(self, graph: LeafGraph, halfspaces: Halfspaces | None = None) -> FreeSpace:
        """This space, whose leaf graph and half-spaces were found on another way."""
        vars(self)["graph"] = graph
        if halfspaces is not None:
            vars(self)["halfspaces"] = halfspaces
        return self

    def _without(self, gone: frozenset[int]) -> FreeSpace:
        known = self._rests.get(gone)
        if known is None:
            rest = [block for i, block in enumerate(self.obstacles) if i not in gone]
            rows = np.array(sorted(gone), dtype=np.int64)
            world = remove_obstacles(self._world, rows) if gone else self._world
            known = FreeSpace(self.bounds, tuple(rest), world)
            self._rests.clear()
            self._rests[gone] = known
        return known

    @cached_property
    def _rests(self) -> dict[frozenset[int], FreeSpace]:
        """The space without some of the obstacles, for those that moved last."""
        return {}

    @property
    def n(self) -> int:
        """Dimension, 2 or 3."""
        return int(self.bounds[0].size)

    @property
    def scale(self) -> float:
        """Largest absolute coordinate of the workspace [m]: unit of the tolerances."""
        return self._world.scale

    @property
    def vertices(self) -> Floats:
        """Distinct vertices of all leaves, shape (nv, n) [m]."""
        return self._compact.vertices

    @cached_property
    def incidence(self) -> csc_array[np.bool_]:
        """Sparse bool (nv, N): column i marks the vertices of leaf i."""
        rows, starts = self._compact.members
        shape = (len(self.vertices), len(self))
        data = frozen(np.ones(rows.size, dtype=np.bool_))
        return csc_array((data, frozen(rows), frozen(starts)), shape=shape)

    def __len__(self) -> int:
        """Number of leaves."""
        return len(self._complex)

    def leaf(self, index: int) -> Polytope:
        """One of the leaves, in the order of the columns of `incidence`."""
        known = self._leaves.get(index)
        if known is None:
            A, b, facets = self.halfspaces
            starts = self._complex.members[1]
            known = Polytope.from_both_forms(
                A[facets[index] : facets[index + 1]],
                b[facets[index] : facets[index + 1]],
                self._complex.corners[starts[index] : starts[index + 1]],
            )
            self._leaves[index] = known
        return known

    @cached_property
    def _leaves(self) -> dict[int, Polytope]:
        return {}

    @cached_property
    def leaves(self) -> tuple[Polytope, ...]:
        """The convex leaves, in the order of the columns of `incidence`."""
        return tuple(self.leaf(index) for index in range(len(self)))

    @property
    def leaf_boxes(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates of each leaf, shape (N, n) each [m]."""
        return self._complex.bounds

    @cached_property
    def obstacle_boxes(self) -> tuple[tuple[Floats, Floats], ...]:
        """Axis-aligned bounds (lo, hi) of each obstacle [m]."""
        return tuple(block.interval_hull() for block in self.obstacles)

    @cached_property
    def graph(self) -> LeafGraph:
        """Leaves and their shared faces."""
        if self._cover is None:
            graph = build_leaf_graph(self._world.leaves, self._world.table, self.scale)
        else:
            graph = build_door_graph(self._cover, self.scale)
        # Computed now: what all queries share should not cost the first one its time.
        _ = graph.pairs, graph.components, self.halfspaces
        return graph

    def hybrid_zonotope(self) -> HybridZonotope:
        """The free space as one hybrid zonotope in the V-rep form (ng = 2 nv, nb = N)."""
        return HybridZonotope.from_vertices(self.vertices, self.incidence)

    @property
    def volume(self) -> float:
        """Volume (area in 2-D) of the union of the leaves [m^n]."""
        return math.fsum(leaf.volume() for leaf in self._alone.leaves)

    def contains(self, X: ArrayLike) -> Bools:
        """Which of the points (k, n) lie in a closed leaf, up to 1e-9 of the scale; (k,)."""
        return self.leaf_of(X) >= 0

    def leaf_of(self, X: ArrayLike) -> Ints:
        """The leaf that holds each of the points (k, n), -1 where none does; shape (k,).

        The cuts that made the leaves lead to it, without a look at the other leaves. On a shared
        face, up to 1e-9 of the scale, it is the leaf with the lowest index.
        """
        points = as_points(X, "X", self.n)
        rows, leaves = self._located(points)
        found = np.full(len(points), len(self))
        np.minimum.at(found, rows, leaves)
        return np.where(found < len(self), found, -1)

    def leaves_at(self, x: ArrayLike) -> Ints:
        """Indices of all leaves that contain the point x (n,): several on a shared face."""
        point = as_point(x, "x", self.n)
        pieces = self._world.tree.descend_from(point.tolist(), self._world.table, self._slack)
        if self._cover is not None:
            beside, starts = self._cover.beside, self._cover.beside_starts
            pieces = [j for i in pieces for j in beside[starts[i] : starts[i + 1]].tolist()]
        A, b, facets = self.halfspaces
        tol, found = MEMBERSHIP_TOL * self.scale, []
        for leaf in set(pieces):
            first, end = facets.item(leaf), facets.item(leaf + 1)
            if (A[first:end] @ point - b[first:end]).max() <= tol:
                found.append(leaf)
        return np.array(sorted(found), dtype=np.int64)

    @property
    def _slack(self) -> float:
        """How far beyond a cut a point may be that a leaf behind it holds [m].

        A cut of a merged leaf may run a little beside its facets.
        """
        return (MEMBERSHIP_TOL + 8.0 * PLANE_TOL) * self.scale

    def trace(self, polyline: ArrayLike) -> tuple[Floats, Ints] | None:
        """Follow a polyline (k, n) through the leaves.

        Returns:
            The polyline with a waypoint wherever it changes its leaf, shape (K+1, n) [m], and the
            leaf of each segment, shape (K,); None when a part of it is not free.
        """
        points = as_points(polyline, "polyline", self.n)
        return trace(self, points) if len(points) > 1 else None

    def _located(self, points: Floats) -> tuple[Ints, Ints]:
        """Pairs of a point and a leaf that contains it."""
        found = [
            self._located_few(points[start : start + _FEW_POINTS]) + np.array([[start], [0]])
            for start in range(0, max(1, len(points)), _FEW_POINTS)
        ]
        rows, leaves = np.concatenate(found, axis=1)
        return rows, leaves

    def _located_few(self, points: Floats) -> Ints:
        rows, leaves = self._world.tree.descend(points, self._world.table, self._slack)
        if self._cover is not None:
            counts = counts_of(self._cover.beside_starts)[leaves]
            rows, leaves = (
                rows.repeat(counts),
                self._cover.beside[spans(self._cover.beside_starts[leaves], counts)],
            )
        A, b, facets = self.halfspaces
        counts = counts_of(facets)[leaves]
        held = spans(facets[leaves], counts)
        heights = np.einsum("ij,ij->i", A[held], points[rows.repeat(counts)]) - b[held]
        inside = reduced(np.maximum, heights, starts_of(counts)) <= MEMBERSHIP_TOL * self.scale
        return np.stack([rows[inside], leaves[inside]])

    @cached_property
    def halfspaces(self) -> Halfspaces:
        """Half-spaces A x <= b of all leaves one after the other: A (m, n), b (m,), starts (N+1,).

        Leaf i has the rows from starts[i] up to starts[i+1]; normals are unit vectors.
        """
        table = self._world.table if self._cover is None else self._cover.table
        return leaf_halfspaces(self._complex, table, self.scale)


def _solid(
    obstacles: Iterable[Polytope], n: int, scale: float, first: int = 0
) -> tuple[Polytope, ...]:
    """The obstacles that have an interior."""
    solid = []
    for number, block in enumerate(obstacles, start=first):
        if block.n != n:
            raise ShapeError(f"obstacle {number} has dimension {block.n}, the bounds have {n}")
        points = block.vertices()
        if len(points) > n:
            depth = block.b - (points @ block.A.T).min(axis=0)
            if depth.min() > PLANE_TOL * scale:
                solid.append(block)
    return tuple(solid)
