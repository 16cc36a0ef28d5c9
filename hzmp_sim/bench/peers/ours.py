"""HZ-MP on one scene: with the decomposition in its time, and on a free space that is there.

The clock is the time of the process on a processor, as it is for the peers: what else the machine
does is in nobody's times.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Plan, plan, verify
from hzmp_planners.sets import Polytope
from hzmp_sim.bench.boxes.recheck import recheck
from hzmp_sim.bench.boxes.scene import BoxScene
from hzmp_sim.bench.peers.results import COLD, WARM, Run
from hzmp_sim.bench.process_clock import process_clock
from hzmp_sim.bench.statistics import improvements


def measure_ours(
    scene: Mapping[str, Any], seed: int, budget: float, gap: float, verified: bool
) -> dict[str, Any]:
    """Decompose, plan, and plan again.

    Args:
        scene: of `BoxScene.to_dict`.
        seed: of both plans.
        budget: their time limit [s].
        gap: at which they stop.
        verified: whether `verify` re-checks the plan too.

    Returns:
        "runs": fields of two `Run`s; "leaves" and "faces": counts.
    """
    which = BoxScene.from_dict(scene)
    _warm_up(which.n)
    began = time.process_time()
    space = which.free_space()
    graph = space.graph
    offline = time.process_time() - began
    runs = []
    for planner in (COLD, WARM):
        began = time.process_time()
        with process_clock():
            made = plan(space, which.start, which.goal, time_limit=budget, gap=gap, seed=seed)
        spent = time.process_time() - began
        shift = offline if planner == COLD else 0.0
        run = run_of(which, made, planner, seed, shift, spent, offline)
        if verified and planner == COLD and not (found := verify(made)).ok:
            run["defects"].append(found.describe())
        runs.append(run)
    return {"runs": runs, "leaves": len(space), "faces": len(graph)}


def reference(scene: Mapping[str, Any], limit: float) -> dict[str, Any]:
    """One long run.

    Returns:
        "reference": its cost (None without a path), lower bound and depth in obstacles [m].
    """
    which = BoxScene.from_dict(scene)
    made = plan(which.free_space(), which.start, which.goal, time_limit=limit, gap=1e-6)
    run = run_of(which, made, WARM, 0, 0.0, 0.0, 0.0)
    return {"reference": {key: run[key] for key in ("cost", "lower_bound", "depth")}}


def run_of(
    scene: BoxScene, made: Plan, planner: str, seed: int, shift: float, spent: float, offline: float
) -> dict[str, Any]:
    """Fields of a `Run` from a plan, re-checked.

    Args:
        scene: what was planned in.
        made: the plan.
        planner: `COLD` or `WARM`.
        seed: of the plan.
        shift: what to add to its times [s].
        spent: by the plan [s].
        offline: by decomposition and graph [s].
    """
    history, bounds = improvements(made.history, shift)
    found: dict[str, Any] = {}
    defects: list[str] = []
    if len(made.waypoints):
        box = scene.lo, scene.hi
        true = recheck(made.waypoints.tolist(), scene.obstacles(), box, scene.start, scene.goal)
        found = {"cost": true.length, "depth": true.depth, "end_error": true.end_error}
        defects = true.defects(made.cost, scene.size)
    run = Run(
        scene=scene.name, planner=planner, check="", seed=seed, history=history,
        total_s=shift + spent, offline_s=offline, claimed=made.cost if found else None,
        lower_bound=made.lower_bound if math.isfinite(made.lower_bound) else 0.0, bounds=bounds,
        defects=defects, note=made.status.name.lower(), **found,
    )  # fmt: skip
    return asdict(run)


def _warm_up(n: int) -> None:
    """Plan around one box: what is loaded or set up at the first call is not the scene's."""
    lo, hi = np.zeros(n), np.ones(n)
    space = FreeSpace.decompose((lo, hi), [Polytope.from_box(lo + 0.3, hi - 0.3)])
    plan(space, lo + 0.1, hi - 0.1, time_limit=0.2)
