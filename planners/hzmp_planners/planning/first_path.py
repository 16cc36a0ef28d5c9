"""A first path at once: best-first search over leaves with one point on each shared face.

A leaf is entered once, through the face that promises the shortest way over it. The string through
the leaves found is then drawn tauter: in the plane all the way.
"""

from __future__ import annotations

import time
from heapq import heappop, heappush
from math import hypot, inf

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.attempt import Attempt, Route
from hzmp_planners.planning.exits import Exits
from hzmp_planners.planning.planar.funnel import taut_string
from hzmp_planners.planning.prepared import prepared
from hzmp_planners.planning.refine import sweep
from hzmp_planners.planning.result import path_length
from hzmp_planners.planning.roadmap import Query

_CHECKED = 16  # leaves between two looks at the clock
_EAGER = 1.05  # weight of the way that is left: a third fewer leaves are looked at than with 1


def offer_first(attempt: Attempt, space: FreeSpace) -> bool:
    """Offer a short path, though seldom the shortest; False when the time is over before that."""
    query, graph = attempt.query, attempt.graph
    found = search_leaves(prepared(space).exits, query, attempt.clock.deadline)
    if found is None:
        return False
    faces, leaves, near = found
    corners = graph.corners[faces]
    if space.n == 2 and space.disjoint:
        ahead = np.where(graph.ends[faces, 1] == leaves[1:], 1.0, -1.0)[:, None]
        points = taut_string(query.start, query.goal, corners, ahead * graph.normals[faces])
    else:
        rough = np.vstack([query.start, near[:, : space.n], query.goal])
        points = sweep(rough[None], corners[None], 1)[0]
    attempt.offer(Route(points, leaves, path_length(points)))
    return True


def search_leaves(
    exits: Exits, query: Query, deadline: float = inf
) -> tuple[Ints, Ints, Floats] | None:
    """Leaves from start to goal that a short path passes; None when none was found in time.

    Args:
        exits: of all leaves.
        query: start and goal.
        deadline: by `time.perf_counter` [s].

    Returns:
        Faces (K-1,), leaves (K,), and a point near each face (K-1, 3) [m], in the order of travel.
    """
    zeros = [0.0] * (3 - query.start.size)
    x, y, z = query.start.tolist() + zeros
    g_x, g_y, g_z = query.goal.tolist() + zeros
    goal_leaves = set(query.goal_leaves.tolist())
    # Of each entry into a leaf: length so far, point, leaf, face, entry before.
    entries = [(0.0, x, y, z, leaf, -1, -1) for leaf in query.start_leaves.tolist()]
    queue = [(0.0, number) for number in range(len(entries))]
    least = {entry[4]: 0.0 for entry in entries}  # estimate of each leaf; -inf when it is done
    count = 0
    while queue:
        count += 1
        if count % _CHECKED == 0 and time.perf_counter() >= deadline:
            return None
        estimate, number = heappop(queue)
        length, x, y, z, leaf, _, _ = entries[number]
        if leaf in goal_leaves:
            return _traced(entries, number)
        if estimate > least[leaf]:
            continue
        least[leaf] = -inf
        for face, beyond, n_x, n_y, n_z, offset, l_x, l_y, l_z, h_x, h_y, h_z in exits.of(leaf):
            known = least.get(beyond, inf)
            if known == -inf:
                continue
            # Where the way from here to the goal crosses the plane; mirrored, if both are on one
            # side of it. Then the nearest point of the face's box.
            here = n_x * x + n_y * y + n_z * z - offset
            there = n_x * g_x + n_y * g_y + n_z * g_z - offset
            reach = abs(here) + abs(there)
            share = abs(here) / reach if reach else 0.0
            drop = here + share * (there - here)
            p_x = x + share * (g_x - x) - drop * n_x
            p_y = y + share * (g_y - y) - drop * n_y
            p_z = z + share * (g_z - z) - drop * n_z
            p_x = l_x if p_x < l_x else h_x if p_x > h_x else p_x
            p_y = l_y if p_y < l_y else h_y if p_y > h_y else p_y
            p_z = l_z if p_z < l_z else h_z if p_z > h_z else p_z
            so_far = length + hypot(p_x - x, p_y - y, p_z - z)
            promise = so_far + _EAGER * hypot(g_x - p_x, g_y - p_y, g_z - p_z)
            if promise < known:
                least[beyond] = promise
                heappush(queue, (promise, len(entries)))
                entries.append((so_far, p_x, p_y, p_z, beyond, face, number))
    return None


def _traced(
    entries: list[tuple[float, float, float, float, int, int, int]], number: int
) -> tuple[Ints, Ints, Floats]:
    chain = []
    while number >= 0:
        chain.append(entries[number])
        number = chain[-1][6]
    chain.reverse()
    faces = np.array([entry[5] for entry in chain[1:]])
    points = np.array([entry[1:4] for entry in chain[1:]])
    return faces, np.array([entry[4] for entry in chain]), points
