"""The workspace as a cell."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.free_space.cells import Cells
from hzmp_planners.free_space.polygons import Polygons
from hzmp_planners.free_space.polyhedra import Polyhedra


def box_cell(lo: Floats, hi: Floats, labels: Ints) -> Cells:
    """A box as one cell.

    Args:
        lo: lower corner, shape (n,) with n = 2 or 3 [m].
        hi: upper corner.
        labels: of its upper walls, then of its lower ones, shape (2 n,).
    """
    if lo.size == 2:
        corners = np.array([[lo[0], lo[1]], [hi[0], lo[1]], [hi[0], hi[1]], [lo[0], hi[1]]])
        return Polygons.of(corners, np.array([0, 4]), labels[[3, 0, 1, 2]])
    bits = np.arange(8)[:, None] >> np.arange(3) & 1
    edges, facets = [], []
    for axis in range(3):
        for corner in (bits[:, axis] == 0).nonzero()[0].tolist():
            edges.append((corner, corner + (1 << axis)))
            facets.append([k if bits[corner, k] else 3 + k for k in range(3) if k != axis])
    return Polyhedra(
        np.where(bits == 1, hi, lo),
        np.array([0, 8]),
        labels,
        np.array([0, 6]),
        np.array(edges).T,
        np.array(facets).T,
        np.array([0, 12]),
    )
