"""From runs to numbers: what counts as a success, and medians over the scenes of a group."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hzmp_sim.bench.peers.results import SOLVER_TOL, Results, Run, SceneResult
from hzmp_sim.bench.statistics import History, cost_at, first_time, median, time_to, wilson

GRID = (1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)
"""Times of the cost curves [s]."""
NEAR, NEARER = 0.01, 0.001
"""A path is near the best known when it is at most this much longer, relative to it."""


def is_free(run: Run, scene: SceneResult) -> bool:
    """Whether the returned path is one: free, from start to goal."""
    worst = max(run.depth, run.end_error)
    return run.cost is not None and worst <= SOLVER_TOL * scene.size


@dataclass(frozen=True)
class Timed:
    """A run in units of its scene's reference: without a free path it is never anywhere."""

    run: Run
    history: History
    """(time [s], cost / reference)."""

    @property
    def cost(self) -> float:
        """Last cost / reference; inf without a path."""
        return cost_at(self.history, math.inf)


def timed(results: Results, planner: str, check: str, group: str) -> list[Timed]:
    """The runs of a planner in the scenes of a group that have a reference."""
    scenes = {scene.name: scene for scene in results.scenes if scene.group == group}
    found = []
    for run in results.of(planner, check):
        scene = scenes.get(run.scene)
        if scene is None or scene.reference is None:
            continue
        history = [[when, cost / scene.reference] for when, cost in run.history]
        found.append(Timed(run, history if is_free(run, scene) else []))
    return found


@dataclass(frozen=True)
class Summary:
    """A planner in a group; medians over all runs, failures infinite."""

    runs: int
    success: int
    interval: tuple[float, float]
    """Of the success rate, 95 %."""
    early: int
    """Successes in a tenth of the budget."""
    first_s: float
    first_bare_s: float
    """First path without the calls from C++ to Python, estimated [s]."""
    first_cost: float
    early_cost: float
    """After a tenth of the budget."""
    cost: float
    worst: float
    edges_first: float
    states_first: float
    python: float
    """Part of the time that calls from C++ to Python took, estimated."""


def summary(runs: Sequence[Timed], budget: float) -> Summary:
    """Of at least one run."""
    early = [cost_at(run.history, budget / 10.0) for run in runs]
    done = [run for run in runs if run.history]
    return Summary(
        runs=len(runs),
        success=len(done),
        interval=wilson(len(done), len(runs)),
        early=sum(math.isfinite(cost) for cost in early),
        first_s=median(first_time(run.history) for run in runs),
        first_bare_s=median(first_time(run.history) - run.run.python_first_s for run in runs),
        first_cost=median(run.history[0][1] if run.history else math.inf for run in runs),
        early_cost=median(early),
        cost=median(run.cost for run in runs),
        worst=max(run.cost for run in runs),
        edges_first=median(_to_first(run, run.run.edges_first) for run in runs),
        states_first=median(_to_first(run, run.run.states_first) for run in runs),
        python=sum(run.run.python_s for run in runs) / sum(run.run.total_s for run in runs),
    )


def _to_first(run: Timed, count: int) -> float:
    return count if run.history else math.inf


def scene_medians(runs: Sequence[Timed], excess: float | None) -> dict[str, float]:
    """Median time of each scene's runs to a cost of 1 + excess; None: to the first path [s]."""
    scenes = dict.fromkeys(run.run.scene for run in runs)
    goal = math.inf if excess is None else 1.0 + excess
    return {
        scene: median(time_to(run.history, goal) for run in runs if run.run.scene == scene)
        for scene in scenes
    }


def groups(results: Results) -> list[str]:
    """Groups of scenes, in their order."""
    return list(dict.fromkeys(scene.group for scene in results.scenes))


def effort(results: Results) -> dict[str, Any]:
    """What `Effort` was measured with."""
    found: dict[str, Any] = results.settings["effort"]
    return found
