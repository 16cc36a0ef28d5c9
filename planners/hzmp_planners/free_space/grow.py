"""Growing a leaf into its neighbours while it stays convex and free."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners._cell import Cell
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.free_space.decompose import box_cell
from hzmp_planners.sets import Polytope

if TYPE_CHECKING:
    from hzmp_planners.free_space.free_space import FreeSpace


def grow_leaf(space: FreeSpace, leaf: int, toward: list[int]) -> Polytope:
    """A convex free polytope that contains the leaf, pushed outward facet by facet.

    Each facet in turn is moved out until the polytope would meet an obstacle or the workspace
    wall: first the facets shared with the leaves in `toward`, then the others. The order decides
    the shape; every result is free.

    Args:
        space: the free space.
        leaf: index of the leaf.
        toward: neighbours to grow into first.
    """
    A, b = space.leaves[leaf].A, space.leaves[leaf].b.copy()
    tol = PLANE_TOL * space.scale
    corners = [space.leaves[other].vertices() for other in toward]
    # A facet separates a neighbour when all of the neighbour is on its outer side.
    first = [j for j in range(len(b)) if any((v @ A[j] >= b[j] - 2.0 * tol).all() for v in corners)]
    for j in first + [j for j in range(len(b)) if j not in first]:
        b[j] = max(b[j], _free_reach(space, A, b, j, tol))
    lo, hi = space.bounds
    eye = np.eye(space.n)
    A, b = np.vstack([A, eye, -eye]), np.concatenate([b, hi, -lo])
    vertices = _clip(_workspace(space), A[: -2 * space.n], b[: -2 * space.n], tol).vertices
    bounding = [j for j in range(len(b)) if (vertices @ A[j] - b[j]).max() >= -10.0 * tol]
    keys = np.round(np.column_stack([A, b])[bounding], 9)
    _, kept = np.unique(keys, axis=0, return_index=True)
    rows = np.array(bounding)[np.sort(kept)]
    return Polytope.from_both_forms(A[rows], b[rows], vertices)


def _free_reach(space: FreeSpace, A: Floats, b: Floats, j: int, tol: float) -> float:
    """How far facet j can move out before the polytope of the other facets meets an obstacle."""
    others = np.arange(len(b)) != j
    body = _clip(_workspace(space), A[others], b[others], tol)
    beyond = _clip(body, -A[j : j + 1], -b[j : j + 1], tol)
    if not len(beyond.vertices):
        return float(b[j])
    reach = float((beyond.vertices @ A[j]).max())
    lo, hi = beyond.vertices.min(axis=0), beyond.vertices.max(axis=0)
    for block, (low, high) in zip(space.obstacles, space.obstacle_boxes, strict=True):
        if (low >= hi - tol).any() or (high <= lo + tol).any():
            continue
        common = _clip(beyond, block.A, block.b, tol)
        if len(common.vertices):
            reach = min(reach, float((common.vertices @ A[j]).min()))
            if reach <= b[j] + tol:
                return float(b[j])
    return reach


def _workspace(space: FreeSpace) -> Cell:
    n = space.n
    return box_cell(*space.bounds, [(-1, 1)] * (2 * n))


def _clip(cell: Cell, normals: Floats, offsets: Floats, tol: float) -> Cell:
    """The part of a cell inside all half-spaces; without vertices when it has no interior."""
    for normal, offset in zip(normals, offsets, strict=True):
        heights = cell.vertices @ normal - offset
        if heights.min() >= -tol:
            return Cell(cell.vertices[:0], [], [])
        if heights.max() > tol:
            cell, _ = cell.split(-1, heights, tol)
    return cell
