"""Which leaves an ellipsotope can reach: the pruning step of HZ-MP (lemma 3.6)."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.constants import SET_TOL
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.convex_set import ConvexSet
from hzmp_planners.sets.hybrid_zonotope import HybridZonotope
from hzmp_planners.sets.leaves.leaf_table import StackedPoints

if TYPE_CHECKING:
    from hzmp_planners.sets.ellipsotope import Ellipsotope

_ROUNDS = 24  # of Frank-Wolfe: what is left after them is decided by a program


class Activity(enum.IntEnum):
    """How a leaf lies to the informed set."""

    INACTIVE = 0
    """No common point: no shorter path passes through."""
    PARTIAL = 1
    """Some of its points are in the set."""
    ACTIVE = 2
    """All of its points are in the set."""


def classify(
    informed: Ellipsotope, leaves: HybridZonotope | Sequence[ConvexSet]
) -> NDArray[np.int8]:
    """Activity of each leaf, shape (N,); a leaf that touches the set is at least partial.

    In the coordinates of the ellipsoid, where it is the unit ball, a leaf is active iff its
    vertices are in the ball, and inactive iff the point of it nearest to the centre is outside.
    For all leaves at once: vertices, boxes, then Frank-Wolfe steps towards the nearest point, each
    of which gives an upper and a lower bound of its distance. Leaves that these do not settle, and
    all leaves when the set is no ellipsoid with interior, are intersected with it exactly.

    Args:
        informed: any ellipsotope.
        leaves: polytopal leaves.

    Raises:
        ShapeError: another dimension, an empty or a curved leaf.
        SolverError: no verdict that holds.
    """
    if isinstance(leaves, HybridZonotope):
        stack, dimensions = leaves.leaf_table.stack, {leaves.n}
    else:
        stack, dimensions = _stacked(leaves), {leaf.n for leaf in leaves}
    if dimensions - {informed.n}:
        raise ShapeError(f"the leaves have dimensions {dimensions}, the ellipsotope {informed.n}")
    count = len(stack.starts)
    found = np.full(count, Activity.INACTIVE, dtype=np.int8)
    if not count or informed.is_empty():
        return found
    axes = np.linalg.svd(informed.form.G, compute_uv=False) if informed.ng else np.zeros(1)
    round_ = informed.form.is_ellipsoid and informed.ng >= informed.n
    if not round_ or axes.min() <= 1e-7 * axes.max():
        undecided = np.arange(count)
    else:
        undecided = _classify_in_ball(informed, stack, found)
    members = leaves.leaves() if len(undecided) and isinstance(leaves, HybridZonotope) else leaves
    for i in undecided.tolist():
        assert not isinstance(members, HybridZonotope)
        leaf = members[i]
        if informed.contains(leaf.hull_points()).all():
            found[i] = Activity.ACTIVE
        elif not informed.intersection(leaf).is_empty():
            found[i] = Activity.PARTIAL
    return found


def _stacked(leaves: Sequence[ConvexSet]) -> StackedPoints:
    points = [leaf.hull_points() for leaf in leaves]
    counts = np.array([len(block) for block in points], dtype=np.int64)
    if (counts == 0).any():
        raise ShapeError(f"leaf {int(np.argmin(counts))} is empty")
    stacked = np.concatenate(points) if points else np.zeros((0, 0))
    return StackedPoints(stacked, np.cumsum(counts) - counts)


def _classify_in_ball(informed: Ellipsotope, stack: StackedPoints, found: NDArray[np.int8]) -> Ints:
    """Fill in what the bounds settle; returns the indices of the other leaves."""
    outward = np.linalg.pinv(informed.form.G)
    inside = (stack.points - informed.form.c) @ outward.T
    squares = np.einsum("ij,ij->i", inside, inside)
    limit = (1.0 + SET_TOL) ** 2
    found[np.minimum.reduceat(squares, stack.starts) <= limit] = Activity.PARTIAL
    found[np.maximum.reduceat(squares, stack.starts) <= limit] = Activity.ACTIVE
    lo, hi = StackedPoints(inside, stack.starts).boxes
    gap = np.maximum(0.0, np.maximum(lo, -hi))
    near = np.einsum("ij,ij->i", gap, gap) <= limit
    return _frank_wolfe(inside, stack, np.flatnonzero(near & (found == Activity.INACTIVE)), found)


def _frank_wolfe(
    points: Floats, stack: StackedPoints, open_: Ints, found: NDArray[np.int8]
) -> Ints:
    """Steps towards the point of each open leaf that is nearest to 0, until all are settled."""
    limit = 1.0 + SET_TOL
    position = np.full(len(stack.starts), -1)
    position[open_] = np.arange(len(open_))
    rows = np.flatnonzero(position[stack.owners] >= 0)
    corner, owner = points[rows], position[stack.owners[rows]]
    x = _first_minima(corner, np.einsum("ij,ij->i", corner, corner), owner, len(open_))
    index = open_
    for _ in range(_ROUNDS):
        if not len(index):
            break
        heights = np.einsum("ij,ij->i", corner, x[owner])
        target = _first_minima(corner, heights, owner, len(index))
        length = np.linalg.norm(x, axis=1)
        lowest = np.einsum("ij,ij->i", target, x) / length  # every point is at least this far out
        step = target - x
        share = np.clip(
            -np.einsum("ij,ij->i", x, step) / np.maximum(np.einsum("ij,ij->i", step, step), 1e-300),
            0.0,
            1.0,
        )
        x = x + share[:, None] * step
        reached = np.linalg.norm(x, axis=1) <= limit
        found[index[reached]] = Activity.PARTIAL
        stay = ~reached & (lowest <= limit)
        index, x, corner, owner = _narrowed(stay, index, x, corner, owner)
    return index


def _first_minima(corner: Floats, values: Floats, owner: Ints, count: int) -> Floats:
    """For each owner (they are sorted) its corner with the least value, shape (count, n)."""
    if not count:
        return corner[:0]
    starts = np.searchsorted(owner, np.arange(count))
    least = np.minimum.reduceat(values, starts)
    hits = np.flatnonzero(values <= least[owner])
    _, first = np.unique(owner[hits], return_index=True)
    return np.asarray(corner[hits[first]])


def _narrowed(
    stay: Bools, index: Ints, x: Floats, corner: Floats, owner: Ints
) -> tuple[Ints, Floats, Floats, Ints]:
    renumbered = np.cumsum(stay) - 1
    rows = stay[owner]
    return index[stay], x[stay], corner[rows], renumbered[owner[rows]]
