"""Cutting a few convex obstacles out of cells, without keeping what they have in common.

An update meets few cells, most of them with one obstacle. Heights of vertices tell which facets are
inside which cell, so only cells are cut; `partition` cuts what obstacles have of them as well, and
finds better cuts among many.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import counts_of, extents, reduced, runs_of, spans, starts_of
from hzmp_planners.free_space.cells import UNNAMED, Cells, join_cells
from hzmp_planners.free_space.cut_tree import TreeBuilder
from hzmp_planners.free_space.partition import Partition
from hzmp_planners.free_space.planes import PlaneTable


@dataclass(frozen=True, eq=False)
class Cuts:
    """Half-spaces of obstacles that may cut cells, ordered by cell, then by obstacle.

    An obstacle has entries in a cell as long as it may meet it.
    """

    cell: Ints
    """Shape (k,)."""
    obstacle: Ints
    """Shape (k,)."""
    facet: Ints
    """Its facet, shape (k,)."""
    code: Ints
    """The half-space behind that, shape (k,)."""
    open: Bools
    """False for planes that the cell has been cut along, shape (k,)."""
    late: Bools
    """Planes that pass through the cell, but not with their facet, shape (k,)."""

    @classmethod
    def between(
        cls, cells: Cells, cell: Ints, obstacle: Ints, facet: Ints, code: Ints, table: PlaneTable
    ) -> Cuts:
        """Those of obstacles that are not beyond a wall of their cell; the walls are no cuts."""
        width = 2 * len(table.offsets)
        walls = np.sort(cells.facet_owner * width + cells.facets)
        keys = cell * width + code
        beyond, on_wall = _among(keys ^ 1, walls), _among(keys, walls)
        cuts = cls(cell, obstacle, facet, code, ~on_wall, np.zeros(len(cell), dtype=np.bool_))
        if beyond.any():
            pairs = runs_of(cell * (int(obstacle.max()) + 1) + obstacle)
            apart = np.logical_or.reduceat(beyond, pairs[:-1])
            cuts = cuts.take((~apart.repeat(counts_of(pairs))).nonzero()[0])
        return cuts

    def take(self, rows: Ints) -> Cuts:
        """Some of the entries."""
        return Cuts(
            self.cell[rows],
            self.obstacle[rows],
            self.facet[rows],
            self.code[rows],
            self.open[rows],
            self.late[rows],
        )


def carve(
    cells: Cells,
    cuts: Cuts,
    corners: tuple[Floats, Ints],
    table: PlaneTable,
    tol: float,
) -> tuple[Partition, Ints]:
    """Cut cells along facets of the obstacles that meet them, until each is free or filled.

    Of these facets the one beyond which a cell reaches farthest is next; all cells are cut at the
    same time.

    Args:
        cells: m cells.
        cuts: all half-spaces of obstacles that may meet them.
        corners: of the obstacles' facets, end to end, and where those of each begin [m].
        table: the planes.
        tol: nearer to a plane than this is on it [m].

    Returns:
        The parts of the cells that an obstacle meets, and which these are.
    """
    pieces, home = cells, np.arange(len(cells))
    tree, nodes = TreeBuilder(len(cells)), np.arange(len(cells))
    layers: list[Cells] = []
    ended: list[tuple[Ints, Ints, Ints, Ints]] = []
    total = 0
    rows, beyond, blocker = _passing(pieces, cuts, table, tol)
    cuts = cuts.take(rows)
    cuts = replace(cuts, late=_elsewhere(cells, cuts, *corners, table, tol))
    while True:
        layers.append(pieces)
        chosen = _chosen(cuts, beyond, len(pieces))
        chosen[blocker >= 0] = -1
        over, cut = (chosen < 0).nonzero()[0], (chosen >= 0).nonzero()[0]
        ended.append((total + over, nodes[over], home[over], blocker[over]))
        if not len(cut):
            break
        total += len(pieces)
        cuts.open[chosen[cut]] = False
        plane = cuts.code[chosen[cut]] >> 1
        labels = np.stack([2 * plane + 1, 2 * plane], axis=1)
        parts, parent, side = pieces.take(cut).divide(
            labels, table.normals[plane], table.offsets[plane], tol, np.ones_like(labels, np.bool_)
        )
        nodes = tree.cut(nodes[cut], plane, parent, side)
        # Parts inherit what may cut the whole.
        whole = cut[parent]
        sizes = np.bincount(cuts.cell, minlength=len(pieces))
        cuts = cuts.take(spans((sizes.cumsum() - sizes)[whole], sizes[whole]))
        cuts = replace(cuts, cell=np.arange(len(parts)).repeat(sizes[whole]))
        pieces, home = parts, home[whole]
        rows, beyond, blocker = _passing(pieces, cuts, table, tol)
        cuts = cuts.take(rows)
    rows, nodes, home, blocker = (np.concatenate(lists) for lists in zip(*ended, strict=True))
    solid = blocker >= 0
    met = np.zeros(len(cells), dtype=np.bool_)
    met[home[solid]] = True
    free = ~solid & met[home]
    tree.end(nodes, np.where(free, free.cumsum() - 1, np.where(solid, -1 - solid.cumsum(), -1)))
    everything = join_cells(layers)
    part = Partition(
        everything.take(rows[free]), everything.take(rows[solid]), blocker[solid], tree.build()
    )
    return part, met.nonzero()[0]


def _passing(pieces: Cells, cuts: Cuts, table: PlaneTable, tol: float) -> tuple[Ints, Floats, Ints]:
    """What is left of the cuts where cells have become smaller.

    Returns:
        Rows of the cuts that pass through their cell, how far it reaches beyond them [m], and the
        obstacle that fills each cell, -1 for none.
    """
    blocker = np.full(len(pieces), -1)
    if not len(cuts.cell):
        return cuts.cell, np.zeros(0), blocker
    A, b = table.halfspaces(cuts.code)
    lowest, highest = extents(pieces.vertices, pieces.vertex_starts, cuts.cell, A)
    pairs = runs_of(cuts.cell * (int(cuts.obstacle.max()) + 1) + cuts.obstacle)
    first = pairs[:-1]
    outside = np.logical_or.reduceat(lowest - b >= -tol, first)
    beyond = highest - b
    passes = (beyond > tol) & cuts.open
    filled = first[~outside & ~np.logical_or.reduceat(passes, first)]
    blocker[cuts.cell[filled]] = cuts.obstacle[filled]
    rows = (passes & ~outside.repeat(counts_of(pairs))).nonzero()[0]
    return rows, beyond[rows], blocker


def _among(keys: Ints, ascending: Ints) -> Bools:
    """Which keys are in a list; np.isin sorts it each time."""
    place = np.minimum(np.searchsorted(ascending, keys), len(ascending) - 1)
    return ascending[place] == keys if len(ascending) else np.zeros(len(keys), dtype=np.bool_)


def _elsewhere(
    cells: Cells, cuts: Cuts, corners: Floats, starts: Ints, table: PlaneTable, tol: float
) -> Bools:
    """Whether a wall of the cell has all corners of a facet beyond it; arguments as for `carve`."""
    counts = counts_of(cells.facet_starts)[cuts.cell]
    walls = cells.facets[spans(cells.facet_starts[cuts.cell], counts)]
    A, b = table.halfspaces(walls)
    lowest, _ = extents(corners, starts, cuts.facet.repeat(counts), A)
    beyond = (lowest >= b - tol) & (walls != UNNAMED)
    return np.logical_or.reduceat(beyond, starts_of(counts)[:-1]) if len(counts) else beyond


def _chosen(cuts: Cuts, beyond: Floats, count: int) -> Ints:
    """The row of the cut that is next in each cell, shape (count,); -1 for none."""
    chosen = np.full(count, -1)
    if len(beyond):
        # A plane without its facet comes last: mostly it passes through nothing by then.
        score = np.where(cuts.late, -1.0 / beyond, beyond)
        starts = runs_of(cuts.cell)
        best = reduced(np.maximum, score, starts).repeat(counts_of(starts))
        hits = (score == best).nonzero()[0][::-1]
        chosen[cuts.cell[hits]] = hits  # the first of each cell is written last
    return chosen
