"""The shortest path in the plane, exactly: best-first search over intervals of shared faces.

All points of an interval see the string's last bend, its root, straight through the leaves in
between; so one node stands for all strings that pass an interval (Cui, Harabor and Grastien 2017,
"Compromise-free pathfinding on a navigation mesh"). The least length root - interval - goal bounds
what such strings can become: when a node in a leaf of the goal comes up, its string is the
shortest; until then the best node left proves a bound.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from heapq import heappop, heappush
from math import hypot
from typing import NamedTuple

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.planning.planar.funnel import crossing
from hzmp_planners.planning.planar.mesh import Mesh

_CHECKED = 16  # nodes between two looks at the clock
_NEAR = 1e-12  # a point nearer to a line of sight than this [m at S = 1] is on it
_LONGER = 1.0 + 1e-12  # strings to a corner that are longer by more than round-off are not shortest


class _Node(NamedTuple):
    """All strings with one last bend that enter a leaf through an interval of a face."""

    length: float
    """From the start to the root [m]."""
    x: float
    y: float
    root: int
    """Number of the corner at which the strings bent last; -1 is the start."""
    left_x: float
    left_y: float
    left: int
    """Number of the corner at the left end, seen from the root; -1 where none is."""
    right_x: float
    right_y: float
    right: int
    face: int
    leaf: int
    parent: int
    """Number of the node before; -1 for none."""


@dataclass(frozen=True, eq=False)
class TautPath:
    """A shortest path over leaves."""

    waypoints: Floats
    """Where it starts, crosses faces, and ends, shape (K+1, 2) [m]."""
    leaves: Ints
    """Leaf of each segment, shape (K,)."""


class TautSearch:
    """A search for one shortest path; it can be stopped and resumed."""

    def __init__(
        self, mesh: Mesh, start: Floats, goal: Floats, start_leaves: Ints, goal_leaves: Ints
    ) -> None:
        self.path: TautPath | None = None
        self.bound = math.dist(start, goal)
        """No path is shorter [m]; inf when there is no path."""
        self.reached: dict[int, float] = {}
        """Length of the shortest string found to each corner looked at [m]."""
        self.mesh = mesh
        self._start = float(start[0]), float(start[1])
        self._goal = float(goal[0]), float(goal[1])
        self._goal_leaves = frozenset(goal_leaves.tolist())
        self._nodes: list[_Node] = []
        self._queue: list[tuple[float, int]] = []
        self._seen: dict[tuple[int, int, int, float, float, float, float], float] = {}
        self._first: dict[tuple[int, int], int] = {}  # start leaf behind a face, by leaf beyond
        for leaf in start_leaves.tolist():
            for exit_ in mesh.exits[leaf]:
                face, beyond, l_x, l_y, left, r_x, r_y, right = exit_
                self._first[face, beyond] = leaf
                ends = (l_x, l_y, left, r_x, r_y, right)
                self._push(_Node(0.0, *self._start, -1, *ends, face, beyond, -1), math.inf)

    def run(
        self, limit: float = math.inf, deadline: float = math.inf, most: float = math.inf
    ) -> None:
        """Go on until the shortest path is found, none shorter than a limit is left, or time is up.

        Args:
            limit: longer paths are not of interest [m].
            deadline: by `time.perf_counter` [s].
            most: how many nodes are looked at before it stops as well.
        """
        count = 0
        queue, nodes, goal_leaves = self._queue, self._nodes, self._goal_leaves
        while queue and self.path is None:
            count += 1
            if count > most or (count % _CHECKED == 0 and time.perf_counter() >= deadline):
                return
            # Strings that are longer than the limit are not in the queue.
            self.bound = max(self.bound, min(queue[0][0], limit))
            if self.bound >= limit:
                return
            _, number = heappop(queue)
            node = nodes[number]
            if node.root >= 0 and node.length > self.reached[node.root] * _LONGER:
                continue
            if node.leaf in goal_leaves:
                self.path = self._traced(number)
            else:
                self._expand(node, number, limit)
        if self.path is None:
            self.bound = max(self.bound, limit)

    def _expand(self, node: _Node, number: int, limit: float) -> None:
        """Push what strings of a node may do next: cross another face, straight or after a bend."""
        (length, x, y, root, left_x, left_y, left, right_x, right_y, right, face, leaf, _) = node
        l_x, l_y, r_x, r_y = left_x - x, left_y - y, right_x - x, right_y - y
        near = _NEAR * self.mesh.scale
        l_near = near * (abs(l_x) + abs(l_y))
        r_near = near * (abs(r_x) + abs(r_y))
        e_x, e_y = right_x - left_x, right_y - left_y
        e_near = near * (abs(e_x) + abs(e_y))
        l_length = self._reach(left, root, length + hypot(l_x, l_y))
        r_length = self._reach(right, root, length + hypot(r_x, r_y))
        for exit_, beyond, a_x, a_y, a, b_x, b_y, b in self.mesh.exits[leaf]:
            if exit_ == face:
                continue
            h_x, h_y = b_x - a_x, b_y - a_y
            # How far its ends are to the left of the two outermost lines of sight.
            u, v, w, z = a_x - x, a_y - y, b_x - x, b_y - y
            la, lb = l_x * v - l_y * u, l_x * z - l_y * w
            ra, rb = r_x * v - r_y * u, r_x * z - r_y * w
            level = e_x * (a_y - left_y) - e_y * (a_x - left_x)
            drop = e_x * h_y - e_y * h_x
            on_line = max(abs(level), abs(level + drop)) <= e_near
            if on_line or h_y * u - h_x * v > near * (abs(h_x) + abs(h_y)):
                # On the line of the interval, or the root is outside the leaf there: no string
                # comes straight, only past one of the interval's ends.
                past_right = min(ra, rb) < -r_near
                if on_line:
                    past_right = e_x * (a_x - right_x) + e_y * (a_y - right_y) > -e_near
                end = (right_x, right_y, right) if past_right else (left_x, left_y, left)
                bend = r_length if past_right else l_length
                if on_line and end[2] == root >= 0:
                    bend = length
                if bend < limit:
                    past = _Node(bend, *end, a_x, a_y, a, b_x, b_y, b, exit_, beyond, number)
                    self._push(past, limit)
                continue
            hidden_left = 0.0 if la <= l_near else 1.0 if lb >= -l_near else la / (la - lb)
            hidden_right = 1.0 if rb >= -r_near else 0.0 if ra <= r_near else ra / (ra - rb)
            one = (a_x, a_y, a)
            if hidden_left == 1.0:
                one = (b_x, b_y, b)
            elif hidden_left > 0.0:
                one = (a_x + hidden_left * (b_x - a_x), a_y + hidden_left * (b_y - a_y), -1)
            two = (b_x, b_y, b)
            if hidden_right == 0.0:
                two = (a_x, a_y, a)
            elif hidden_right < 1.0:
                two = (a_x + hidden_right * (b_x - a_x), a_y + hidden_right * (b_y - a_y), -1)
            if hidden_left > 0.0 and l_length < limit:
                bent = _Node(
                    l_length, left_x, left_y, left, a_x, a_y, a, *one, exit_, beyond, number
                )
                self._push(bent, limit)
            if hidden_left < hidden_right:
                seen = _Node(length, x, y, root, *one, *two, exit_, beyond, number)
                self._push(seen, limit)
            if hidden_right < 1.0 and r_length < limit:
                bent = _Node(
                    r_length, right_x, right_y, right, *two, b_x, b_y, b, exit_, beyond, number
                )
                self._push(bent, limit)

    def _reach(self, corner: int, root: int, length: float) -> float:
        """Note a string to a corner; its length, or inf where bending there cannot be shortest."""
        if corner < 0 or corner == root:
            return math.inf
        known = self.reached.get(corner, math.inf)
        if length < known:
            self.reached[corner] = length
        return length if length <= known * _LONGER else math.inf

    def _push(self, node: _Node, limit: float) -> None:
        estimate = node.length + _least_over(node, *self._goal)
        if estimate >= limit:
            return
        if node.root >= 0:
            key = (node.root, node.face, node.leaf, *node[4:6], *node[7:9])
            # Only a longer string has been here: what it pushed ends in `run`, so this one goes.
            if self._seen.get(key, math.inf) <= node.length * _LONGER:
                return
            self._seen[key] = node.length
        heappush(self._queue, (estimate, len(self._nodes)))
        self._nodes.append(node)

    def _traced(self, number: int) -> TautPath:
        """The string of a node whose leaf has the goal."""
        aim = self._goal
        points, leaves = [aim], [self._nodes[number].leaf]
        while number >= 0:
            node = self._nodes[number]
            left, right = (node.left_x, node.left_y), (node.right_x, node.right_y)
            points.append(crossing((node.x, node.y), aim, left, right))
            number = node.parent
            before = self._nodes[number] if number >= 0 else None
            bent = before is not None and before.root != node.root
            aim = (node.x, node.y) if bent else points[-1]
            leaves.append(before.leaf if before is not None else self._first[node.face, node.leaf])
        points.append(self._start)
        return TautPath(np.array(points[::-1]), np.array(leaves[::-1]))


def _least_over(node: _Node, x: float, y: float) -> float:
    """Length of the shortest way from a node's root over its interval to a point [m]."""
    (_, r_x, r_y, _, a_x, a_y, _, b_x, b_y, _, _, _, _) = node
    along_x, along_y = b_x - a_x, b_y - a_y
    ahead = along_x * (y - a_y) - along_y * (x - a_x)
    if ahead < 0.0:  # on the root's side of the interval: its mirror image is as far
        twice = 2.0 * ahead / (along_x * along_x + along_y * along_y)
        x, y = x + twice * along_y, y - twice * along_x
    u, v = x - r_x, y - r_y
    l_x, l_y = a_x - r_x, a_y - r_y
    if l_x * v - l_y * u > 0.0:
        return hypot(l_x, l_y) + hypot(x - a_x, y - a_y)
    l_x, l_y = b_x - r_x, b_y - r_y
    if l_x * v - l_y * u < 0.0:
        return hypot(l_x, l_y) + hypot(x - b_x, y - b_y)
    return hypot(u, v)
