"""Cutting a convex cell with a plane: the double description of vertices and facets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Floats

Facet = tuple[int, int]
"""(plane, side): the half-space side * (a.x - b) <= 0 of that plane."""


@dataclass(eq=False, slots=True)
class Cell:
    """Convex cell under construction.

    Bit j of `incidence[i]` says that vertex i lies on facet j. Facets that a later cut has reduced
    to a vertex or an edge stay in the list; they are harmless and dropped by `build_complex`.
    """

    vertices: Floats
    """Shape (k, n) [m]."""
    incidence: list[int]
    facets: list[Facet]

    def split(self, plane: int, heights: Floats, tol: float) -> tuple[Cell, Cell]:
        """Cut by a plane that has vertices strictly on both sides.

        Args:
            plane: its number in the plane table.
            heights: a.v - b of every vertex, shape (k,) [m].
            tol: vertices within this height lie on the plane [m].

        Returns:
            The part below (a.x <= b) and the part above.
        """
        height = heights.tolist()
        below = [i for i, h in enumerate(height) if h < -tol]
        above = [i for i, h in enumerate(height) if h > tol]
        on = [i for i, h in enumerate(height) if -tol <= h <= tol]
        masks = self.incidence
        ends: list[tuple[int, int]] = []
        common_masks: list[int] = []
        needed = self.vertices.shape[1] - 1
        for i in below:
            for j in above:
                common = masks[i] & masks[j]
                if common.bit_count() < needed:
                    continue
                # i-j is an edge iff no third vertex lies on all facets that both lie on.
                holders = 0
                for mask in masks:
                    if mask & common == common:
                        holders += 1
                        if holders > 2:
                            break
                if holders == 2:
                    ends.append((i, j))
                    common_masks.append(common)
        lower = np.array([i for i, _ in ends], dtype=np.intp)
        upper = np.array([j for _, j in ends], dtype=np.intp)
        t = (heights[lower] / (heights[lower] - heights[upper]))[:, None]
        fresh = self.vertices[lower] * (1.0 - t) + self.vertices[upper] * t
        bit = 1 << len(self.facets)
        shared_vertices = np.vstack([self.vertices[on], fresh])
        shared_masks = [masks[i] | bit for i in on] + [mask | bit for mask in common_masks]
        parts = []
        for kept, side in ((below, 1), (above, -1)):
            parts.append(
                Cell(
                    np.vstack([self.vertices[kept], shared_vertices]),
                    [masks[i] for i in kept] + shared_masks,
                    [*self.facets, (plane, side)],
                )
            )
        return parts[0], parts[1]
