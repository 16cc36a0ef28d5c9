"""One run of one sampling planner.

The clock is the time of this thread on a processor, from before the planner is made. OMPL's random
numbers have one seed per process, so each run has a process of its own.
"""

from __future__ import annotations

import importlib
import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hzmp_sim.bench.boxes.recheck import recheck
from hzmp_sim.bench.boxes.scene import BoxScene
from hzmp_sim.bench.peers.ompl.edges import compiled
from hzmp_sim.bench.peers.ompl.planners import RRT_CONNECT, make_planner
from hzmp_sim.bench.peers.ompl.problem import Problem
from hzmp_sim.bench.peers.results import SOLVER_TOL, Run
from hzmp_sim.bench.statistics import thinned

# Loaded, and compiled, once by the process that the others are forked from.
for _module in ("ompl.base", "ompl.geometric", "ompl.util"):
    importlib.import_module(_module)
compiled()


@dataclass(frozen=True)
class _Counts:
    """What was called so far."""

    edges: int
    states: int
    samples: int
    stops: int


class _Clock:
    """Termination condition of a run that also notes when the cost improves.

    In these bindings an improvement cannot call back: the condition asks for the best cost.
    """

    def __init__(self, problem: Problem, planner: Any, budget: float) -> None:
        self.began = time.thread_time()
        self.history: list[list[float]] = []
        self.first: _Counts | None = None
        self._problem, self._budget = problem, budget
        self._planner = planner if hasattr(planner, "bestCost") else None
        self._best = math.inf
        self._stops = 0

    def __call__(self) -> bool:
        self._stops += 1
        now = time.thread_time() - self.began
        if self._planner is not None:
            cost = self._planner.bestCost().value()
            if cost < self._best:
                self.improved(now, cost)
        return now >= self._budget

    def improved(self, now: float, cost: float) -> None:
        """Note a path of a cost [m] at a time [s]."""
        self._best = cost
        self.history.append([now, cost])
        if self.first is None:
            self.first = self.counts()

    def counts(self) -> _Counts:
        """What was called so far."""
        edges, states = self._problem.counts.tolist()
        return _Counts(edges, states, self._problem.samples[0], self._stops)


def measure_ompl(
    scene: Mapping[str, Any],
    planner: str,
    check: str,
    seed: int,
    budget: float,
    resolution: float,
) -> dict[str, Any]:
    """Plan once; RRT-Connect simplifies its path afterwards, as its users do.

    Args:
        scene: of `BoxScene.to_dict`.
        planner: one of `SAMPLERS`.
        check: "exact" or "states".
        seed: of OMPL's random numbers; it wants positive ones and gets seed + 1.
        budget: [s].
        resolution: distance of checked states, relative to the diagonal.

    Returns:
        "runs": fields of one `Run`.
    """
    util: Any = importlib.import_module("ompl.util")
    geometric: Any = importlib.import_module("ompl.geometric")
    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(seed + 1)
    which = BoxScene.from_dict(scene)
    problem = Problem(which, check, resolution)
    began = time.thread_time()
    solver = make_planner(planner, problem.information, which.n, which.size)
    solver.setProblemDefinition(problem.definition)
    solver.setup()
    clock = _Clock(problem, solver, budget)
    clock.began = began
    condition = problem.base.PlannerTerminationCondition(clock)
    solver.solve(condition)
    found = problem.definition.hasExactSolution()
    path = problem.definition.getSolutionPath() if found else None
    if path is not None and planner == RRT_CONNECT:
        clock.improved(time.thread_time() - began, path.length())
        geometric.PathSimplifier(problem.information).simplifyMax(path)
        clock.improved(time.thread_time() - began, path.length())
    spent = time.thread_time() - began
    counts, first = clock.counts(), clock.first
    edge_s, state_s = problem.callback_costs()
    stop_s = problem.stop_cost(condition)

    def python(done: _Counts) -> float:
        return done.edges * edge_s + done.samples * state_s + done.stops * stop_s

    run = Run(
        which.name, planner, check, seed, thinned(clock.history), spent,
        edges=counts.edges, states=counts.states, python_s=python(counts),
        edges_first=first.edges if first else 0, states_first=first.states if first else 0,
        python_first_s=python(first) if first else 0.0,
    )  # fmt: skip
    return {"runs": [asdict(run) | _checked(which, problem, path, clock.history)]}


def _checked(
    scene: BoxScene, problem: Problem, path: Any, history: list[list[float]]
) -> dict[str, Any]:
    """What the re-check says about a path: fields of a `Run`."""
    if path is None:
        return {"history": [], "note": "no path"} if history else {"note": "no path"}
    points = problem.points(path)
    true = recheck(points, scene.obstacles(), (scene.lo, scene.hi), scene.start, scene.goal)
    facts: dict[str, Any] = {
        "claimed": history[-1][1],
        "depth": true.depth,
        "end_error": true.end_error,
    }
    if true.end_error > SOLVER_TOL * scene.size or not np.isfinite(true.length):
        # AORRTC: a path of length zero when the start sees the goal.
        return facts | {"history": [], "note": "path does not lead from start to goal"}
    return facts | {"cost": true.length}
