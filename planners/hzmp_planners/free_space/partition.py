"""Exact convex decomposition: cells minus the interiors of convex obstacles, by binary cuts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import counts_of, runs_of, spans, starts_of
from hzmp_planners.free_space.cells import INNER, Cells, join_cells
from hzmp_planners.free_space.cut_tree import CutTree
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
    """Cells of one depth, and after them in the same arrays what obstacles have of each."""

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
    partition, Fuchs, Kedem and Naylor 1980). A block all of whose facets lie on its cell's wall
    fills the cell.

    Args:
        cells: m cells.
        blocks: what obstacles have in common with single cells.
        home: the cell of each block.
        obstacle: the obstacle that each block is of.
        table: the planes.
        tol: nearer to a plane than this is on it [m].
    """
    walls = _keys(cells.facet_owner, cells.facets >> 1, table)
    on_wall = np.isin(_keys(home[blocks.facet_owner], blocks.facets >> 1, table), walls)
    blocks = blocks.relabelled(np.where(on_wall, INNER, blocks.facets))
    layer = _Layer(join_cells([cells, blocks]), len(cells), home, obstacle)
    layers: list[Cells] = []
    planes: list[Ints] = []
    children: list[Ints] = []
    ends: list[tuple[Ints, Ints, Ints]] = []
    nodes = total = 0
    while True:
        layers.append(layer.pieces)
        blocker, going = _states(layer)
        over = (~going).nonzero()[0]
        ends.append((over + total, over + nodes, blocker[over]))
        total += len(layer.pieces)
        nodes += layer.count
        if not going.any():
            planes.append(np.full(layer.count, -1))
            children.append(np.full((layer.count, 2), -1))
            break
        planes.append(_choose(layer, going, table, tol))
        layer, number = _cut(layer, going, planes[-1], table, tol)
        children.append(np.where(number >= 0, number + nodes, -1))
    rows, at, blocker = (np.concatenate(lists) for lists in zip(*ends, strict=True))
    free = blocker < 0
    pieces = np.full(nodes, -1)
    pieces[at] = np.where(free, free.cumsum() - 1, -1 - (~free).cumsum())
    everything = join_cells(layers)
    return Partition(
        everything.take(rows[free]),
        everything.take(rows[~free]),
        blocker[~free],
        CutTree(np.concatenate(planes), np.concatenate(children), pieces),
    )


def _keys(owner: Ints, plane: Ints, table: PlaneTable) -> Ints:
    return owner * (len(table.offsets) + 1) + plane


def _states(layer: _Layer) -> tuple[Ints, Bools]:
    """The obstacle that fills each cell, -1 for none, and which cells have to be cut further."""
    blocker = np.full(layer.count, -1)
    going = np.zeros(layer.count, dtype=np.bool_)
    if len(layer.home):
        inner = layer.pieces.facets != INNER
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
    candidate = ((pieces.facets[begin:] != INNER) & going[home]).nonzero()[0]
    candidate = candidate[home[candidate].argsort(kind="stable")]
    home = home[candidate]
    first = runs_of(home)
    sizes = counts_of(np.append(first, len(home)))
    if sizes.max() > _CANDIDATES:
        # Of many candidates every k-th is tried.
        place = np.arange(len(home)) - first.repeat(sizes)
        tried = place % (-(-sizes // _CANDIDATES)).repeat(sizes) == 0
        candidate, home = candidate[tried], home[tried]
        first = runs_of(home)
        sizes = counts_of(np.append(first, len(home)))
    plane = pieces.facets[begin + candidate] >> 1
    chosen = np.full(count, -1)
    chosen[home[::-1]] = plane[::-1]  # the first candidate of each cell is written last
    held = np.bincount(layer.home, minlength=count)
    contested = (held[home] > 1).nonzero()[0]
    if len(contested):
        home, plane = home[contested], plane[contested]
        score = _scores(layer, held, home, plane, table, tol)
        first = runs_of(home)
        best = np.minimum.reduceat(score, first)
        hits = (score == best.repeat(counts_of(np.append(first, len(home))))).nonzero()[0][::-1]
        chosen[home[hits]] = plane[hits]
    return chosen


def _scores(
    layer: _Layer, held: Ints, home: Ints, plane: Ints, table: PlaneTable, tol: float
) -> Floats:
    """How badly each candidate plane would cut its cell: blocks cut in two, and balance."""
    starts, count = layer.pieces.vertex_starts, layer.count
    by_cell = layer.home.argsort(kind="stable")
    members = held[home]
    rival = count + by_cell[spans(starts_of(held)[home], members)]
    widths = counts_of(starts)[rival]
    points = layer.pieces.vertices.take(spans(starts[rival], widths), axis=0)
    against = plane.repeat(members).repeat(widths)
    heights = np.einsum("ij,ij->i", points, table.normals.take(against, axis=0))
    heights -= table.offsets.take(against)
    first = starts_of(widths)[:-1]
    below = np.minimum.reduceat(heights, first) < -tol
    above = np.maximum.reduceat(heights, first) > tol
    groups = starts_of(members)[:-1]
    lean = np.add.reduceat(below.astype(np.int64) - above, groups)
    cuts = np.add.reduceat(below & above, groups, dtype=np.int64)
    return _SPLIT_COST * cuts + np.abs(lean)


def _cut(
    layer: _Layer, going: Bools, plane: Ints, table: PlaneTable, tol: float
) -> tuple[_Layer, Ints]:
    """The next layer, and the numbers there of the two halves of each cell, -1 for none."""
    count = layer.count
    of = np.concatenate([np.arange(count), layer.home])
    cutting = plane[of]
    # A block's facet on the plane of the cut is on its cell's wall from now on.
    facets = layer.pieces.facets.copy()
    begin = layer.pieces.facet_starts[count]
    ahead = cutting[layer.pieces.facet_owner[begin:]]
    facets[begin:][facets[begin:] >> 1 == ahead] = INNER
    labels = np.full((len(of), 2), INNER)
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
    return _Layer(pieces, fresh, home, obstacle), number
