"""Cells of the free space, polygons in 2-D and polyhedra in 3-D, and clipping them."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._polygons import Polygons
from hzmp_planners._ragged import counts_of, reduced
from hzmp_planners.free_space.polyhedra import Polyhedra

Cells = Polygons | Polyhedra
"""Their facets are labelled with codes of half-spaces: see `PlaneTable`."""

INNER = -1
"""Label of a facet that stands for no half-space."""


def box_cell(lo: Floats, hi: Floats, codes: Ints) -> Cells:
    """A box as one cell; `codes` are its upper walls, then its lower ones."""
    n = lo.size
    walls = codes.astype(np.int64)
    if n == 2:
        corners = np.array([[lo[0], lo[1]], [hi[0], lo[1]], [hi[0], hi[1]], [lo[0], hi[1]]])
        return Polygons(corners, np.array([0, 4]), walls[[3, 0, 1, 2]])
    bits = np.arange(8)[:, None] >> np.arange(3) & 1
    edges, facets = [], []
    for axis in range(3):
        for corner in np.flatnonzero(bits[:, axis] == 0).tolist():
            edges.append((corner, corner + (1 << axis)))
            facets.append([k if bits[corner, k] else 3 + k for k in range(3) if k != axis])
    starts = (np.array([0, 8]), np.array([0, 12]), np.array([0, 6]))
    return Polyhedra(
        np.where(bits == 1, hi, lo), starts[0], np.array(edges).T, np.array(facets).T, starts[1],
        walls, starts[2],
    )  # fmt: skip


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
    origin = np.arange(len(cells))
    counts = counts_of(starts)
    for k in range(int(counts.max(initial=0))):
        if not len(origin):
            break
        busy = counts[origin] > k
        row = np.where(busy, starts[origin] + k, 0)
        # Cells whose list has ended see a plane far above them.
        offsets = np.where(busy, b[row], np.inf)
        wanted = np.zeros((len(origin), 2), dtype=np.bool_)
        wanted[:, 0] = True
        names = labels[row].repeat(2).reshape(-1, 2)
        cells, rows, _ = cells.divide(names, A[row], offsets, tol, wanted)
        origin = origin[rows]
    return cells, origin


def bounds_of(cells: Cells) -> tuple[Floats, Floats]:
    """Lowest and highest coordinates of each cell, shape (m, n) each [m]."""
    points, starts = cells.vertices, cells.vertex_starts
    return reduced(np.minimum, points, starts), reduced(np.maximum, points, starts)


def incidence(cells: Cells) -> tuple[Ints, Ints, Ints]:
    """Every vertex on a facet: (cell, facet label, vertex) lists, with repetitions."""
    if isinstance(cells, Polygons):
        ends = np.concatenate([np.arange(len(cells.vertices)), cells.following])
        return np.tile(cells.vertex_owner, 2), np.tile(cells.facets, 2), ends
    labels = cells.facets[cells.edge_facets.repeat(2, axis=0)].ravel()
    return np.tile(cells.edge_owner, 4), labels, np.tile(cells.edges.ravel(), 2)
