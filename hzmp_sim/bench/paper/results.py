"""What the benchmark measures, as plain data: paper.json is these."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Final, Self

from hzmp_sim.bench.statistics import first_time

PAPER: Final = "paper"
BEST: Final = "best"
TITLES = {PAPER: 'HZ-MP as in the paper, `method="paper"`', BEST: "hzmp-sim's default"}
BOUND_TOL = 1e-7
"""A bound above the optimum by more than this, relative to it, is wrong; a path below it too.
The visibility graph grows boxes by 1e-9."""
_ROUND_OFF = 1e-12  # gaps below it are none


@dataclass(frozen=True)
class Step:
    """One iteration of algorithm 1."""

    number: int
    """From 1 on."""
    cost: float
    """Length of the shortest path over its samples [unit of the world]."""
    best: float
    """Length of the shortest path so far [unit of the world]."""
    adopted: bool
    """Whether its path became the best one."""
    sequences: int
    """Leaf sequences that were sampled."""
    faces: int
    """Shared faces that the ellipsotope of the best cost meets."""
    leaves: int
    """Leaves that it leaves over."""


@dataclass(frozen=True)
class Convergence:
    """An experiment of sections 4.1 to 4.3. Lengths have the unit of its world."""

    world: str
    section: str
    """Of the paper."""
    unit: str
    n: int
    """Dimension, 2 or 3."""
    obstacles: int
    """Convex ones: the parts that non-convex ones are made of."""
    leaves: int
    faces: int
    straight: float
    """Distance of start and goal: the only lower bound that algorithm 1 has."""
    optimum: float
    """Length of the default planner's path, proved to be optimal up to 1e-6."""
    bound: float
    """That proof's lower bound."""
    defects: list[str]
    """What `verify` finds wrong with path or bound."""
    steps: list[Step]
    """Of the run with the first seed."""
    after: dict[str, list[float]]
    """Best cost after so many iterations, for each seed."""
    iteration_s: float
    """Median time of an iteration [s]."""
    made_up: str
    """What the paper does not say about the world."""

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """What `asdict` made."""
        made = dict(data)
        made["steps"] = [Step(**step) for step in data["steps"]]
        return cls(**made)


@dataclass(frozen=True)
class Run:
    """One planner on one scene of random rectangles, once."""

    scene: int
    """Seed of the scene."""
    planner: str
    """`PAPER` or `BEST`."""
    seed: int
    decompose_s: float
    """Leaves and shared faces, for any start and goal [s]."""
    history: list[list[float]]
    """(time since the query [s], cost [m]) each time the cost improved."""
    total_s: float
    """From the query until the planner returned [s]."""
    cost: float | None
    """Length of the path, measured anew [m]; None without one."""
    lower_bound: float
    """What the planner proved [m]."""
    defects: list[str]
    """What an exact re-check finds wrong with the path."""

    @property
    def first_s(self) -> float:
        """When there was a path [s]; inf: never."""
        return first_time(self.history)

    @property
    def first_cost(self) -> float:
        """Its cost [m]; inf without one."""
        return self.history[0][1] if self.history else math.inf

    @property
    def final_cost(self) -> float:
        """Cost at the end [m]; inf without a path."""
        return math.inf if self.cost is None else self.cost

    @property
    def gap(self) -> float:
        """Of the cost over the planner's own bound, relative; inf without a path."""
        gap = (self.final_cost - self.lower_bound) / self.lower_bound
        return 0.0 if gap < _ROUND_OFF else gap


@dataclass(frozen=True)
class Scene:
    """35 random rectangles."""

    seed: int
    optimum: float
    """By a visibility graph, exact [m]."""
    leaves: int
    """Of our decomposition."""
    faces: int
    """Shared by them."""


@dataclass(frozen=True)
class Results:
    """A whole run of the benchmark."""

    command: str
    machine: dict[str, Any]
    settings: dict[str, Any]
    """What was asked for, and the "effort" that came of it."""
    experiments: list[Convergence]
    scenes: list[Scene]
    passed: int
    """Draws without a way from start to goal, which are left out."""
    chosen: int
    """Seed of the scene that is planned in with many seeds."""
    many_runs: list[Run]
    """On that scene."""
    many_scenes: list[Run]
    """On each scene, once."""
    seconds: float
    """What all of it took [s]."""

    @property
    def optima(self) -> dict[int, float]:
        """Length of the shortest path in each scene of random rectangles, by its seed [m]."""
        return {scene.seed: scene.optimum for scene in self.scenes}

    @property
    def defects(self) -> list[str]:
        """Wrong answers: paths that are not free or too short to be true, bounds too high."""
        found = [f"{one.world}: {line}" for one in self.experiments for line in one.defects]
        for one in self.experiments:
            if min(min(costs) for costs in one.after.values()) < one.bound * (1.0 - BOUND_TOL):
                found.append(f"{one.world}: a path below the lower bound")
        optima = self.optima
        for run in (*self.many_runs, *self.many_scenes):
            best, name = optima[run.scene], f"{run.planner}, scene {run.scene}"
            found += [f"{name}: {line}" for line in run.defects]
            if run.final_cost < best * (1.0 - BOUND_TOL):
                found.append(f"{name}: a path below the optimum")
            if run.lower_bound > best * (1.0 + BOUND_TOL):
                found.append(f"{name}: a bound above the optimum")
        return found

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {"benchmark": "paper"} | asdict(self) | {"defects": self.defects}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """What `to_dict` made."""
        made = {field.name: data[field.name] for field in fields(cls)}
        made["experiments"] = [Convergence.from_dict(one) for one in data["experiments"]]
        made["scenes"] = [Scene(**one) for one in data["scenes"]]
        for name in ("many_runs", "many_scenes"):
            made[name] = [Run(**one) for one in data[name]]
        return cls(**made)
