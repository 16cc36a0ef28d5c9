"""Table 1: random rectangles, by the law of PDT's defaultRandomRectangles2D.

Times are those of the process on a processor, as in `bench peers`. The optimum is a visibility
graph's.
"""

from __future__ import annotations

import time
from dataclasses import asdict
from typing import Any, Literal

from hzmp_planners.planning import plan
from hzmp_planners.planning.result import path_length
from hzmp_sim.bench.boxes.laws import FLAT, random_boxes, solvable_draws
from hzmp_sim.bench.boxes.recheck import recheck
from hzmp_sim.bench.boxes.scene import BoxScene
from hzmp_sim.bench.boxes.visibility import shortest_path
from hzmp_sim.bench.paper.results import BEST, PAPER, Run, Scene
from hzmp_sim.bench.process_clock import process_clock
from hzmp_sim.bench.statistics import improvements

_GAPS = {PAPER: 0.0, BEST: 1e-3}  # at which a planner stops: algorithm 1 uses the whole budget
_WARM_UP = 0.02  # [s]


def find_scenes(count: int, seed: int) -> dict[str, Any]:
    """The first solvable draws from a seed on.

    Returns:
        "scenes": fields of a `Scene` each; "passed": how many draws are not solvable.
    """
    drawn, passed = solvable_draws(2, FLAT, seed, count)
    scenes = []
    for number, scene in drawn.items():
        space = scene.free_space()
        found = Scene(number, optimal_cost(scene), len(space), len(space.graph))
        scenes.append(asdict(found))
    return {"scenes": scenes, "passed": passed}


def optimal_cost(scene: BoxScene) -> float:
    """Length of the shortest path in a solvable scene in the plane [m]."""
    path = shortest_path(scene.lo, scene.hi, scene.low, scene.high, scene.start, scene.goal)
    assert path is not None, f"{scene.name}: its optimum needs a gap of no width"
    return path_length(path)


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
    # What is loaded or set up at the first call is not a run's.
    for planner in (PAPER, BEST):
        _measured(where, scene, planner, 0, _WARM_UP)
    runs = [
        _measured(where, scene, planner, seed, budget)
        for seed in seeds
        for planner in (PAPER, BEST)
    ]
    return {"runs": [asdict(run) for run in runs]}


def _measured(
    where: BoxScene, scene: int, planner: Literal["paper", "best"], seed: int, budget: float
) -> Run:
    with process_clock():
        began = time.perf_counter()
        space = where.free_space()
        _ = space.graph
        decomposed = time.perf_counter() - began
        began = time.perf_counter()
        found = plan(
            space, where.start, where.goal, time_limit=budget, seed=seed, method=planner,
            gap=_GAPS[planner],
        )  # fmt: skip
        spent = time.perf_counter() - began
    history, _ = improvements(found.history)
    cost, defects = None, []
    if len(found.waypoints):
        bounds = where.lo, where.hi
        points = found.waypoints.tolist()
        true = recheck(points, where.obstacles(), bounds, where.start, where.goal)
        cost, defects = true.length, true.defects(found.cost, where.size)
    return Run(
        scene=scene, planner=planner, seed=seed, decompose_s=decomposed, history=history,
        total_s=spent, cost=cost, lower_bound=found.lower_bound, defects=defects,
    )  # fmt: skip
