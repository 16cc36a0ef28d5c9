"""fastpathplanning (Marcucci, Nobel, Tedrake, Boyd 2023) on axis-aligned boxes.

Offline it joins the boxes to a line graph and optimises a point in each of their intersections; a
query is a shortest path over these points, then rounds of a cone program and of boxes put in. Only
its polygonal phase is run: curves are not what is compared.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.bench.boxes.recheck import recheck
from hzmp_sim.bench.boxes.scene import BoxScene
from hzmp_sim.bench.peers.cells import cells_of
from hzmp_sim.bench.peers.results import Run

FAST_PATHS = "fastpathplanning"


def measure_fast_paths(scene: Mapping[str, Any], seeds: list[int]) -> dict[str, Any]:
    """Prepare the boxes once, then ask as often as there are seeds; the answers are one.

    Returns:
        "runs": fields of a `Run` each.
    """
    library: Any = importlib.import_module("fastpathplanning")
    polygonal: Any = importlib.import_module("fastpathplanning.polygonal")
    which = BoxScene.from_dict(scene)
    low, high, _ = cells_of(which)
    _warm_up(library, polygonal, which.n)
    began = time.process_time()
    prepared = library.SafeSet(low, high, verbose=False)
    offline = time.process_time() - began
    runs = []
    for seed in seeds:
        began = time.process_time()
        path = _query(polygonal, prepared, which.start, which.goal)
        spent = time.process_time() - began
        run = Run(which.name, FAST_PATHS, "", seed, [], spent, offline, note="no path")
        if path is not None:
            bounds = which.lo, which.hi
            true = recheck(path.tolist(), which.obstacles(), bounds, which.start, which.goal)
            run = Run(
                which.name, FAST_PATHS, "", seed, [[spent, true.length]], spent, offline,
                cost=true.length, claimed=true.length, depth=true.depth, end_error=true.end_error,
            )  # fmt: skip
        runs.append(asdict(run))
    return {"runs": runs}


def _query(polygonal: Any, prepared: Any, start: Floats, goal: Floats) -> Floats | None:
    """The corners of its path, shape (K+1, n); None without one."""
    from_start, _ = prepared.G.shortest_path(goal)
    boxes, _, _ = from_start(start)
    if boxes is None:
        return None
    _, corners, _, _ = polygonal.iterative_planner(prepared.B, start, goal, boxes, verbose=False)
    return np.asarray(corners)


def _warm_up(library: Any, polygonal: Any, n: int) -> None:
    """Plan through three boxes: the first use of its solver is not the scene's."""
    low = np.zeros((3, n))
    low[:, 0] = range(3)
    prepared = library.SafeSet(low, low + 1.0, verbose=False)
    _query(polygonal, prepared, low[0] + 0.5, low[2] + 0.4)
