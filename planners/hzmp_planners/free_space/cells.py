"""Many convex cells in a few arrays, each cut by a plane of its own at the same time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import extents, owners_of, reduced, starts_of

UNNAMED = -1
"""Label of a facet that stands for no half-space."""


@dataclass(frozen=True, eq=False)
class Cells(ABC):
    """Convex cells with labelled facets: `Polygons` in 2-D, `Polyhedra` in 3-D.

    All their vertices lie end to end in one array, and so do their facets.
    """

    vertices: Floats
    """Shape (nv, n) [m]."""
    vertex_starts: Ints
    """Cell i owns the vertices from [i] to [i + 1], shape (m + 1,)."""
    facets: Ints
    """Labels, mostly codes of half-spaces (see `PlaneTable`), shape (nf,)."""
    facet_starts: Ints
    """Cell i owns the facets from [i] to [i + 1], shape (m + 1,)."""

    def __len__(self) -> int:
        return len(self.vertex_starts) - 1

    @cached_property
    def vertex_owner(self) -> Ints:
        """The cell of each vertex."""
        return owners_of(self.vertex_starts)

    @cached_property
    def facet_owner(self) -> Ints:
        """The cell of each facet."""
        return owners_of(self.facet_starts)

    @cached_property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates of each cell, shape (m, n) each [m]."""
        low = reduced(np.minimum, self.vertices, self.vertex_starts)
        return low, reduced(np.maximum, self.vertices, self.vertex_starts)

    @abstractmethod
    def incidence(self) -> tuple[Ints, Ints, Ints]:
        """Every vertex on a facet: lists of (cell, facet label, vertex), with repetitions."""

    @abstractmethod
    def take(self, rows: Ints) -> Self:
        """Some of the cells, in the given order."""

    @abstractmethod
    def relabelled(self, facets: Ints) -> Self:
        """The same cells with other labels."""

    def moved(self, vertices: Floats) -> Self:
        """The same cells with their vertices elsewhere."""
        return replace(self, vertices=vertices)

    @abstractmethod
    def joined(self, others: Sequence[Cells]) -> Self:
        """These cells, then others of the same kind."""

    @abstractmethod
    def divide(
        self, labels: Ints, normals: Floats, offsets: Floats, tol: float, wanted: Bools
    ) -> tuple[Self, Ints, Ints]:
        """Cut each cell by its own plane, and keep the wanted sides.

        A cell with vertices strictly on one side only stays whole.

        Args:
            labels: of the new facets, (below, above) for each cell, shape (m, 2).
            normals: unit normal of each cell's plane, shape (m, n).
            offsets: normal . x on it [m], shape (m,).
            tol: vertices within this distance lie on the plane [m].
            wanted: which sides to keep, below (a.x <= b) and above, shape (m, 2).

        Returns:
            The parts, ordered by cell, the lower one first; the cell of each and its side (0, 1).
        """


@dataclass(frozen=True, eq=False)
class Sides:
    """Where cells lie about their planes. Side 0 is below; part 2 * cell + side."""

    heights: Floats
    """Of each vertex above its cell's plane [m]."""
    below: Bools
    """Vertices strictly below; all of them in a cell that stays whole there."""
    above: Bools
    cut: Bools
    """Cells with vertices strictly on both sides."""
    kept: Ints
    """The parts that are wanted and not empty."""
    number: Ints
    """Place of each part among the kept ones; their count for the others: sorted last, dropped."""

    active: tuple[int, ...]
    """The sides that are wanted at all."""

    @property
    def count(self) -> int:
        """How many parts are kept."""
        return len(self.kept)


def sides_of(cells: Cells, normals: Floats, offsets: Floats, tol: float, wanted: Bools) -> Sides:
    """Sort vertices and cells by the side of their plane; arguments as for `Cells.divide`."""
    owner, starts = cells.vertex_owner, cells.vertex_starts
    heights = np.einsum("ij,ij->i", cells.vertices, normals.take(owner, axis=0))
    heights -= offsets.take(owner)
    below, above = heights < -tol, heights > tol
    has_below = np.logical_or.reduceat(below, starts[:-1]) if len(cells) else below
    has_above = np.logical_or.reduceat(above, starts[:-1]) if len(cells) else above
    cut = has_below & has_above
    if not cut.all():
        in_cut = cut.take(owner)
        below = np.where(in_cut, below, has_below.take(owner))
        above = np.where(in_cut, above, has_above.take(owner))
    present = np.empty((len(cut), 2), dtype=np.bool_)
    present[:, 0], present[:, 1] = has_below, has_above
    present &= wanted
    active = tuple(side for side in (0, 1) if wanted[:, side].any())
    kept = present.ravel().nonzero()[0]
    number = np.full(present.size, len(kept))
    number[kept] = np.arange(len(kept))
    return Sides(heights, below, above, cut, kept, number, active)


def crossing_points(
    vertices: Floats, heights: Floats, tail: Ints, head: Ints, upward: Bools
) -> Floats:
    """Where edges meet their plane, shape (k, n) [m].

    Computed from below to above, so that an edge gives the same point in every cell that has it.
    """
    low, high = np.where(upward, tail, head), np.where(upward, head, tail)
    fall, rise = heights.take(low), heights.take(high)
    t = (fall / (fall - rise))[:, None]
    return np.asarray(vertices.take(low, axis=0) * (1.0 - t) + vertices.take(high, axis=0) * t)


def join_cells(batches: Sequence[Cells]) -> Cells:
    """Several batches of one kind as one."""
    return batches[0].joined(batches[1:]) if len(batches) > 1 else batches[0]


def clip(
    cells: Cells, A: Floats, b: Floats, labels: Ints, starts: Ints, tol: float
) -> tuple[Cells, Ints]:
    """The part of each cell inside its own list of half-spaces a.x <= b.

    Args:
        cells: m cells.
        A: outward unit normals of all lists, end to end, shape (k, n).
        b: offsets [m], shape (k,).
        labels: of the facets that the half-spaces leave, shape (k,).
        starts: cell i is clipped by those from starts[i] to starts[i + 1], shape (m + 1,).
        tol: a part within this distance of one of the planes [m] is empty.

    Returns:
        The parts that are not empty, and the cells that they are of.
    """
    # Most half-spaces have all of their cell inside, and some all of it outside.
    owner = owners_of(starts)
    lowest, highest = extents(cells.vertices, cells.vertex_starts, owner, A)
    gone = np.zeros(len(cells), dtype=np.bool_)
    gone[owner[lowest >= b - tol]] = True
    row = ((highest > b + tol) & ~gone[owner]).nonzero()[0]
    counts = np.bincount(owner[row], minlength=len(cells))
    starts = starts_of(counts)
    origin = np.arange(len(cells))
    if gone.any():
        origin = (~gone).nonzero()[0]
        cells = cells.take(origin)
    for k in range(int(counts.max(initial=0))):
        if not len(origin):
            break
        busy = counts[origin] > k
        next_ = row[np.where(busy, starts[origin] + k, 0)]
        # Cells whose list has ended see a plane far above them.
        offsets = np.where(busy, b[next_], np.inf)
        wanted = np.zeros((len(origin), 2), dtype=np.bool_)
        wanted[:, 0] = True
        names = labels[next_].repeat(2).reshape(-1, 2)
        cells, parent, _ = cells.divide(names, A[next_], offsets, tol, wanted)
        origin = origin[parent]
    return cells, origin
