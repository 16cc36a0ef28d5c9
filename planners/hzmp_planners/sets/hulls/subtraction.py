"""One convex polytope minus others, as convex pieces."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.constants import SET_TOL
from hzmp_planners.sets.hulls.cell import Cell
from hzmp_planners.sets.polytope import Polytope


def subtract(body: Polytope, blocks: Iterable[Polytope]) -> list[Polytope]:
    """Convex pieces with disjoint interiors whose union is the closure of body minus the blocks.

    The body is cut by the facets of each block that meets its interior, and the pieces outside are
    kept (double description, in the body's own affine hull). Blocks that only touch it, or are
    thinner than 1e-9 of its size there, take nothing away.

    Args:
        body: full-dimensional or flat, not empty.
        blocks: polytopes of the same dimension.
    """
    hull = body.affine_hull()
    tol = SET_TOL * body.form.size
    if not len(hull.basis):
        return [] if any(block.contains(hull.point)[0] for block in blocks) else [body]
    pieces = [_cell((body.vertices() - hull.point) @ hull.basis.T)]
    for block in blocks:
        A, b = block.A @ hull.basis.T, block.b - block.A @ hull.point
        idle = np.linalg.norm(A, axis=1) <= SET_TOL
        if block.is_empty() or (b[idle] < -tol).any():
            continue
        lengths = np.linalg.norm(A[~idle], axis=1)
        A, b = A[~idle] / lengths[:, None], b[~idle] / lengths
        pieces = [rest for piece in pieces for rest in _outside(piece, A, b, tol)]
    return [Polytope.from_vertices(hull.point + piece.vertices @ hull.basis) for piece in pieces]


def _outside(cell: Cell, A: Floats, b: Floats, tol: float) -> list[Cell]:
    """The cell itself when it does not meet the interior of A x <= b, else its pieces outside."""
    pieces: list[Cell] = []
    inside = cell
    while True:
        heights = inside.vertices @ A.T - b
        if (heights.min(axis=0) >= -tol).any():
            return [cell]
        reach = heights.max(axis=0)
        if not reach.size or reach.max() <= tol:
            return pieces
        cut = int(reach.argmax())
        inside, beyond = inside.split(-1, heights[:, cut], tol)
        pieces.append(beyond)


def _cell(points: Floats) -> Cell:
    """A full-dimensional hull as vertices with the facets that each lies on."""
    body = Polytope.from_vertices(points)
    masks = [sum(1 << facet for facet in np.flatnonzero(row).tolist()) for row in body.incidence]
    return Cell(body.vertices(), masks, [(-1, 1)] * len(body.b))
