"""What the benchmark measures, as plain data: paper.json is these."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Final, Self

PAPER: Final = "paper"
BEST: Final = "best"
TITLES = {PAPER: 'HZ-MP as in the paper, `method="paper"`', BEST: "hzmp-sim's default"}
BOUND_TOL = 1e-7
"""A bound above the optimum by more than this, relative to it, is wrong; a path below it too.
The visibility graph grows boxes by 1e-9."""


@dataclass(frozen=True)
class Step:
    """One iteration of algorithm 1."""

    number: int
    cost: float
    best: float
    adopted: bool
    sequences: int
    faces: int
    leaves: int


@dataclass(frozen=True)
class Convergence:
    """An experiment of sections 4.1 to 4.3."""

    world: str
    section: str
    unit: str
    n: int
    obstacles: int
    leaves: int
    faces: int
    straight: float
    optimum: float
    """Length of a path whose optimality is proved up to 1e-6."""
    bound: float
    """That proof's lower bound."""
    steps: list[Step]
    """Of the run with the first seed."""
    after: dict[str, list[float]]
    """Best cost after so many iterations, for each seed."""
    milliseconds: float
    """Median time of an iteration [ms]."""
    made_up: str

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
    seed: int
    decompose_s: float
    """Leaves and shared faces, for any start and goal [s]."""
    history: list[list[float]]
    """(time since the query [s], cost) each time the cost improved."""
    total_s: float
    cost: float | None
    """None without a path."""
    lower_bound: float

    @property
    def first_s(self) -> float:
        """When there was a path [s]; inf: never."""
        return self.history[0][0] if self.history else math.inf

    @property
    def first_cost(self) -> float:
        """Its cost; inf without one."""
        return self.history[0][1] if self.history else math.inf

    @property
    def final_cost(self) -> float:
        """Cost at the end; inf without a path."""
        return math.inf if self.cost is None else self.cost

    @property
    def gap(self) -> float:
        """Relative to the planner's own bound; inf without a path."""
        return (self.final_cost - self.lower_bound) / self.lower_bound


@dataclass(frozen=True)
class Scene:
    """35 random rectangles."""

    seed: int
    optimum: float
    """By a visibility graph, exact."""
    leaves: int
    faces: int


@dataclass(frozen=True)
class Results:
    """A whole run of the benchmark."""

    command: str
    machine: dict[str, Any]
    settings: dict[str, Any]
    experiments: list[Convergence]
    scenes: list[Scene]
    passed: int
    """Draws without a way from start to goal, which are left out."""
    one: int
    """Seed of the scene that is planned in with many seeds."""
    many_runs: list[Run]
    """On that scene."""
    many_scenes: list[Run]
    """On each scene, once."""
    seconds: float

    @property
    def defects(self) -> list[str]:
        """Paths shorter than the optimum, and bounds above it."""
        optimum = {scene.seed: scene.optimum for scene in self.scenes}
        found = []
        for run in (*self.many_runs, *self.many_scenes):
            best = optimum[run.scene]
            if run.final_cost < best * (1.0 - BOUND_TOL) - BOUND_TOL:
                found.append(f"{run.planner}, scene {run.scene}: a path below the optimum")
            if run.lower_bound > best * (1.0 + BOUND_TOL) + BOUND_TOL:
                found.append(f"{run.planner}, scene {run.scene}: a bound above the optimum")
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
