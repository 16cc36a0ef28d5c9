"""Convex solids on 3-D axes of matplotlib, each hidden by those in front of it.

Matplotlib sorts polygons by their mean depth, which shows faces that something hides. Convex solids
apart from each other have a better order: where a plane separates two, the one on the eye's side
comes later.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.collections import PolyCollection

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import owners_of, starts_of

Rgba = tuple[float, float, float, float]

_LIGHT = np.array([0.30, -0.52, 0.80])  # where the light comes from, of length 1
_AMBIENT = 0.76
_BLOCK = 256  # facets looked at together


class Solid(NamedTuple):
    """What to draw of a convex solid, or of a flat polygon given once for each of its sides."""

    facets: list[Floats]
    """Corners of each facet in order, shape (k, 3); at least one facet."""
    normals: Floats
    """Outward unit normals of the facets, shape (m, 3)."""
    fill: Rgba
    edge: Rgba


class Solids(PolyCollection):
    """Convex solids with shaded facets; of opaque ones only the sides towards the eye are drawn.

    Add it to 3-D axes with ``add_collection(solids, autolim=False)``.
    """

    def __init__(self, solids: Sequence[Solid], **style: Any) -> None:
        super().__init__([], closed=True, **style)
        self.facets = [facet for solid in solids for facet in solid.facets]
        self._pile = _Pile(solids)
        light = _AMBIENT + (1.0 - _AMBIENT) * (self._pile.normals @ _LIGHT)
        fills = np.array([solid.fill for solid in solids]).reshape(-1, 4)[self._pile.owner]
        fills[:, :3] *= light[:, None]
        self._fills = fills.clip(0.0, 1.0)
        self._rims = np.array([solid.edge for solid in solids]).reshape(-1, 4)[self._pile.owner]

    def do_3d_projection(self) -> float:
        """Project and sort for the view of the axes; returns the nearest depth, as these expect."""
        if not self.facets:
            return 0.0
        axes: Any = self.axes
        seen, rank, flat, depth = self._pile.view(axes.get_proj())
        # Of one solid, the sides away from the eye come first; opaque ones do without.
        drawn = (seen | (self._fills[:, 3] < 1.0)).nonzero()[0]
        drawn = drawn[np.lexsort((seen[drawn], rank[drawn]))]
        starts = self._pile.corner_starts
        self.set_verts([flat[starts[i] : starts[i + 1]] for i in drawn.tolist()])
        self.set_facecolor(list(map(tuple, self._fills[drawn].tolist())))
        self.set_edgecolor(list(map(tuple, self._rims[drawn].tolist())))
        return depth


class _Pile:
    """Solids as arrays, and their order from back to front."""

    def __init__(self, solids: Sequence[Solid]) -> None:
        facets = [facet for solid in solids for facet in solid.facets]
        self.starts = starts_of(np.array([len(solid.facets) for solid in solids], dtype=np.int64))
        self.owner = owners_of(self.starts)
        self.corners = np.concatenate([np.zeros((0, 3)), *facets])
        self.corner_starts = starts_of(np.array([len(facet) for facet in facets], dtype=np.int64))
        self.normals = np.concatenate([np.zeros((0, 3)), *(solid.normals for solid in solids)])
        middles = np.array([facet.mean(axis=0) for facet in facets]).reshape(-1, 3)
        self.offsets = np.einsum("ij,ij->i", self.normals, middles)
        self.first = self.corner_starts[self.starts[:-1]]  # corner of each solid
        self.clear = self._separations()

    def _separations(self) -> Bools:
        """Whether solid j lies beyond the plane of facet i, shape (facets, solids)."""
        clear = np.zeros((len(self.normals), len(self.first)), dtype=np.bool_)
        if not len(self.first):
            return clear
        tol = 1e-9 * float(np.ptp(self.corners, axis=0).max())
        for begin in range(0, len(clear), _BLOCK):
            rows = slice(begin, begin + _BLOCK)
            heights = self.normals[rows] @ self.corners.T
            nearest = np.minimum.reduceat(heights, self.first, axis=1)
            clear[rows] = nearest >= self.offsets[rows, None] - tol
        return clear

    def view(self, projection: Floats) -> tuple[Bools, Ints, Floats, float]:
        """What a projection matrix (4, 4) makes of the solids.

        Returns:
            Which facets show the eye their outer side, the place of each facet's solid in the order
            of drawing, the corners in the plane (k, 2), and the smallest depth.
        """
        seen = self._seen(projection)
        points = np.column_stack([self.corners, np.ones(len(self.corners))]) @ projection.T
        points = points[:, :3] / points[:, 3:]
        flat, depth = points[:, :2], points[:, 2]
        counts = np.diff(np.append(self.first, len(depth)))
        order = self._order(seen, flat, np.add.reduceat(depth, self.first) / counts)
        rank = np.empty(len(order), dtype=np.int64)
        rank[order] = np.arange(len(order))
        return seen, rank[self.owner], flat, float(depth.min())

    def _seen(self, projection: Floats) -> Bools:
        # The eye, in homogeneous coordinates, is what the projection sends to (0, 0, ?, 0).
        eye = np.linalg.svd(projection[[0, 1, 3]])[2][3]
        heights = self.normals @ eye[:3] - self.offsets * eye[3]
        if abs(eye[3]) > 1e-9 * np.abs(eye).max():
            return np.asarray(heights * np.sign(eye[3]) > 0.0)
        towards = -np.sign(projection[2, :3] @ eye[:3])  # parallel rays: depth grows away
        return np.asarray(heights * towards > 0.0)

    def _order(self, seen: Bools, flat: Floats, depth: Floats) -> Ints:
        """The solids from back to front; where planes give no order, by depth."""
        low, high = np.minimum.reduceat(flat, self.first), np.maximum.reduceat(flat, self.first)
        meet = np.all((low[:, None] < high) & (low < high[:, None]), axis=2)
        begins = self.starts[:-1]
        ahead = np.logical_or.reduceat(self.clear & seen[:, None], begins, axis=0)
        behind = np.logical_or.reduceat(self.clear & ~seen[:, None], begins, axis=0)
        # later[i, j]: j must be drawn after i.
        later = meet & (ahead | behind.T) & ~(behind | ahead.T)
        waits = later.sum(axis=0)
        open_ = np.ones(len(depth), dtype=np.bool_)
        ready = [(-depth[i], i) for i in (waits == 0).nonzero()[0].tolist()]
        heapq.heapify(ready)
        order: list[int] = []
        while len(order) < len(depth):
            if ready:
                _, i = heapq.heappop(ready)
            else:  # a cycle: the farthest one first
                rest = open_.nonzero()[0]
                i = int(rest[depth[rest].argmax()])
            open_[i] = False
            order.append(i)
            waits -= later[i]
            for j in (later[i] & (waits == 0) & open_).nonzero()[0].tolist():
                heapq.heappush(ready, (-depth[j], j))
        return np.array(order, dtype=np.int64)
