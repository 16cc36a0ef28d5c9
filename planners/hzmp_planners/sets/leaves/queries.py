"""What is asked of all leaves of a union together."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Bools, Floats
from hzmp_planners.constants import SET_TOL
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope
from hzmp_planners.sets.hulls.subtraction import subtract
from hzmp_planners.sets.polytope import Polytope

if TYPE_CHECKING:
    from hzmp_planners.sets.base import Set
    from hzmp_planners.sets.hybrid_zonotope import HybridZonotope


def contains(union: HybridZonotope, points: Floats, tol: float | None) -> Bools:
    """Which of the points (k, n) lie in some leaf: only leaves whose box holds one are asked."""
    table = union.leaf_table
    inside = np.zeros(len(points), dtype=np.bool_)
    if not len(table):
        return inside
    lo, hi = table.stack.boxes
    room = SET_TOL * float(np.abs([lo, hi]).max()) if tol is None else tol
    for start in range(0, len(points), 256):
        block = points[start : start + 256]
        beyond = np.maximum(lo - block[:, None], block[:, None] - hi).max(axis=2)
        near: Bools = np.asarray(beyond <= room)
        for leaf in np.flatnonzero(near.any(axis=0)).tolist():
            rows = start + np.flatnonzero(near[:, leaf])
            rows = rows[~inside[rows]]
            if len(rows):
                inside[rows] = table.part(leaf).contains(points[rows], tol)
    return inside


def nearest_point(union: HybridZonotope, point: Floats) -> Floats:
    """Leaves are tried in the order of their boxes' distances, until none can be nearer."""
    if not len(union.leaf_table):
        raise ShapeError("an empty set has no nearest point")
    best, least = point, math.inf
    bounds = box_distances(union, (point, point))
    for leaf in np.argsort(bounds, kind="stable").tolist():
        if bounds[leaf] >= least:
            break
        candidate = union.leaf_table.part(leaf).project(point)
        if (gap := math.dist(candidate, point)) < least:
            best, least = candidate, gap
    return best


def distance(union: HybridZonotope, other: Set) -> float:
    """Least distance of a leaf and a convex part of the other set [m]; inf when one is empty."""
    if other.n != union.n:
        raise ShapeError(f"sets of dimensions {union.n} and {other.n} share no points")
    least = math.inf
    if union.is_empty():
        return least
    for part in other.convex_parts():
        if part.is_empty():
            continue
        bounds = box_distances(union, part.interval_hull())
        for leaf in np.argsort(bounds, kind="stable").tolist():
            if bounds[leaf] >= least:
                break
            least = min(least, union.leaf_table.part(leaf).distance(part))
    return least


def outermost(union: HybridZonotope) -> list[ConstrainedZonotope]:
    """Leaves that no other leaf contains; of equal ones the last."""
    leaves = union.leaves()
    if not leaves:
        return []
    lo, hi = union.leaf_table.stack.boxes
    kept = np.ones(len(leaves), dtype=np.bool_)
    for i, leaf in enumerate(leaves):
        room = SET_TOL * leaf.form.size
        around = kept & (lo <= lo[i] + room).all(axis=1) & (hi >= hi[i] - room).all(axis=1)
        around[i] = False
        holders = np.flatnonzero(around).tolist()
        kept[i] = not any(leaves[j].contains_set(leaf) for j in holders)
    return [leaves[i] for i in np.flatnonzero(kept).tolist()]


def box_distances(union: HybridZonotope, box: tuple[Floats, Floats]) -> Floats:
    """Distance of a box (lo, hi) to the box of each leaf [m], shape (N,)."""
    lo, hi = union.leaf_table.stack.boxes
    gap = np.maximum(0.0, np.maximum(lo - box[1], box[0] - hi))
    return np.asarray(np.linalg.norm(gap, axis=1))


def remainder(body: Polytope, union: HybridZonotope) -> list[Polytope]:
    """Convex pieces of the body outside all leaves."""
    if not len(union.leaf_table):
        return [body]
    room = SET_TOL * body.form.size
    near = np.flatnonzero(box_distances(union, body.interval_hull()) <= room)
    return subtract(body, (union.leaf_table.part(i).to_polytope() for i in near.tolist()))


def disjoint_pieces(union: HybridZonotope) -> list[Polytope]:
    """Convex pieces with disjoint interiors whose union is the union of the leaves."""
    pieces: list[Polytope] = []
    leaves = [leaf.to_polytope() for leaf in union.leaves()]
    if not leaves:
        return []
    lo, hi = union.leaf_table.stack.boxes
    for i, leaf in enumerate(leaves):
        near = (lo[:i] < hi[i]).all(axis=1) & (hi[:i] > lo[i]).all(axis=1)
        if near.any():
            pieces += subtract(leaf, (leaves[j] for j in np.flatnonzero(near).tolist()))
        else:
            pieces.append(leaf)
    return pieces


def sample(union: HybridZonotope, count: int, rng: np.random.Generator) -> Floats:
    """Uniform points of the leaves of largest dimension; see `HybridZonotope.sample`."""
    leaves = union.leaves()
    if not leaves:
        raise ShapeError("an empty set has no points to sample")
    dimensions = [leaf.affine_dimension() for leaf in leaves]
    top = [leaf for leaf, d in zip(leaves, dimensions, strict=True) if d == max(dimensions)]
    measures = np.array([_measure(leaf) for leaf in top])
    lo = np.array([leaf.interval_hull()[0] for leaf in top])
    hi = np.array([leaf.interval_hull()[1] for leaf in top])
    kept = [np.zeros((0, union.n))]
    found = 0
    while found < count:
        drawn = np.bincount(rng.choice(len(top), count - found, p=measures / measures.sum()))
        blocks = [top[i].sample(int(k), rng) for i, k in enumerate(drawn.tolist()) if k]
        points = np.concatenate(blocks)
        holders = np.zeros(len(points))
        for i, leaf in enumerate(top):
            near = ((points >= lo[i]) & (points <= hi[i])).all(axis=1)
            holders[near] += leaf.contains(points[near])
        points = points[rng.random(len(points)) * np.maximum(holders, 1.0) < 1.0]
        kept.append(points)
        found += len(points)
    return rng.permutation(np.concatenate(kept)[:count])


def _measure(leaf: ConstrainedZonotope) -> float:
    """Volume in the leaf's own affine hull; 1 for a point."""
    hull = leaf.affine_hull()
    if not len(hull.basis):
        return 1.0
    flat = (leaf.hull_points() - hull.point) @ hull.basis.T
    return Polytope.from_vertices(flat).volume()
