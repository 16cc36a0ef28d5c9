"""One table of all planes of a world, so that coinciding facets are one plane by identity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hzmp_planners._arrays import Floats, frozen
from hzmp_planners._cell import Facet
from hzmp_planners._links import component_labels
from hzmp_planners.constants import NORMAL_TOL, PLANE_TOL
from hzmp_planners.sets import Polytope


@dataclass(frozen=True, eq=False)
class PlaneTable:
    """Distinct planes a.x = b and the facets of every polytope in terms of them."""

    normals: Floats
    """Unit normals, shape (p, n)."""
    offsets: Floats
    """Offsets [m], shape (p,)."""
    facets: tuple[tuple[Facet, ...], ...]
    """Facets of each polytope that was given, in the same order."""


def build_plane_table(polytopes: Sequence[Polytope], scale: float) -> PlaneTable:
    """Cluster the facet planes of all polytopes; opposite half-spaces share a plane.

    Touching boxes, repeated obstacles and obstacles on the workspace wall would otherwise produce
    planes that differ by round-off, and leaves as thin as that.
    """
    A = np.vstack([p.A for p in polytopes])
    b = np.concatenate([p.b for p in polytopes])
    count = len(b)
    # Both orientations of every plane are points of one set; those within tolerance are one.
    keys = np.hstack([A, (b / scale)[:, None]])
    keys = np.vstack([keys, -keys])
    pairs = cKDTree(keys).query_pairs(max(NORMAL_TOL, 10.0 * PLANE_TOL), output_type="ndarray")
    labels = component_labels(pairs, 2 * count)
    plane_of: dict[int, Facet] = {}
    representatives: list[int] = []
    table: list[Facet] = []
    for row in range(count):
        facet = plane_of.get(int(labels[row]))
        if facet is None:
            facet = (len(representatives), 1)
            representatives.append(row)
            plane_of[int(labels[row])] = facet
            plane_of[int(labels[row + count])] = (facet[0], -1)
        table.append(facet)
    sizes = np.cumsum([len(p.b) for p in polytopes])
    groups = [
        tuple(dict.fromkeys(table[stop - len(p.b) : stop]))
        for p, stop in zip(polytopes, sizes, strict=True)
    ]
    return PlaneTable(frozen(A[representatives]), frozen(b[representatives]), tuple(groups))
