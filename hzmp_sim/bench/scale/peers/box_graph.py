"""fastpathplanning (Marcucci, Nobel, Tedrake, Boyd 2023): its preprocessing of our leaves.

It plans through given axis-aligned boxes. Its offline step finds their intersections, the line
graph of these, and a representative point in each by one second-order cone program.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from hzmp_planners.free_space import FreeSpace
from hzmp_sim.bench.worlds import WorldSpec


def measure_box_graph(spec: Mapping[str, Any], limit: float) -> dict[str, Any]:
    """Give the leaves of a world of axis-aligned boxes to fastpathplanning.

    Args:
        spec: fields of a `WorldSpec`.
        limit: the caller ends this process after it [s].

    Returns:
        Some fields of a `PeerResult`.
    """
    library: Any = importlib.import_module("fastpathplanning")
    world = WorldSpec(**spec).make()
    space = FreeSpace.decompose(world.bounds, world.obstacles)
    hulls = [leaf.interval_hull() for leaf in space.leaves]
    low, high = (np.array(ends) for ends in zip(*hulls, strict=True))
    began = time.perf_counter()
    graph = library.SafeSet(low, high, verbose=False).G
    spent = time.perf_counter() - began
    return {
        "pieces": len(low),
        "seconds": spent,
        "note": f"line graph of {graph.number_of_nodes():,} nodes and "
        f"{graph.number_of_edges():,} edges; takes boxes only",
    }
