"""Table 1: random rectangles, by the law of PDT's defaultRandomRectangles2D.

Times are those of the process on a processor, as in `bench peers`: what else the machine does is in
nobody's times. The optimum is a visibility graph's.
"""

from __future__ import annotations

import math
import time
from dataclasses import asdict
from itertools import pairwise
from typing import Any, Literal
from unittest.mock import patch

import numpy as np

from hzmp_planners.planning import plan
from hzmp_sim.bench.boxes.laws import FLAT, random_boxes, solvable
from hzmp_sim.bench.boxes.scene import BoxScene
from hzmp_sim.bench.boxes.visibility import shortest_path
from hzmp_sim.bench.paper.results import BEST, PAPER, Run, Scene


def find_scenes(count: int, seed: int) -> dict[str, Any]:
    """The first solvable draws from a seed on.

    Returns:
        "scenes": fields of a `Scene` each; "passed": how many draws are not solvable.
    """
    scenes: list[dict[str, Any]] = []
    passed = 0
    while len(scenes) < count:
        number = seed + len(scenes) + passed
        box_scene = random_boxes(2, FLAT, number)
        if solvable(box_scene):
            space = box_scene.free_space()
            optimum = optimal_cost(box_scene)
            scenes.append(asdict(Scene(number, optimum, len(space), len(space.graph))))
        else:
            passed += 1
    return {"scenes": scenes, "passed": passed}


def optimal_cost(scene: BoxScene) -> float:
    """Length of the shortest path [m]; inf when there is none."""
    path = shortest_path(scene.lo, scene.hi, scene.low, scene.high, scene.start, scene.goal)
    if path is None:
        return math.inf
    return math.fsum(math.dist(p, q) for p, q in pairwise(path))


def measure_rectangles(scene: int, seeds: list[int], budget: float) -> dict[str, Any]:
    """Both planners on one scene, decomposed anew for each seed.

    The paper's algorithm uses the whole budget; the default stops at the gap of 0.1 %.

    Args:
        scene: seed of the scene.
        seeds: of the runs.
        budget: of each run, without the decomposition [s].

    Returns:
        "runs": fields of a `Run` each.
    """
    where = random_boxes(2, FLAT, scene)
    _measured(where, scene, BEST, 0, 0.02)
    _measured(where, scene, PAPER, 0, 0.02)
    runs = [
        _measured(where, scene, planner, seed, budget)
        for seed in seeds
        for planner in (PAPER, BEST)
    ]
    return {"runs": [asdict(run) for run in runs]}


def _measured(
    where: BoxScene, scene: int, planner: Literal["paper", "best"], seed: int, budget: float
) -> Run:
    with patch.object(time, "perf_counter", time.process_time):
        began = time.perf_counter()
        space = where.free_space()
        _ = space.graph
        decomposed = time.perf_counter() - began
        began = time.perf_counter()
        found = plan(
            space, where.start, where.goal, time_limit=budget, seed=seed, method=planner,
            gap=0.0 if planner == PAPER else 1e-3,
        )  # fmt: skip
        spent = time.perf_counter() - began
    history: list[list[float]] = []
    for when, cost, _ in found.history:
        if math.isfinite(cost) and (not history or cost < history[-1][1]):
            history.append([when, cost])
    return Run(
        scene=scene, planner=planner, seed=seed, decompose_s=decomposed, history=history,
        total_s=spent, cost=found.cost if np.isfinite(found.cost) else None,
        lower_bound=found.lower_bound,
    )  # fmt: skip
