"""Obstacles of a world as lists of half-spaces, and what they have in common with cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ragged import counts_of, spans, starts_of
from hzmp_planners.free_space.box_pairs import are_boxes, common_boxes
from hzmp_planners.free_space.boxes import overlapping_bounds
from hzmp_planners.free_space.cells import Cells, clip, join_cells
from hzmp_planners.free_space.planes import PlaneTable
from hzmp_planners.sets import Polytope


@dataclass(frozen=True, eq=False)
class Blocks:
    """The obstacles of a world as lists of half-spaces."""

    codes: Ints
    """Half-spaces of all obstacles, end to end."""
    starts: Ints
    """Shape (m + 1,)."""
    lows: Floats
    """Lowest coordinates of each obstacle, shape (m, n) [m]."""
    highs: Floats
    """Highest coordinates of each obstacle, shape (m, n) [m]."""

    def __len__(self) -> int:
        return len(self.lows)

    def take(self, rows: Ints) -> Blocks:
        """Some of the obstacles, in the given order."""
        counts = counts_of(self.starts)[rows]
        codes = self.codes[spans(self.starts[rows], counts)]
        return Blocks(codes, starts_of(counts), self.lows[rows], self.highs[rows])

    def joined(self, other: Blocks) -> Blocks:
        """These obstacles, then the others."""
        return Blocks(
            np.concatenate([self.codes, other.codes]),
            np.concatenate([self.starts, other.starts[1:] + self.starts[-1]]),
            np.concatenate([self.lows, other.lows]),
            np.concatenate([self.highs, other.highs]),
        )

    def near(self, lows: Floats, highs: Floats, tol: float) -> tuple[Ints, Ints]:
        """Pairs (cell, obstacle) whose bounds overlap by more than the tolerance."""
        return overlapping_bounds(lows, highs, self.lows, self.highs, tol)

    def common(
        self, cells: Cells, cell: Ints, block: Ints, table: PlaneTable, tol: float
    ) -> tuple[Cells, Ints, Ints]:
        """What pairs of a cell and an obstacle have in common, and which two each part is of."""
        chosen = self.take(block)
        A, b = table.halfspaces(chosen.codes)
        parts, origin = clip(cells.take(cell), A, b, chosen.codes, chosen.starts, tol)
        return parts, cell[origin], block[origin]


def blocks_of(
    table: PlaneTable, obstacles: Sequence[Polytope], A: Floats, b: Floats
) -> tuple[PlaneTable, Ints, Blocks]:
    """Half-spaces A x <= b, then obstacles, in terms of a table that has their planes too."""
    normals = np.concatenate([A, *(block.A for block in obstacles)])
    offsets = np.concatenate([b, *(block.b for block in obstacles)])
    table, codes = table.extended(normals, offsets)
    hulls = [block.interval_hull() for block in obstacles]
    bounds = np.array(hulls).reshape(-1, 2, A.shape[1])
    starts = starts_of(np.array([len(block.b) for block in obstacles], dtype=np.int64))
    blocks = Blocks(codes[len(b) :], starts, bounds[:, 0], bounds[:, 1])
    return table, codes[: len(b)], blocks


def facet_corners(obstacles: Sequence[Polytope]) -> tuple[Floats, Ints]:
    """Corners of the facets of all obstacles, end to end, and where those of each facet begin [m].

    A half-space that bounds no facet gets all corners.
    """
    corners, counts = [], []
    for block in obstacles:
        on = block.incidence.T
        on = on | (on.sum(axis=1) < block.n)[:, None]
        corners.append(block.vertices()[on.nonzero()[1]])
        counts.append(on.sum(axis=1))
    return np.concatenate(corners), starts_of(np.concatenate(counts))


def common_parts(
    cells: Cells, cell: Ints, block: Ints, blocks: Blocks, table: PlaneTable, tol: float
) -> tuple[Cells, Ints, Ints]:
    """`Blocks.common` for cells whose facets are half-spaces; two boxes are not clipped."""
    plain = are_boxes(cells.facets, cells.facet_starts, table)[cell]
    plain &= are_boxes(blocks.codes, blocks.starts, table)[block]
    quick, slow = plain.nonzero()[0], (~plain).nonzero()[0]
    boxes, rows = common_boxes(
        cells, cell[quick], blocks.codes, blocks.starts, block[quick], table, tol
    )
    homes, obstacles = cell[quick[rows]], block[quick[rows]]
    if not len(slow):
        return boxes, homes, obstacles
    others, *of = blocks.common(cells, cell[slow], block[slow], table, tol)
    return (
        join_cells([boxes, others]),
        np.concatenate([homes, of[0]]),
        np.concatenate([obstacles, of[1]]),
    )
