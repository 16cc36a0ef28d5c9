"""The plain way to decompose free space, to compare with: one obstacle after the other.

Every cell that an obstacle really meets is cut by the planes of the obstacle's facets; each part
outside is kept as a cell, and the rest is cut by the next plane. Cells are never merged. Of the
planner only the arrays of cells are used, and the cut of a cell by a plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import reduced
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.free_space.boxes import box_cell
from hzmp_planners.free_space.cells import UNNAMED, Cells, join_cells
from hzmp_planners.sets import Polytope

Order = Literal["given", "reach"]
"""Facets in the order of the obstacle; or at each cut the one that the cell reaches beyond most."""


def naive_cells(
    lo: Floats, hi: Floats, obstacles: Sequence[Polytope], order: Order = "given"
) -> list[Cells]:
    """The cells that the naive way makes of a box minus obstacles, in batches.

    Args:
        lo: lower corner of the box, shape (n,) [m].
        hi: upper corner [m].
        obstacles: each has an interior.
        order: of the facets of one obstacle.
    """
    tol = tolerance(lo, hi)
    batches = [workspace(lo, hi)]
    low, high = batches[0].bounds
    place = np.zeros((1, 2), dtype=np.int64)  # batch and row of each cell
    for obstacle in obstacles:
        least, most = obstacle.interval_hull()
        near = np.flatnonzero((low < most - tol).all(axis=1) & (high > least + tol).all(axis=1))
        near = near[place[near, 0].argsort(kind="stable")]
        if not len(near):
            continue
        cells = join_cells(
            [
                batches[batch].take(place[near, 1][place[near, 0] == batch])
                for batch in np.unique(place[near, 0]).tolist()
            ]
        )
        pieces, _, met = outside(cells, *halfspaces([obstacle] * len(cells)), tol, order)
        if not met.any():
            continue
        kept = np.ones(len(low), dtype=np.bool_)
        kept[near[met]] = False
        fresh = np.column_stack([np.full(len(pieces), len(batches)), np.arange(len(pieces))])
        batches.append(pieces)
        least, most = pieces.bounds
        low, high = np.concatenate([low[kept], least]), np.concatenate([high[kept], most])
        place = np.concatenate([place[kept], fresh])
    return [
        batch.take(place[place[:, 0] == number, 1])
        for number, batch in enumerate(batches)
        if (place[:, 0] == number).any()
    ]


def naive_count(
    lo: Floats, hi: Floats, obstacles: Sequence[Polytope], order: Order = "given"
) -> int:
    """How many cells these are."""
    return sum(len(batch) for batch in naive_cells(lo, hi, obstacles, order))


def outside(
    cells: Cells, A: Floats, b: Floats, tol: float, order: Order = "given"
) -> tuple[Cells, Ints, Bools]:
    """What the cells have outside a convex body each.

    Args:
        cells: m cells.
        A: outward unit normals of each cell's body, shape (m, k, n).
        b: offsets [m], shape (m, k); infinite for rows that stand for nothing.
        tol: nearer to a plane than this is on it [m].
        order: in which order a cell is cut by the planes.

    Returns:
        The parts of the cells that meet their body, the cell of each part, and which do; of cells
        that do not meet theirs there are no parts.
    """
    b = b.copy()
    met = np.zeros(len(cells), dtype=np.bool_)
    origin = np.arange(len(cells))
    parts, owners = [cells.take(origin[:0])], [origin[:0]]
    while len(origin):
        owner = origin[cells.vertex_owner]
        heights = np.einsum("ij,ikj->ik", cells.vertices, A[owner]) - b[owner]
        reach = reduced(np.maximum, heights, cells.vertex_starts)
        facet = reach.argmax(axis=1) if order == "reach" else (reach > tol).argmax(axis=1)
        beyond = reach[np.arange(len(cells)), facet] > tol
        met[origin[~beyond]] = True  # what is left lies inside
        going = beyond.nonzero()[0]
        if not len(going):
            break
        cells, origin, facet = cells.take(going), origin[going], facet[going]
        pieces, row, side = cells.divide(
            np.full((len(cells), 2), UNNAMED),
            A[origin, facet],
            b[origin, facet],
            tol,
            np.ones((len(cells), 2), dtype=np.bool_),
        )
        b[origin, facet] = np.inf
        above, below = (side == 1).nonzero()[0], (side == 0).nonzero()[0]
        parts.append(pieces.take(above))
        owners.append(origin[row[above]])
        cells, origin = pieces.take(below), origin[row[below]]
    owner = np.concatenate(owners)
    real = met[owner].nonzero()[0]
    return join_cells(parts).take(real), owner[real], met


def halfspaces(bodies: Sequence[Polytope]) -> tuple[Floats, Floats]:
    """Half-spaces of m bodies as arrays (m, k, n) and (m, k), for `outside`."""
    most = max((len(body.b) for body in bodies), default=0)
    n = bodies[0].n if bodies else 0
    A, b = np.zeros((len(bodies), most, n)), np.full((len(bodies), most), np.inf)
    for row, body in enumerate(bodies):
        A[row, : len(body.b)], b[row, : len(body.b)] = body.A, body.b
    return A, b


def workspace(lo: Floats, hi: Floats, copies: int = 1) -> Cells:
    """A box as a cell, or as several; nobody asks which planes its facets are on."""
    return box_cell(lo, hi, np.full(2 * lo.size, UNNAMED), copies)


def tolerance(lo: Floats, hi: Floats) -> float:
    """Nearer to a plane than this is on it [m], as in the planner."""
    return PLANE_TOL * float(np.abs([lo, hi]).max())
