"""updateReachableSet: algorithm 2 of the paper.

Every path of length <= c stays in the ellipsotope E(c) = {x : |x - s| + |x - g| <= c} (lemma 3.6).
f(x) = |x - s| + |x - g| is convex. So a face meets E iff f* = min over it of f is at most c, and
both a face and a leaf are inside of E iff f is at most c at all vertices. Neither minimum nor
maximum depends on c: they are computed once, and each better cost costs comparisons.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.free_space import FreeSpace, LeafGraph
from hzmp_planners.planning.roadmap import Query
from hzmp_planners.sets import Activity, Ellipsotope

_ROUND_OFF = 1e-12  # relative: what is just as long as the best path is kept


@dataclass(frozen=True, eq=False)
class Detours:
    """Least and greatest f over faces and leaves [m]: all that depends on start and goal."""

    face_least: Floats
    """f* of each face, shape (F,)."""
    face_most: Floats
    """Greatest f at a vertex of each face, shape (F,)."""
    leaf_least: Floats
    """f* of the faces of each leaf, shape (N,); |g - s| for the leaves of start and goal."""
    leaf_most: Floats
    """Greatest f at a vertex of each leaf, shape (N,)."""

    @classmethod
    def of(cls, space: FreeSpace, query: Query, face_least: Floats) -> Detours:
        """For a query.

        Args:
            space: the free space.
            query: start and goal.
            face_least: f* of each face, shape (F,) [m] (`least_detour`).
        """
        graph = space.graph
        leaf_least = np.full(graph.leaf_count, np.inf)
        np.minimum.at(leaf_least, graph.ends.ravel(), face_least.repeat(2))
        ends = np.concatenate([query.start_leaves, query.goal_leaves])
        leaf_least[ends] = np.linalg.norm(query.goal - query.start)
        incidence = space.incidence
        vertices = _sum_of_distances(space.vertices, query)[incidence.indices]
        return cls(
            face_least,
            _sum_of_distances(graph.corners, query).max(axis=1),
            leaf_least,
            np.asarray(np.maximum.reduceat(vertices, incidence.indptr[:-1])),
        )


def _sum_of_distances(points: Floats, query: Query) -> Floats:
    """Values of f at points (..., n) [m]."""
    ahead = np.linalg.norm(points - query.start, axis=-1)
    return np.asarray(ahead + np.linalg.norm(points - query.goal, axis=-1))


@dataclass(frozen=True, eq=False)
class ReachableSet:
    """What algorithm 2 returns, but for the paths: E, L_E and A_E."""

    informed: Ellipsotope | None
    """E(c_best); None as long as there is no path: then it is the whole space."""
    faces: NDArray[np.int8]
    """`Activity` of each shared face, shape (F,). A_E has those that are not inactive."""
    leaves: NDArray[np.int8]
    """`Activity` of each leaf, shape (N,). L_E has those that are not inactive."""

    @classmethod
    def everything(cls, graph: LeafGraph) -> ReachableSet:
        """Before the first path."""
        kinds = (np.full(m, Activity.ACTIVE, dtype=np.int8) for m in (len(graph), graph.leaf_count))
        return cls(None, *kinds)


def update_reachable_set(query: Query, cost: float, detours: Detours) -> ReachableSet:
    """Lines 1 to 10 of algorithm 2: the ellipsotope of a cost, and what it leaves of the graph.

    A leaf that E meets but none of whose shared faces it meets is inactive here: a path shorter
    than `cost` would have to enter through one of them. (The paper keeps it in L_E. That changes
    nothing: what it could be used by is gone from A_E.)

    Args:
        query: start and goal.
        cost: c_best, at least |g - s| [m].
        detours: of the query.
    """
    informed = Ellipsotope.informed(query.start, query.goal, cost)  # d, c, a, b, Q: lines 1 to 8
    limit = cost * (1.0 + _ROUND_OFF)
    faces = _activity(detours.face_least <= limit, detours.face_most <= limit)
    leaves = _activity(detours.leaf_least <= limit, detours.leaf_most <= limit)
    return ReachableSet(informed, faces, leaves)


def _activity(met: Bools, inside: Bools) -> NDArray[np.int8]:
    kinds = np.where(inside, Activity.ACTIVE, Activity.PARTIAL)
    return np.where(met, kinds, Activity.INACTIVE).astype(np.int8)


def remaining_faces(reachable: ReachableSet) -> Ints:
    """Numbers of the faces in A_E."""
    return np.flatnonzero(reachable.faces != Activity.INACTIVE)
