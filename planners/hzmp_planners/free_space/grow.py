"""Growing leaves into their neighbours while they stay convex and free."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ragged import counts_of, distinct, reduced, runs_of, spans, starts_of
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.free_space.boxes import along_axes, box_cell
from hzmp_planners.free_space.cells import UNNAMED, Cells, clip
from hzmp_planners.sets import Polytope

if TYPE_CHECKING:
    from hzmp_planners.free_space.free_space import FreeSpace

_TABLED = 1_000_000  # pairs of a facet and an obstacle that are held at a time


def grow_leaves(
    space: FreeSpace, leaves: Sequence[int], toward: Sequence[Sequence[int]]
) -> list[Polytope]:
    """Convex free polytopes that contain some leaves: see `grow_cells`."""
    cells, A, b = grow_cells(space, leaves, toward)
    return _polytopes(cells, A, b)


def grow_cells(
    space: FreeSpace, leaves: Sequence[int], toward: Sequence[Sequence[int]]
) -> tuple[Cells, Floats, Floats]:
    """Convex free cells that contain some leaves, pushed outward facet by facet.

    Each facet in turn is moved out until the polytope would meet an obstacle or the workspace
    wall: first the facets shared with the leaves in `toward`, then the others. The order decides
    the shape; every result is free. All leaves grow at the same time, each on its own.

    Args:
        space: the free space.
        leaves: their indices.
        toward: for each of them, neighbours to grow into first.

    Returns:
        The cells, one for each leaf; their facets are labelled with rows of the half-spaces
        A x <= b that come with them.
    """
    tol = PLANE_TOL * space.scale
    A, b, starts = _ordered_halfspaces(space, leaves, toward, tol)
    counts = counts_of(starts)
    width = max(1, int(counts.max(initial=1)) * len(space.obstacles))
    most = max(1, _TABLED // width)
    for first in range(0, len(counts), most):
        last = min(first + most, len(counts))
        rows = slice(starts[first], starts[last])
        _Growth(space, A[rows], b[rows], starts[first : last + 1] - starts[first], tol).run()
    lo, hi = space.bounds
    eye = np.eye(space.n)
    walls = len(b) + np.arange(2 * space.n)
    cells, _ = clip(box_cell(lo, hi, walls, len(counts)), A, b, np.arange(len(b)), starts, tol)
    return cells, np.concatenate([A, eye, -eye]), np.concatenate([b, hi, -lo])


class _Growth:
    """Polytopes A x <= b that grow, and where each obstacle's box lies about their facets.

    An obstacle behind a facet cannot be met by moving out another one. Most of the rest is decided
    by boxes: those of obstacles that are boxes are exact where no oblique facet cuts them.

    Args:
        space: the free space.
        A: unit normals of all polytopes, end to end, shape (m, n).
        b: offsets, shape (m,) [m]; they are changed.
        starts: where the half-spaces of each polytope begin.
        tol: nearer than this is not beyond [m].
    """

    def __init__(self, space: FreeSpace, A: Floats, b: Floats, starts: Ints, tol: float) -> None:
        self._space, self._A, self._b, self._starts, self._tol = space, A, b, starts, tol
        blocks, table = space._world.blocks, space._world.table
        lo, hi = space.bounds
        inside = np.asarray(((blocks.lows < hi - tol) & (blocks.highs > lo + tol)).all(axis=1))
        self._blocks = blocks.take(inside.nonzero()[0])
        middle, half = (
            (self._blocks.highs + sign * self._blocks.lows) / 2.0 for sign in (1.0, -1.0)
        )
        along, spread = A @ middle.T, np.abs(A) @ half.T
        self._low, self._high = along - spread, along + spread
        """Least and greatest height of each box along each normal, shape (m, obstacles) [m]."""
        self._level = along_axes(A)
        level = along_axes(table.normals)[self._blocks.codes >> 1].astype(np.float64)
        self._is_box = reduced(np.minimum, level, self._blocks.starts) > 0.0
        self._behind = self._low >= (b - tol)[:, None]
        self._cut = ~self._level[:, None] & (self._high > (b + tol)[:, None])
        if len(b):
            self._times_behind = np.add.reduceat(self._behind, starts[:-1], axis=0, dtype=np.int64)
            self._times_cut = np.add.reduceat(self._cut, starts[:-1], axis=0, dtype=np.int64)

    def run(self) -> None:
        """Move all facets out, the first of each polytope, then the second, and so on."""
        counts = counts_of(self._starts)
        for k in range(int(counts.max(initial=0)) if len(self._blocks) else 0):
            grown = (counts > k).nonzero()[0]
            facet = self._starts[grown] + k
            self._b[facet] = np.maximum(self._b[facet], self._reach(grown, facet))
            behind = self._low[facet] >= (self._b[facet] - self._tol)[:, None]
            cut = ~self._level[facet, None] & (
                self._high[facet] > (self._b[facet] + self._tol)[:, None]
            )
            self._times_behind[grown] += behind.astype(np.int64) - self._behind[facet]
            self._times_cut[grown] += cut.astype(np.int64) - self._cut[facet]
            self._behind[facet], self._cut[facet] = behind, cut
        if not len(self._blocks):
            self._b[:] = np.inf

    def _reach(self, grown: Ints, facet: Ints) -> Floats:
        """How far a facet of each polytope can move before it meets an obstacle [m]; inf: for good.

        A facet that nothing stops is given up: the others that grow after it count on that.
        """
        low, offsets = self._low[facet], self._b[facet, None]
        ahead = self._times_behind[grown] == self._behind[facet]
        ahead &= self._high[facet] > offsets + self._tol
        exact = self._level[facet, None] & self._is_box & (self._times_cut[grown] == 0)
        least = np.where(ahead, np.maximum(low, offsets), np.inf)
        reach = np.where(exact, least, np.inf).min(axis=1)
        doubtful = ~exact & (least < reach[:, None])
        rows = doubtful.any(axis=1).nonzero()[0]
        if len(rows):
            cell, block = doubtful[rows].nonzero()
            found = self._clipped_reach(grown[rows], facet[rows], cell, block)
            reach[rows] = np.minimum(reach[rows], found)
        return np.asarray(reach)

    def _clipped_reach(self, grown: Ints, facet: Ints, cell: Ints, block: Ints) -> Floats:
        """The same from what is beyond the facets, for pairs of one of them and an obstacle."""
        space, tol = self._space, self._tol
        counts = counts_of(self._starts)[grown]
        rows = spans(self._starts[grown], counts)
        turned = np.where(rows == facet.repeat(counts), -1.0, 1.0)
        A, b = self._A[rows] * turned[:, None], self._b[rows] * turned
        boxes = box_cell(*space.bounds, np.full(2 * space.n, UNNAMED), len(grown))
        beyond, origin = clip(boxes, A, b, rows, starts_of(counts), tol)
        place = np.full(len(grown), -1)
        place[origin] = np.arange(len(origin))
        left = (place[cell] >= 0).nonzero()[0]
        part, block = place[cell[left]], block[left]
        reach = np.full(len(grown), np.inf)
        common, part, _ = self._blocks.common(beyond, part, block, space._world.table, tol)
        if len(part):
            outward = self._A[facet[origin]]
            heights = np.einsum("ij,ij->i", common.vertices, outward[part[common.vertex_owner]])
            lowest = np.minimum.reduceat(heights, common.vertex_starts[:-1])
            np.minimum.at(reach, origin[part], lowest)
        return reach


def _ordered_halfspaces(
    space: FreeSpace, leaves: Sequence[int], toward: Sequence[Sequence[int]], tol: float
) -> tuple[Floats, Floats, Ints]:
    """The half-spaces of each leaf, those that separate it from leaves in `toward` first."""
    A, b, starts = space.halfspaces
    # Corners of these leaves only: a space that was just updated has no list of all.
    named = distinct(np.array([*leaves, *chain.from_iterable(toward)], dtype=np.int64))
    part = space._complex.take(named)
    ends = part.members[1].tolist()
    corners = {leaf: part.corners[ends[i] : ends[i + 1]] for i, leaf in enumerate(named.tolist())}
    found, counts = [], []
    for leaf, others in zip(leaves, toward, strict=True):
        first, end = starts.item(leaf), starts.item(leaf + 1)
        outside = b[first:end] - 2.0 * tol
        ahead = np.zeros(end - first, dtype=np.bool_)
        for other in others:
            ahead |= (corners[other] @ A[first:end].T >= outside).all(axis=0)
        found.append(first + (~ahead).argsort(kind="stable"))
        counts.append(end - first)
    rows = np.concatenate([np.zeros(0, dtype=np.int64), *found])
    return A[rows], b[rows], starts_of(np.array(counts, dtype=np.int64))


def _polytopes(cells: Cells, A: Floats, b: Floats) -> list[Polytope]:
    """Cells whose facets are labelled with rows of A x <= b, without facets that are too small."""
    n = A.shape[1]
    cell, row, vertex = cells.incidence()
    keys = distinct((cell * len(b) + row) * len(cells.vertices) + vertex) // len(cells.vertices)
    runs = runs_of(keys)
    facets = keys[runs[:-1][counts_of(runs) >= n]]
    found = []
    for i in range(len(cells)):
        rows = facets[facets // len(b) == i] % len(b)
        corners = slice(cells.vertex_starts[i], cells.vertex_starts[i + 1])
        found.append(Polytope.from_both_forms(A[rows], b[rows], cells.vertices[corners]))
    return found
