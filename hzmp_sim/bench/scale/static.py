"""Measure one world that stands still: time, memory, leaves, exactness, point location."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from hzmp_planners.free_space import FreeSpace
from hzmp_sim.bench.memory import peak_mb, resident_mb
from hzmp_sim.bench.scale.cover import cover_error, misplaced_points
from hzmp_sim.bench.scale.naive import naive_count
from hzmp_sim.bench.scale.results import WorldResult
from hzmp_sim.bench.worlds import World, WorldSpec

SHORT_S, SHORT_RUNS = 0.5, 10
"""A world is decomposed up to 10 times as often while that takes less than this together [s]."""


def measure_world(
    spec: Mapping[str, Any], repeats: int, points: int, naive: bool, grow: bool
) -> dict[str, Any]:
    """Decompose a world `repeats` times, then look at the result.

    Args:
        spec: fields of a `WorldSpec`.
        repeats: least number of decompositions, each with its leaf graph.
        points: to locate, uniform in the workspace.
        naive: whether to count the cells of the naive orders too.
        grow: whether to make the leaves overlap too.

    Returns:
        Fields of a `WorldResult`.
    """
    which = WorldSpec(**spec)
    world = which.make()
    base = resident_mb()
    worked = time.process_time()
    space, decompose, graph = timed_space(world)
    peak = peak_mb()
    decompositions, graphs = [decompose], [graph]
    while len(graphs) < repeats or (
        len(graphs) < SHORT_RUNS * repeats and sum(decompositions) + sum(graphs) < SHORT_S
    ):
        space, decompose, graph = timed_space(world)
        decompositions.append(decompose)
        graphs.append(graph)
    worked = time.process_time() - worked
    rng = np.random.default_rng(which.seed)
    X = rng.uniform(world.lo, world.hi, (points, world.n))
    began = time.perf_counter()
    space.leaf_of(X)
    locating = time.perf_counter() - began
    size, saving, loading = _stored(space)
    counts: dict[str, Any] = {}
    if grow:
        began = time.perf_counter()
        counts["overlapping"] = len(space.overlapping())
        counts["overlapping_s"] = time.perf_counter() - began
    if naive:
        counts["naive"] = naive_count(world.lo, world.hi, world.obstacles)
        counts["naive_reach"] = naive_count(world.lo, world.hi, world.obstacles, "reach")
    result = WorldResult(
        family=which.family,
        title=world.name,
        n=world.n,
        obstacles=len(world.obstacles),
        seed=which.seed,
        leaves=len(space),
        faces=len(space.graph),
        decompose_s=decompositions,
        graph_s=graphs,
        cpu_s=worked / len(graphs),
        peak_mb=peak,
        base_mb=base,
        cover_error=cover_error(world, space),
        points=points,
        misplaced=misplaced_points(world, space, X),
        locate_s=locating,
        file_mb=size,
        save_s=saving,
        load_s=loading,
        **counts,
    )
    return asdict(result)


def measure_ours(spec: Mapping[str, Any]) -> dict[str, Any]:
    """Our side of a comparison: the better of two decompositions with their graphs.

    Returns:
        Some fields of a `PeerResult`.
    """
    world = WorldSpec(**spec).make()
    runs = [timed_space(world) for _ in range(2)]
    return {
        "title": world.name,
        "obstacles": len(world.obstacles),
        "our_leaves": len(runs[0][0]),
        "our_s": min(decompose + graph for _, decompose, graph in runs),
    }


def timed_space(world: World) -> tuple[FreeSpace, float, float]:
    """A free space with its graph, and what each of them took [s]."""
    began = time.perf_counter()
    space = FreeSpace.decompose(world.bounds, world.obstacles)
    decomposed = time.perf_counter()
    _ = space.graph
    return space, decomposed - began, time.perf_counter() - decomposed


def _stored(space: FreeSpace) -> tuple[float, float, float]:
    """Size of the saved space [MB], and what saving and loading take [s]."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "space.npz"
        began = time.perf_counter()
        space.save(path)
        saved = time.perf_counter()
        FreeSpace.load(path)
        return path.stat().st_size / 1e6, saved - began, time.perf_counter() - saved
