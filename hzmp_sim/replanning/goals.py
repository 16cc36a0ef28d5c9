"""Where the body is to go: one goal after the other, round and round, or another one on the way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.motion.script import Goal
from hzmp_sim.scene import Scene


class Station(NamedTuple):
    """A goal of a flight."""

    position: Floats
    """Shape (n,) [m]."""
    dwell: float = 0.0
    """How long the body stays there before it goes on [s]."""


class Goals:
    """The goals of a flight, and how far it has come.

    Args:
        stations: in order, at least one.
        changes: stations that take the place of the one that the body is on its way to, each with
            the simulated time [s] at which they do.
        patrol: begin again after the last one, for ever.
    """

    def __init__(
        self,
        stations: Sequence[Station],
        changes: Sequence[tuple[float, Station]] = (),
        *,
        patrol: bool = False,
    ) -> None:
        self._stations = list(stations)
        self._changes = sorted(changes, key=lambda change: change[0])
        self._patrol, self._place, self._leaves = patrol, 0, math.inf
        self._there = False
        self.reached = 0
        """How many."""

    @classmethod
    def of(cls, scene: Scene) -> Goals:
        """Those of a scene and of its motion script."""
        script = scene.motion
        goals = () if script is None else script.goals
        stations = [Station(scene.goal)]
        stations += [_station(goal, scene) for goal in goals if goal.time is None]
        changes = [(goal.time, _station(goal, scene)) for goal in goals if goal.time is not None]
        return cls(stations, changes, patrol=script is not None and script.patrol)

    @property
    def positions(self) -> list[Floats]:
        """All goals that there are, each (n,) [m]: those in order, then those told on the way."""
        told = [station for _, station in self._changes]
        return [station.position for station in (*self._stations, *told)]

    def now(self, time: float) -> Floats:
        """The goal at a simulated time [s], shape (n,) [m]; times do not go back."""
        if time >= self._leaves:
            self._place = (self._place + 1) % len(self._stations)
            self._leaves, self._there = math.inf, False
        while self._changes and time >= self._changes[0][0]:
            self._stations[self._place] = self._changes.pop(0)[1]
            self._leaves, self._there = math.inf, False
        return self._stations[self._place].position

    def arrive(self, time: float) -> bool:
        """Say that the body rests at the goal; whether it was the last one."""
        if self._there:  # it stays for a while
            return False
        self._there = True
        self.reached += 1
        if not self._patrol and self._place == len(self._stations) - 1 and not self._changes:
            return True
        if self._patrol or self._place < len(self._stations) - 1:
            self._leaves = time + self._stations[self._place].dwell
        return False


def is_at(position: Floats, goal: Floats, tolerance: float) -> bool:
    """Whether two points (n,) are one, up to a distance [m]."""
    return bool(np.linalg.norm(position - goal) <= tolerance)


def _station(goal: Goal, scene: Scene) -> Station:
    position = np.array(goal.position, dtype=np.float64)
    if position.size < scene.n:  # at the height of the scene's goal
        position = np.append(position, scene.goal[2])
    return Station(position[: scene.n], goal.dwell)
