"""Measure how a free space follows obstacles that move."""

from __future__ import annotations

import statistics
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from hzmp_sim.bench.scale.cover import cover_error
from hzmp_sim.bench.scale.results import MovingResult
from hzmp_sim.bench.scale.static import timed_space
from hzmp_sim.bench.worlds import World, WorldSpec

SWING_M = 0.5
"""Half of the way that a moving obstacle swings: half the mean distance of obstacles [m]."""
STEP_RAD = 0.3
"""Phase of that swing between two steps: moves of up to 0.15 m [rad]."""


def measure_moving(spec: Mapping[str, Any], moved: int, steps: int, checks: int) -> dict[str, Any]:
    """Let some obstacles of a world swing, each along a direction of its own.

    Args:
        spec: fields of a `WorldSpec`.
        moved: how many obstacles move.
        steps: how often they do.
        checks: steps whose free space is also decomposed anew, and whose cover is verified.

    Returns:
        Fields of a `MovingResult`.
    """
    which = WorldSpec(**spec)
    world = which.make()
    rng = np.random.default_rng([which.seed, moved])
    chosen = np.sort(rng.choice(len(world.obstacles), moved, replace=False)).tolist()
    ways = rng.standard_normal((moved, world.n))
    ways *= SWING_M / np.linalg.norm(ways, axis=1)[:, None]
    phases = rng.uniform(0.0, 2.0 * np.pi, moved)
    others = [block for i, block in enumerate(world.obstacles) if i not in chosen]
    static, *_ = timed_space(World(world.name, world.lo, world.hi, tuple(others)))
    whole, *_ = timed_space(world)
    watched = set(np.linspace(0, steps - 1, checks).astype(int).tolist())
    times: dict[str, list[float]] = {"static": [], "numbered": [], "fresh": []}
    leaves, fresh_leaves, errors = [], [], [0.0]
    for step in range(steps):
        swing = np.sin(phases + STEP_RAD * step)[:, None] * ways
        now = {i: world.obstacles[i] + move for i, move in zip(chosen, swing, strict=True)}
        one, spent = _updated(static, list(now.values()))
        times["static"].append(spent)
        two, spent = _updated(whole, now)
        times["numbered"].append(spent)
        leaves.append(len(one))
        if step in watched:
            blocks = [now.get(i, block) for i, block in enumerate(world.obstacles)]
            current = World(world.name, world.lo, world.hi, tuple(blocks))
            fresh, *parts = timed_space(current)
            times["fresh"].append(sum(parts))
            fresh_leaves.append(len(fresh))
            errors += [cover_error(current, space) for space in (one, two)]
    result = MovingResult(
        family=which.family,
        title=world.name,
        obstacles=len(world.obstacles),
        moved=moved,
        seed=which.seed,
        static_s=times["static"],
        numbered_s=times["numbered"][1:],
        first_s=times["numbered"][0],
        fresh_s=times["fresh"],
        leaves=statistics.median(leaves),
        fresh_leaves=statistics.median(fresh_leaves),
        cover_error=max(errors),
    )
    return asdict(result)


def _updated(
    space: FreeSpace, shapes: Sequence[Polytope] | Mapping[int, Polytope]
) -> tuple[FreeSpace, float]:
    """The space with obstacles elsewhere, and what that took with its graph [s]."""
    began = time.perf_counter()
    moved = space.with_obstacles(shapes)
    _ = moved.graph
    return moved, time.perf_counter() - began
