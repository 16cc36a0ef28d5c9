"""Walls for leaves so thin that round-off has taken some of theirs."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ragged import extents, reduced
from hzmp_planners.free_space.complexes import Complex
from hzmp_planners.free_space.planes import PlaneTable


def fences(whole: Complex, table: PlaneTable, thin: float) -> tuple[Ints, Floats, Floats]:
    """Half-spaces across splinters, that end them where their vertices do.

    Between two planes that nearly coincide a leaf can be thinner than the tolerances allow its end
    walls to be told from vertices; without them it would reach as far as the planes do. The fences
    of such a leaf are a box along its principal axes, and stand on the edges of its outline, seen
    along the thinnest of these.

    Args:
        whole: the leaves.
        table: the planes of their facets.
        thin: leaves thinner than this [m] get fences.

    Returns:
        The leaf of each fence, ascending, and its outward unit normal and offset [m].
    """
    leaves = (_thickness(whole, table) < thin).nonzero()[0]
    starts = whole.members[1]
    found: list[tuple[int, Floats, float]] = []
    for leaf in leaves.tolist():
        points = whole.corners[starts[leaf] : starts[leaf + 1]]
        centre = points.mean(axis=0)
        _, _, axes = np.linalg.svd(points - centre)
        flat = axes[:-1]  # all directions but the thinnest
        outline = _outward(np.asarray((points - centre) @ flat.T)) @ flat
        for normal in (*axes, *-axes, *outline):
            found.append((leaf, normal, float((points @ normal).max())))
    rows = np.array([leaf for leaf, _, _ in found], dtype=np.int64)
    normals = np.array([normal for _, normal, _ in found]).reshape(-1, whole.n)
    return rows, normals, np.array([offset for _, _, offset in found])


def _thickness(whole: Complex, table: PlaneTable) -> Floats:
    """The least extent of each leaf at right angles to one of its facets, shape (N,) [m]."""
    A, _ = table.halfspaces(whole.facets)
    lowest, highest = extents(whole.corners, whole.members[1], whole.facet_owner, A)
    return reduced(np.minimum, highest - lowest, whole.leaf_starts)


def _outward(points: Floats) -> Floats:
    """Outward unit normals of the hull of points in the plane; none of a line or a needle."""
    if points.shape[1] == 1:
        return np.zeros((0, 1))
    try:
        return np.asarray(ConvexHull(points).equations[:, :-1])
    except QhullError:
        return np.zeros((0, 2))
