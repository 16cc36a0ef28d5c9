"""Exact convex decomposition: cells minus the interiors of convex obstacles, by binary cuts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import extents, spans
from hzmp_planners.free_space.cells import UNNAMED, Cells, join_cells
from hzmp_planners.free_space.cut_tree import CutTree, TreeBuilder
from hzmp_planners.free_space.planes import PlaneTable

_SPLIT_COST = 3.0  # of a block cut in two, in blocks by which the two sides differ
_CANDIDATES = 48  # planes tried for one cell


@dataclass(frozen=True, eq=False)
class Partition:
    """Cells with disjoint interiors: the free ones, and those that an obstacle fills."""

    free: Cells
    solid: Cells
    blockers: Ints
    """The obstacle that fills each solid cell."""
    tree: CutTree
    """One tree for each cell that was given; its pieces are the free cells, -2 - k is solid k."""


@dataclass(frozen=True, eq=False)
class _Layer:
    """Cells of one depth, and after them in the same arrays what obstacles have of each.

    The facets of a block inside its cell have their codes, those on the cell's wall are UNNAMED.
    """

    pieces: Cells
    count: int
    """How many of the pieces are cells; the others are blocks."""
    home: Ints
    """The cell of each block."""
    obstacle: Ints
    """The obstacle of each block."""


def partition(
    cells: Cells, blocks: Cells, home: Ints, obstacle: Ints, table: PlaneTable, tol: float
) -> Partition:
    """Cut cells until each is free or filled by an obstacle.

    All cells of one depth are cut at the same time, each along a facet of an obstacle inside it:
    the one that leaves the obstacles best balanced and cuts fewest in two (a binary space
    partition, Fuchs, Kedem and Naylor 1980). A block without a facet inside its cell fills it.

    Args:
        cells: m cells.
        blocks: what obstacles have in common with single cells.
        home: the cell of each block.
        obstacle: the obstacle that each block is of.
        table: the planes.
        tol: nearer to a plane than this is on it [m].
    """
    width = 2 * len(table.offsets)
    walls = cells.facet_owner * width + cells.facets
    # A block on the far side of its cell's wall is what tolerances leave of one that only touches.
    beyond = np.isin(home[blocks.facet_owner] * width + (blocks.facets ^ 1), walls)
    if beyond.any():
        kept = np.ones(len(blocks), dtype=np.bool_)
        kept[blocks.facet_owner[beyond]] = False
        rows = kept.nonzero()[0]
        blocks, home, obstacle = blocks.take(rows), home[rows], obstacle[rows]
    on_wall = np.isin(home[blocks.facet_owner] * width + blocks.facets, walls)
    blocks = blocks.relabelled(np.where(on_wall, UNNAMED, blocks.facets))
    layer = _Layer(join_cells([cells, blocks]), len(cells), home, obstacle)
    tree, nodes = TreeBuilder(len(cells)), np.arange(len(cells))
    layers: list[Cells] = []
    ended: list[tuple[Ints, Ints, Ints]] = []
    total = 0
    while True:
        layers.append(layer.pieces)
        blocker, going = _states(layer)
        over = (~going).nonzero()[0]
        ended.append((over + total, nodes[over], blocker[over]))
        if not going.any():
            break
        total += len(layer.pieces)
        plane = _choose(layer, going, table, tol)
        layer, parent, side = _cut(layer, going, plane, table, tol)
        cut = going.nonzero()[0]
        nodes = tree.cut(nodes[cut], plane[cut], (going.cumsum() - 1)[parent], side)
    rows, nodes, blocker = (np.concatenate(lists) for lists in zip(*ended, strict=True))
    free = blocker < 0
    tree.end(nodes, np.where(free, free.cumsum() - 1, -1 - (~free).cumsum()))
    pieces = join_cells(layers)
    return Partition(
        pieces.take(rows[free]), pieces.take(rows[~free]), blocker[~free], tree.build()
    )


def _states(layer: _Layer) -> tuple[Ints, Bools]:
    """The obstacle that fills each cell, -1 for none, and which cells have to be cut further."""
    blocker = np.full(layer.count, -1)
    going = np.zeros(layer.count, dtype=np.bool_)
    if len(layer.home):
        inner = layer.pieces.facets != UNNAMED
        open_ = np.logical_or.reduceat(inner, layer.pieces.facet_starts[layer.count : -1])
        filling = (~open_).nonzero()[0]
        blocker[layer.home[filling]] = layer.obstacle[filling]
        going[layer.home] = True
        going &= blocker < 0
    return blocker, going


def _choose(layer: _Layer, going: Bools, table: PlaneTable, tol: float) -> Ints:
    """The plane that each cell is cut along, shape (count,); -1 for cells that are not cut."""
    pieces, count = layer.pieces, layer.count
    begin = pieces.facet_starts[count]
    home = layer.home[pieces.facet_owner[begin:] - count]
    candidate = ((pieces.facets[begin:] != UNNAMED) & going[home]).nonzero()[0]
    home = home[candidate]
    sizes = np.bincount(home, minlength=count)
    if sizes.max() > _CANDIDATES:
        # Of many candidates every k-th is tried.
        order = home.argsort(kind="stable")
        place = np.empty_like(order)
        place[order] = np.arange(len(order)) - (sizes.cumsum() - sizes)[home[order]]
        tried = place % (-(-sizes // _CANDIDATES))[home] == 0
        candidate, home = candidate[tried], home[tried]
    plane = pieces.facets[begin + candidate] >> 1
    chosen = np.full(count, -1)
    chosen[home[::-1]] = plane[::-1]  # the first candidate of each cell is written last
    held = np.bincount(layer.home, minlength=count)
    contested = (held[home] > 1).nonzero()[0]
    if len(contested):
        home, plane = home[contested], plane[contested]
        score = _scores(layer, held, home, plane, table, tol)
        best = np.full(count, np.inf)
        np.minimum.at(best, home, score)
        hits = (score == best[home]).nonzero()[0][::-1]
        chosen[home[hits]] = plane[hits]
    return chosen


def _scores(
    layer: _Layer, held: Ints, home: Ints, plane: Ints, table: PlaneTable, tol: float
) -> Floats:
    """How badly each candidate plane would cut its cell: blocks cut in two, and balance."""
    by_cell = layer.home.argsort(kind="stable")
    members = held[home]
    rival = layer.count + by_cell[spans((held.cumsum() - held)[home], members)]
    against = plane.repeat(members)
    normals, offsets = table.normals.take(against, axis=0), table.offsets.take(against)
    lowest, highest = extents(layer.pieces.vertices, layer.pieces.vertex_starts, rival, normals)
    below, above = lowest - offsets < -tol, highest - offsets > tol
    groups = members.cumsum() - members
    lean = np.add.reduceat(below.astype(np.int64) - above, groups)
    cuts = np.add.reduceat(below & above, groups, dtype=np.int64)
    return np.asarray(_SPLIT_COST * cuts + np.abs(lean))


def _cut(
    layer: _Layer, going: Bools, plane: Ints, table: PlaneTable, tol: float
) -> tuple[_Layer, Ints, Ints]:
    """The next layer, and for each of its cells the one that it is a part of and the side."""
    count = layer.count
    of = np.concatenate([np.arange(count), layer.home])
    cutting = plane[of]
    # A block's facet on the plane of the cut is on its cell's wall from now on.
    facets = layer.pieces.facets.copy()
    begin = layer.pieces.facet_starts[count]
    ahead = cutting[layer.pieces.facet_owner[begin:]]
    facets[begin:][facets[begin:] >> 1 == ahead] = UNNAMED
    labels = np.full((len(of), 2), UNNAMED)
    labels[:count, 0], labels[:count, 1] = 2 * plane + 1, 2 * plane
    wanted = np.empty(labels.shape, dtype=np.bool_)
    wanted[:, 0] = wanted[:, 1] = going[of]
    pieces, parent, side = layer.pieces.relabelled(facets).divide(
        labels, table.normals[cutting], table.offsets[cutting], tol, wanted
    )
    fresh = int(np.searchsorted(parent, count))
    number = np.full((count, 2), -1)
    number[parent[:fresh], side[:fresh]] = np.arange(fresh)
    block = parent[fresh:] - count
    home, obstacle = number[layer.home[block], side[fresh:]], layer.obstacle[block]
    lost = home < 0  # the last sliver of a block, beside a cell that ends within the tolerance
    if lost.any():
        kept = (~lost).nonzero()[0]
        pieces = pieces.take(np.concatenate([np.arange(fresh), fresh + kept]))
        home, obstacle = home[kept], obstacle[kept]
    return _Layer(pieces, fresh, home, obstacle), parent[:fresh], side[:fresh]
