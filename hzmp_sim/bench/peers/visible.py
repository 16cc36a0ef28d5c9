"""The visibility graph as a planner: built and searched anew for each query."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from hzmp_sim.bench.boxes.recheck import recheck
from hzmp_sim.bench.boxes.scene import BoxScene
from hzmp_sim.bench.boxes.visibility import shortest_path
from hzmp_sim.bench.peers.results import Run

VISIBILITY = "visibility"


def measure_visibility(scene: Mapping[str, Any], seeds: list[int]) -> dict[str, Any]:
    """The exact optimum of a scene in the plane, as often as there are seeds.

    Returns:
        "runs": fields of a `Run` each. The path is optimal: its length is also its bound.
    """
    which = BoxScene.from_dict(scene)
    corners = which.lo, which.hi, which.low, which.high, which.start, which.goal
    shortest_path(*corners)
    runs = []
    for seed in seeds:
        began = time.process_time()
        path = shortest_path(*corners)
        spent = time.process_time() - began
        run = Run(which.name, VISIBILITY, "", seed, [], spent, note="no path")
        if path is not None:
            bounds = which.lo, which.hi
            true = recheck(path.tolist(), which.obstacles(), bounds, which.start, which.goal)
            run = Run(
                which.name, VISIBILITY, "", seed, [[spent, true.length]], spent,
                cost=true.length, claimed=true.length, lower_bound=true.length, depth=true.depth,
                end_error=true.end_error,
            )  # fmt: skip
        runs.append(asdict(run))
    return {"runs": runs}
