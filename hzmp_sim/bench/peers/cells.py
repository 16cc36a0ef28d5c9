"""The convex cells that a planner on given sets plans in."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_sim.bench.boxes.scene import BoxScene


def cells_of(scene: BoxScene) -> tuple[Floats, Floats, Ints]:
    """Lower and upper corners of free boxes, each (C, n) [m], and pairs that share a face (E, 2).

    The scene's own cells if it has some; else our leaves, which are boxes among boxes.
    """
    if scene.cells is not None and scene.edges is not None:
        return *scene.cells, scene.edges
    space = scene.free_space()
    hulls = [leaf.interval_hull() for leaf in space.leaves]
    low, high = (np.array(ends) for ends in zip(*hulls, strict=True))
    return low, high, np.asarray(space.graph.ends, dtype=np.int64)


def face_pairs(count: int, edges: Ints) -> int:
    """Ordered pairs of faces of one cell, of all cells together: what paths can do in them.

    Args:
        count: of cells.
        edges: pairs of cells that share a face, shape (E, 2).
    """
    return int((np.bincount(edges.ravel(), minlength=count) ** 2).sum())
