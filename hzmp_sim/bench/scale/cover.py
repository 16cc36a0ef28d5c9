"""Whether leaves and obstacles together fill the workspace exactly: by volumes, and by points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ragged import owners_of, starts_of
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.free_space.boxes import overlapping_bounds
from hzmp_planners.free_space.cells import UNNAMED, Cells, clip, join_cells
from hzmp_planners.free_space.polygons import Polygons
from hzmp_planners.free_space.polyhedra import Polyhedra
from hzmp_planners.sets import Polytope
from hzmp_sim.bench.scale.naive import halfspaces, outside, tolerance, workspace
from hzmp_sim.bench.worlds import World


def cover_error(world: World, space: FreeSpace) -> float:
    """By how much leaves and obstacles together miss the volume of the workspace, relative."""
    whole = float(np.prod(world.hi - world.lo))
    return abs(space.volume + union_volume(world.lo, world.hi, world.obstacles) - whole) / whole


def misplaced_points(world: World, space: FreeSpace, X: Floats) -> int:
    """How many of the points (k, n) the leaves and the obstacles do not tell apart.

    A point of the workspace must be in a leaf or inside an obstacle, never in both. Points within
    1e-6 of the workspace's largest coordinate of an obstacle's boundary may be in both.
    """
    X = X[X[:, 0].argsort()]
    depth = np.full(len(X), -np.inf)
    for obstacle in world.obstacles:
        low, high = obstacle.interval_hull()
        first, last = np.searchsorted(X[:, 0], (low[0], high[0]))
        inside = (obstacle.b - X[first:last] @ obstacle.A.T).min(axis=1)
        depth[first:last] = np.maximum(depth[first:last], inside)
    clear = np.abs(depth) > 1e-6 * float(np.abs([world.lo, world.hi]).max())
    return int((space.contains(X) != (depth < 0.0))[clear].sum())


def union_volume(lo: Floats, hi: Floats, obstacles: Sequence[Polytope]) -> float:
    """Volume (area in 2-D) that obstacles take of a box, overlaps counted once [m^n].

    Each obstacle is clipped to the box and loses what those before it have; the volumes of what is
    left add up. Neither leaves nor the planner's decomposition have a part in it.
    """
    if not obstacles:
        return 0.0
    tol = tolerance(lo, hi)
    A, b = halfspaces(obstacles)
    real = np.isfinite(b)
    cells, owner = clip(
        workspace(lo, hi, len(obstacles)),
        A[real],
        b[real],
        np.full(int(real.sum()), UNNAMED),
        starts_of(real.sum(axis=1)),
        tol,
    )
    low, high = (np.zeros((len(obstacles), lo.size)) for _ in range(2))
    low[owner], high[owner] = cells.bounds
    for rival in _rivals(low, high, tol):
        against = rival[owner]
        least, most = cells.bounds
        meets = (least < high[against] - tol) & (most > low[against] + tol)
        asked = ((against >= 0) & meets.all(axis=1)).nonzero()[0]
        if not len(asked):
            continue
        pieces, of, met = outside(cells.take(asked), A[against[asked]], b[against[asked]], tol)
        kept = np.ones(len(cells), dtype=np.bool_)
        kept[asked[met]] = False
        rest = kept.nonzero()[0]
        owner = np.concatenate([owner[rest], owner[asked[of]]])
        cells = join_cells([cells.take(rest), pieces])
    return math.fsum(volumes(cells).tolist())


def _rivals(low: Floats, high: Floats, tol: float) -> Iterator[Ints]:
    """An earlier obstacle with overlapping bounds for each, -1 for none, until all had their turn.

    Args:
        low: lowest coordinates of each obstacle, shape (m, n) [m].
        high: highest coordinates [m].
        tol: overlaps up to this do not count [m].
    """
    one, two = overlapping_bounds(low, high, low, high, tol)
    later, earlier = one[two < one], two[two < one]
    counts = np.bincount(later, minlength=len(low))
    place = np.arange(len(later)) - starts_of(counts)[later]
    for turn in range(int(counts.max(initial=0))):
        rival = np.full(len(low), -1)
        rival[later[place == turn]] = earlier[place == turn]
        yield rival


def volumes(cells: Cells) -> Floats:
    """Volume (area in 2-D) of each cell, shape (m,) [m^n].

    A polyhedron is cut into tetrahedra from its centre to the centre of each facet and an edge of
    it, a polygon into triangles from its centre.
    """
    centre = _means(cells.vertices, cells.vertex_owner, len(cells))
    if isinstance(cells, Polygons):
        owner = cells.vertex_owner
        one, two = cells.vertices, cells.vertices[cells.following]
        spokes = np.stack([one - centre[owner], two - centre[owner]], axis=1)
    elif isinstance(cells, Polyhedra):
        facet, edge = cells.edge_facets.ravel(), np.tile(cells.edges, 2)
        ends = cells.vertices[edge]
        middle = _means(ends.reshape(-1, 3), np.tile(facet, 2), len(cells.facets))
        owner = np.tile(owners_of(cells.edge_starts), 2)
        spokes = np.stack([middle[facet], *ends], axis=1) - centre[owner][:, None]
    else:
        raise TypeError(f"cells of {type(cells).__name__}")
    parts = np.abs(np.linalg.det(spokes)) / math.factorial(cells.vertices.shape[1])
    return np.bincount(owner, parts, minlength=len(cells)).astype(np.float64)


def _means(points: Floats, owner: Ints, count: int) -> Floats:
    """The mean of the points of each owner, shape (count, n)."""
    sums = [np.bincount(owner, axis, minlength=count) for axis in points.T]
    held = np.maximum(np.bincount(owner, minlength=count), 1)
    return np.asarray(np.stack(sums, axis=1) / held[:, None])
