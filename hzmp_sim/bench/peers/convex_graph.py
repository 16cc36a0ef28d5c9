"""Drake's graph of convex sets (Marcucci, Umenhoffer, Parrilo, Tedrake 2021 and later).

One segment in each cell (a Bezier curve of order 1), cost its length; the convex relaxation, whose
optimum is a lower bound, then the best of some rounded paths. The faces between cells are given, so
that neither Drake's search for pairs of sets that meet counts, nor the contacts in corners that it
finds, which loosen the relaxation. Its preprocessing, linear programs for each edge, is off: it
takes far longer than it saves. Solved by Clarabel, which needs no licence.
"""

from __future__ import annotations

import importlib
import math
import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from hzmp_planners._arrays import Bools, Floats
from hzmp_sim.bench.boxes.recheck import recheck
from hzmp_sim.bench.boxes.scene import BoxScene
from hzmp_sim.bench.peers.cells import cells_of
from hzmp_sim.bench.peers.results import Run

GCS = "gcs"
ROUNDED_PATHS = 10
"""Paths that are rounded; Drake's default is 5."""
_MOST_SECONDS = 1.0  # longest stay in a cell: Drake's default, 20, breaks the solver now and then
_AT = 1e-9  # a start this far outside of a cell, relative to the workspace, is in it


def measure_convex_graph(scene: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Build the graph, solve and round; then the relaxation alone, for its bound.

    Returns:
        "runs": fields of one `Run`. What is built is its `offline_s`, although Drake adds start and
        goal to it.
    """
    planning: Any = importlib.import_module("pydrake.planning")
    sets: Any = importlib.import_module("pydrake.geometry.optimization")
    solvers: Any = importlib.import_module("pydrake.solvers")
    which = BoxScene.from_dict(scene)
    low, high, edges = cells_of(which)
    slack = _AT * which.size
    began = time.process_time()
    graph = planning.GcsTrajectoryOptimization(which.n)
    both = [tuple(pair) for pair in np.vstack([edges, edges[:, ::-1]]).tolist()]
    boxes = [sets.HPolyhedron.MakeBox(a, b) for a, b in zip(low, high, strict=True)]
    cells = graph.AddRegions(boxes, both, order=1, h_max=_MOST_SECONDS, name="cells")
    source = graph.AddRegions([sets.Point(which.start)], order=0, name="start")
    target = graph.AddRegions([sets.Point(which.goal)], order=0, name="goal")
    at_start, at_goal = (
        np.flatnonzero(_at(low, high, end, slack)).tolist() for end in (which.start, which.goal)
    )
    graph.AddEdges(source, cells, edges_between_regions=[(0, i) for i in at_start])
    graph.AddEdges(cells, target, edges_between_regions=[(i, 0) for i in at_goal])
    graph.AddPathLengthCost()
    options = sets.GraphOfConvexSetsOptions()
    options.convex_relaxation = True
    options.preprocessing = False
    options.max_rounded_paths = ROUNDED_PATHS
    options.rounding_seed = seed
    options.solver = options.restriction_solver = solvers.ClarabelSolver()
    built = time.process_time()
    trajectory, result = graph.SolvePath(source, target, options)
    solved = time.process_time()
    options.max_rounded_paths = 0
    _, relaxed = graph.SolvePath(source, target, options)
    bound_s = time.process_time() - solved
    offline, spent = built - began, solved - built
    run = Run(
        which.name, GCS, "", seed, [], spent, offline, bound_s=bound_s,
        lower_bound=_cost(relaxed), note="" if result.is_success() else "no path",
    )  # fmt: skip
    facts: dict[str, Any] = {}
    if result.is_success():
        points = _corners(trajectory)
        bounds = which.lo, which.hi
        true = recheck(points.tolist(), which.obstacles(), bounds, which.start, which.goal)
        facts = {
            "history": [[spent, true.length]],
            "cost": true.length,
            "claimed": _cost(result),
            "depth": true.depth,
            "end_error": true.end_error,
        }
    return {"runs": [asdict(run) | facts]}


def _at(low: Floats, high: Floats, point: Floats, slack: float) -> Bools:
    """Which boxes hold a point."""
    return np.asarray(((point >= low - slack) & (point <= high + slack)).all(axis=1))


def _cost(result: Any) -> float:
    """Optimal cost of a solver's result, 0 without one."""
    cost = float(result.get_optimal_cost()) if result.is_success() else 0.0
    return cost if math.isfinite(cost) else 0.0


def _corners(trajectory: Any) -> Floats:
    """End points of the segments of a composite trajectory of order 1, shape (K+1, n)."""
    segments = [
        trajectory.segment(k).control_points() for k in range(trajectory.get_number_of_segments())
    ]
    ends = [segments[0][:, 0], *(segment[:, -1] for segment in segments)]
    return np.array(ends)
