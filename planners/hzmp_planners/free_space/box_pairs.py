"""Cells and obstacles that are boxes: what they have in common needs no clipping."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import counts_of, reduced
from hzmp_planners.free_space.boxes import along_axes, box_cell
from hzmp_planners.free_space.cells import Cells
from hzmp_planners.free_space.planes import PlaneTable


def are_boxes(facets: Ints, starts: Ints, table: PlaneTable) -> Bools:
    """Which lists of half-spaces are those of boxes along the axes, one for each side.

    Args:
        facets: codes of half-spaces, end to end; below 0 for none.
        starts: where each list begins, shape (m + 1,).
        table: the planes.
    """
    n = table.normals.shape[1]
    along = along_axes(table.normals)[facets >> 1] & (facets >= 0)
    seen = np.where(along, 1 << _side_of(facets, table), 0)
    whole = reduced(np.bitwise_or, seen, starts) == (1 << 2 * n) - 1
    return np.asarray(whole & (counts_of(starts) == 2 * n))


def common_boxes(
    cells: Cells,
    cell: Ints,
    codes: Ints,
    starts: Ints,
    block: Ints,
    table: PlaneTable,
    tol: float,
) -> tuple[Cells, Ints]:
    """What pairs of a cell and an obstacle have in common, both of them boxes.

    Args:
        cells: those named are boxes, with codes of half-spaces as facets.
        cell: of each pair, shape (k,).
        codes: half-spaces of the obstacles, end to end.
        starts: where each obstacle's begin.
        block: of each pair, a box.
        table: the planes.
        tol: a part narrower than this is none [m].

    Returns:
        The parts, and the pairs that they are of.
    """
    n = table.normals.shape[1]
    own, walls = _sides(cells.facets, cells.facet_starts[cell], table)
    other, ends = _sides(codes, starts[block], table)
    # Along their outward normals both are offsets: the lesser one is the side of what is common.
    cut = ends < walls - tol
    sides = np.where(cut, ends, walls)
    low, high = -sides[:, n:], sides[:, :n]
    met = (ends[:, :n] + walls[:, n:] > tol) & (ends[:, n:] + walls[:, :n] > tol)
    kept = np.asarray(met.all(axis=1)).nonzero()[0]
    labels = np.where(cut, other, own)[kept]
    # A unit box whose facets are labelled with the numbers of its sides.
    unit = box_cell(np.zeros(n), np.ones(n), np.arange(2 * n), len(kept))
    part = unit.vertex_owner
    corners = np.where(unit.vertices > 0.5, high[kept][part], low[kept][part])
    return unit.moved(corners).relabelled(labels[unit.facet_owner, unit.facets]), kept


def _sides(codes: Ints, begins: Ints, table: PlaneTable) -> tuple[Ints, Floats]:
    """Codes and outward offsets of boxes: upper sides along each axis, then lower ones, (k, 2 n).

    Args:
        codes: half-spaces, end to end.
        begins: where those of each box begin, shape (k,).
        table: the planes.
    """
    n = table.normals.shape[1]
    held = codes[begins[:, None] + np.arange(2 * n)]
    rows = np.arange(len(begins)).repeat(2 * n)
    place = _side_of(held.ravel(), table)
    _, offsets = table.halfspaces(held.ravel())
    named, ends = np.empty_like(held), np.empty(held.shape)
    named[rows, place], ends[rows, place] = held.ravel(), offsets
    return named, ends


def _side_of(codes: Ints, table: PlaneTable) -> Ints:
    """The axis of each half-space's normal, plus n for a lower side."""
    normals = table.normals
    axis = np.abs(normals).argmax(axis=1)
    up = normals[np.arange(len(axis)), axis] > 0.0
    plane = codes >> 1
    lower = up[plane] ^ (codes & 1).astype(np.bool_)
    return np.asarray(axis[plane] + normals.shape[1] * lower)
