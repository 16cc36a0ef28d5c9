"""Exact convex decomposition: the workspace box minus the interiors of convex obstacles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners._cell import Cell, Facet
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.free_space.planes import PlaneTable
from hzmp_planners.sets import Polytope


def box_cell(lo: Floats, hi: Floats, facets: list[Facet]) -> Cell:
    """The workspace as a cell; `facets` are its upper walls, then its lower ones."""
    n = lo.size
    corners = np.array(np.meshgrid(*[(0, 1)] * n, indexing="ij")).reshape(n, -1).T
    masks = [
        sum(1 << (axis if bit else n + axis) for axis, bit in enumerate(corner))
        for corner in corners
    ]
    return Cell(np.where(corners == 1, hi, lo), masks, facets)


def subtract_obstacles(
    workspace: Cell,
    obstacles: Sequence[Polytope],
    facets: Sequence[tuple[Facet, ...]],
    table: PlaneTable,
    scale: float,
) -> list[Cell]:
    """Cut every obstacle out of the cells whose interior it meets.

    Each such cell is cut by the obstacle's facet planes one after the other; the outside pieces
    are new cells, what remains inside after the last plane is dropped. Cells that an obstacle only
    touches stay whole.
    """
    tol = PLANE_TOL * scale
    cells = [workspace]
    lows = workspace.vertices.min(axis=0)[None, :]
    highs = workspace.vertices.max(axis=0)[None, :]
    for obstacle, planes in zip(obstacles, facets, strict=True):
        lo, hi = obstacle.interval_hull()
        near = np.flatnonzero((lows < hi - tol).all(axis=1) & (highs > lo + tol).all(axis=1))
        kept = np.ones(len(cells), dtype=bool)
        fresh: list[Cell] = []
        for index in near.tolist():
            pieces = _outside_pieces(cells[index], planes, table, tol)
            if pieces is not None:
                kept[index] = False
                fresh.extend(pieces)
        if kept.all():
            continue
        cells = [cell for cell, keep in zip(cells, kept.tolist(), strict=True) if keep] + fresh
        if not cells:
            return []
        n = workspace.vertices.shape[1]
        bottoms = np.array([cell.vertices.min(axis=0) for cell in fresh]).reshape(-1, n)
        tops = np.array([cell.vertices.max(axis=0) for cell in fresh]).reshape(-1, n)
        lows = np.vstack([lows[kept], bottoms])
        highs = np.vstack([highs[kept], tops])
    return cells


def _outside_pieces(
    cell: Cell, facets: tuple[Facet, ...], table: PlaneTable, tol: float
) -> list[Cell] | None:
    """The parts of the cell outside the obstacle, or None when their interiors do not meet."""
    planes = np.array([plane for plane, _ in facets])
    sides = np.array([side for _, side in facets], dtype=np.float64)
    normals, offsets = table.normals[planes], table.offsets[planes]
    pieces: list[Cell] = []
    inside = cell
    while True:
        heights = inside.vertices @ normals.T - offsets
        outward = heights * sides
        if (outward.min(axis=0) >= -tol).any():
            return None
        reach = outward.max(axis=0)
        cut = int(reach.argmax())
        if reach[cut] <= tol:
            return pieces
        below, above = inside.split(int(planes[cut]), heights[:, cut], tol)
        inside, outside = (below, above) if sides[cut] > 0 else (above, below)
        pieces.append(outside)
