"""The decomposition behind a free space, and how it follows obstacles that come and go.

Nothing here is changed in place: an update takes over what the obstacles do not touch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ragged import counts_of, distinct, spans
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.free_space.blocks import Blocks, blocks_of, common_parts, facet_corners
from hzmp_planners.free_space.boxes import box_cell
from hzmp_planners.free_space.carving import Cuts, carve
from hzmp_planners.free_space.cells import Cells, join_cells
from hzmp_planners.free_space.complexes import Complex, empty_complex
from hzmp_planners.free_space.cut_tree import CutTree
from hzmp_planners.free_space.merge import merge_convex_unions
from hzmp_planners.free_space.outlines import cells_of
from hzmp_planners.free_space.partition import Partition, partition
from hzmp_planners.free_space.planes import PlaneTable
from hzmp_planners.sets import Polytope

_FEW = 8  # obstacles near one cell, above which it pays to look for the best cuts


@dataclass(frozen=True, eq=False)
class World:
    """Leaves of the free space, what fills the rest, and the cuts between them."""

    scale: float
    """Unit of the tolerances [m]."""
    table: PlaneTable
    blocks: Blocks
    leaves: Complex
    tree: CutTree
    """Its pieces are the leaves; -2 - k is solid cell k."""
    solid: tuple[Cells, ...]
    """Cells that an obstacle fills, in batches."""
    blockers: Ints
    """The obstacle that fills each of them; -1 for cells that have been opened since."""

    @property
    def tol(self) -> float:
        """Nearer to a plane than this is on it [m]."""
        return PLANE_TOL * self.scale


def build_world(lo: Floats, hi: Floats, obstacles: Sequence[Polytope], scale: float) -> World:
    """Decompose a box minus obstacles that all have an interior."""
    n, eye = lo.size, np.eye(lo.size)
    workspace = (np.concatenate([eye, -eye]), np.concatenate([hi, -lo]))
    table, walls, blocks = blocks_of(PlaneTable.empty(n, scale), obstacles, *workspace)
    box = box_cell(lo, hi, walls)
    tol = PLANE_TOL * scale
    cell, block = blocks.near(lo[None], hi[None], tol)
    part = _partition(box, cell, block, blocks, table, tol)
    fresh, number = empty_complex(n).with_cells(part.free, scale)
    leaves, joined = merge_convex_unions(fresh, table, scale)
    tree = _numbered(part, _composed(number, joined), 0)
    return World(scale, table, blocks, leaves.compact(), tree, (part.solid,), part.blockers)


def add_obstacles(world: World, obstacles: Sequence[Polytope]) -> tuple[World, Ints]:
    """Cut further obstacles out of the leaves that they touch.

    Returns:
        The world, and the number that each leaf of the given one has in it: -1 for those cut. The
        fresh leaves follow the kept ones.
    """
    tol = world.tol
    table, _, blocks = blocks_of(world.table, obstacles, np.zeros((0, world.leaves.n)), np.zeros(0))
    cell, block = blocks.near(*world.leaves.bounds, tol)
    candidates = distinct(cell)
    rank = np.searchsorted(candidates, cell)
    cells = cells_of(world.leaves.take(candidates), table, tol)
    many = bool(np.bincount(rank).max(initial=0) > _FEW)
    if many:
        part, touched, trees = _partitioned(cells, rank, block, blocks, table, tol)
    else:
        part, touched = _carved(cells, rank, block, blocks, obstacles, table, tol)
        trees = touched
    touched = candidates[touched]
    kept = np.ones(len(world.leaves), dtype=np.bool_)
    kept[touched] = False
    number = np.where(kept, kept.cumsum() - 1, -1)
    rest = int(kept.sum())
    pieces, names = world.leaves.with_cells(part.free, world.scale)
    if many:
        pieces, joined = merge_convex_unions(pieces, table, world.scale)
        names = _composed(names, joined)
    tree = _numbered(part, np.where(names >= 0, names + rest, -1), len(world.blockers))
    root = np.full(len(world.leaves), -1)
    root[touched] = trees
    ends = (world.tree.pieces >= 0).nonzero()[0]
    ends = ends[root[world.tree.pieces[ends]] >= 0]
    roots = root[world.tree.pieces[ends]]
    made = World(
        world.scale,
        table,
        world.blocks.joined(blocks),
        world.leaves.take(kept.nonzero()[0]).joined(pieces),
        world.tree.renamed(number).grafted(ends, tree, roots),
        (*world.solid, part.solid),
        np.concatenate([world.blockers, part.blockers + len(world.blocks)]),
    )
    return made, number


def remove_obstacles(world: World, gone: Ints) -> World:
    """Open the cells that obstacles filled, where no other obstacle is.

    The obstacles that stay are renumbered in order.
    """
    tol = world.tol
    stays = np.ones(len(world.blocks), dtype=np.bool_)
    stays[gone] = False
    blocks = world.blocks.take(stays.nonzero()[0])
    number = np.append(np.where(stays, stays.cumsum() - 1, -1), -1)
    opened = np.isin(world.blockers, gone).nonzero()[0]
    solid = join_cells(world.solid)
    cells = solid.take(opened)
    cell, block = blocks.near(*cells.bounds, tol)
    part = _partition(cells, cell, block, blocks, world.table, tol)
    pieces, leaf = world.leaves.with_cells(part.free, world.scale)
    shift = len(world.leaves)
    fresh = np.arange(shift + len(pieces)) >= shift
    leaves, joined = merge_convex_unions(
        world.leaves.joined(pieces), world.table, world.scale, fresh
    )
    names = _composed(np.where(leaf >= 0, leaf + shift, -1), joined)
    root = np.full(len(world.blockers), -1)
    root[opened] = np.arange(len(opened))
    ends = (world.tree.pieces <= -2).nonzero()[0]
    ends = ends[root[-2 - world.tree.pieces[ends]] >= 0]
    roots = root[-2 - world.tree.pieces[ends]]
    tree = _numbered(part, names, len(world.blockers))
    return World(
        world.scale,
        world.table,
        blocks,
        leaves.compact(),
        world.tree.renamed(joined[:shift]).grafted(ends, tree, roots),
        (solid, part.solid),
        np.concatenate([number[world.blockers], part.blockers]),
    )


def reorder_obstacles(world: World, order: Ints) -> World:
    """The same world with obstacle order[i] in place i."""
    place = np.full(len(world.blocks) + 1, -1)
    place[order] = np.arange(len(order))
    return replace(world, blocks=world.blocks.take(order), blockers=place[world.blockers])


def _partition(
    cells: Cells, cell: Ints, block: Ints, blocks: Blocks, table: PlaneTable, tol: float
) -> Partition:
    return partition(cells, *blocks.common(cells, cell, block, table, tol), table, tol)


def _partitioned(
    cells: Cells, cell: Ints, block: Ints, blocks: Blocks, table: PlaneTable, tol: float
) -> tuple[Partition, Ints, Ints]:
    """Partition only the cells that an obstacle meets; which these are, and the tree of each."""
    parts, home, obstacle = common_parts(cells, cell, block, blocks, table, tol)
    touched = distinct(home)
    home = np.searchsorted(touched, home)
    part = partition(cells.take(touched), parts, home, obstacle, table, tol)
    return part, touched, np.arange(len(touched))


def _carved(
    cells: Cells,
    cell: Ints,
    block: Ints,
    blocks: Blocks,
    obstacles: Sequence[Polytope],
    table: PlaneTable,
    tol: float,
) -> tuple[Partition, Ints]:
    """Carve the cells; and which of them an obstacle meets. There is a tree for each cell."""
    counts = counts_of(blocks.starts)[block]
    facet = spans(blocks.starts[block], counts)
    pairs = cell.repeat(counts), block.repeat(counts)
    cuts = Cuts.between(cells, *pairs, facet, blocks.codes[facet], table)
    return carve(cells, cuts, facet_corners(obstacles), table, tol)


def _composed(first: Ints, then: Ints) -> Ints:
    """The leaf of each cell after merging; -1 stays -1."""
    return np.append(then, -1)[first]


def _numbered(part: Partition, leaf: Ints, solid: int) -> CutTree:
    """The cuts of a partition in terms of leaves; its solid cells count from `solid`."""
    tree = part.tree.renamed(leaf)
    filled = part.tree.pieces <= -2
    tree.pieces[filled] = part.tree.pieces[filled] - solid
    return tree
