"""Paths among static and moving obstacles, of which only those that are in the way are cut out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Plan, Planner
from hzmp_sim.replanning.crossing import crossed

if TYPE_CHECKING:
    from hzmp_sim.motion.hulls import Hulls

_ROUNDS = 4  # of cutting out what a path passes through, before all of it is cut out
_KEPT = 6  # spaces with something cut out, for the next decisions
_RENEWED = 10  # decisions, after which nothing of the last ones is used


@dataclass(frozen=True, eq=False)
class Route:
    """A path, and the free space that it is in."""

    plan: Plan
    space: FreeSpace

    @property
    def found(self) -> bool:
        """Whether there is a path."""
        return math.isfinite(self.plan.cost)


class Router:
    """Finds a path for one decision after the other.

    Moving obstacles that a path does not meet are not cut out of the free space: the first path is
    among what stands still, what it meets is cut out for the second one, and so on. Lower bound and
    path are those of the space without all of them. From one decision to the next little changes:
    what the paths of the last one meet now is cut out at once.

    Args:
        space: of the static obstacles.
    """

    def __init__(self, space: FreeSpace) -> None:
        self._space = space
        self._known: Floats | None = None
        self._tried: list[Floats] = []
        self._goal: Floats | None = None
        self._age = 0
        self._start: Floats | None = None
        self._static: dict[bytes, Route | None] = {}
        self._cut: dict[bytes, FreeSpace] = {}

    def static(self, start: Floats, goal: Floats) -> Route | None:
        """A short path among what stands still; None where start or goal (n,) is not free."""
        if self._start is None or not np.array_equal(start, self._start):
            self._start, self._static = start, {}
        key = goal.tobytes()
        if key not in self._static:
            self._static[key] = _first(self._space, start, goal, self._known)
        return self._static[key]

    def route(self, start: Floats, goal: Floats, moving: Hulls) -> Route | None:
        """A short path in the free space without what moves, too; None where an end is not free.

        Args:
            start: shape (n,) [m].
            goal: shape (n,) [m].
            moving: further obstacles.
        """
        self._age += 1
        if self._age > _RENEWED or self._goal is None or not np.array_equal(goal, self._goal):
            self._tried, self._age, self._goal = [], 0, goal
        found, self._tried = self._cutting(start, goal, moving, *self._met_again(start, moving))
        if found is not None and found.found:
            self._known = found.plan.waypoints
        return found

    def aside(self, start: Floats, point: Floats, moving: Hulls) -> Route | None:
        """As `route`, to a point (n,) that is not the goal."""
        return self._cutting(start, point, moving, set(), [])[0]

    def _cutting(
        self, start: Floats, goal: Floats, moving: Hulls, chosen: set[int], tried: list[Floats]
    ) -> tuple[Route | None, list[Floats]]:
        """Cut out what is chosen, and then what paths meet; what is found, and all these paths."""
        found: Route | None = None
        for attempt in range(_ROUNDS + 1):
            if attempt == _ROUNDS:
                chosen = set(np.flatnonzero(moving.exist).tolist())
            found = self._among(start, goal, moving, chosen)
            if found is None or not found.found:
                break
            tried = [*tried, found.plan.waypoints]
            more = set(crossed(found.plan.waypoints, moving)[0]) - chosen
            if not more:
                break
            chosen = chosen | more
        return found, tried

    def _among(self, start: Floats, goal: Floats, moving: Hulls, chosen: set[int]) -> Route | None:
        """A short path where the chosen obstacles are cut out."""
        if not chosen:
            return self.static(start, goal)
        rows = np.array(sorted(chosen), dtype=np.int64)
        key = moving.A[rows].tobytes() + moving.b[rows].tobytes()
        space = self._cut.pop(key, None)
        if space is None:
            cut = [hull for i in rows.tolist() if (hull := moving[i]) is not None]
            space = self._space.with_obstacles(cut)
        self._cut[key] = space
        if len(self._cut) > _KEPT:
            del self._cut[next(iter(self._cut))]
        return _first(space, start, goal, self._known)

    def _met_again(self, start: Floats, moving: Hulls) -> tuple[set[int], list[Floats]]:
        """What the paths that were tried last meet, one after the other, and these paths."""
        chosen: set[int] = set()
        tried: list[Floats] = []
        for way in self._tried:
            rest = _from(way, start)
            more = set(crossed(rest, moving)[0]) - chosen
            if not more:
                break
            chosen |= more
            tried.append(rest)
        return chosen, tried


def _first(space: FreeSpace, start: Floats, goal: Floats, known: Floats | None) -> Route | None:
    """The first path in a space; `known` (k, n) is one for similar ends."""
    try:
        return Route(Planner(space, start, goal, warm_start=known).first_path(), space)
    except QueryError:
        return None


def _from(way: Floats, start: Floats) -> Floats:
    """A polyline (k + 1, n) from a place beside it on."""
    begins, moves = way[:-1], np.diff(way, axis=0)
    squares = np.maximum((moves * moves).sum(axis=1), 1e-12)
    share = (((start - begins) * moves).sum(axis=1) / squares).clip(0.0, 1.0)
    gaps = start - begins - share[:, None] * moves
    nearest = int((gaps * gaps).sum(axis=1).argmin())
    return np.concatenate([start[None], way[nearest + 1 :]])
