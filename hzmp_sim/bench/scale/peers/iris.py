"""Drake's IRIS (Deits and Tedrake 2015): one large convex region after the other.

Each region grows around a point that no region covers yet, in the given polytopes' complement,
until less than `UNCOVERED` of the free volume is left, or the time is up.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from hzmp_planners._arrays import Bools, Floats
from hzmp_sim.bench.worlds import World, WorldSpec

UNCOVERED = 0.01
"""Part of the free volume, by samples, at which the build ends."""
SAMPLES = 20_000
"""Points that seed the regions and measure progress; as many others measure the result."""


def measure_iris(spec: Mapping[str, Any], limit: float) -> dict[str, Any]:
    """Cover the free space of a world with IRIS regions.

    Args:
        spec: fields of a `WorldSpec`.
        limit: no region is begun after this time [s].

    Returns:
        Some fields of a `PeerResult`.
    """
    sets: Any = importlib.import_module("pydrake.geometry.optimization")
    which = WorldSpec(**spec)
    world = which.make()
    rng = np.random.default_rng([which.seed, SAMPLES])
    seeds, checks = rng.uniform(world.lo, world.hi, (2, SAMPLES, world.n))
    left = seeds[~_blocked(world, seeds)]
    wanted = UNCOVERED * len(left)
    options = sets.IrisOptions()
    options.require_sample_point_is_contained = True
    began = time.perf_counter()
    domain = sets.HPolyhedron.MakeBox(world.lo, world.hi)
    obstacles = [sets.HPolyhedron(block.A, block.b) for block in world.obstacles]
    regions: list[tuple[Floats, Floats]] = []
    while len(left) > wanted and time.perf_counter() - began < limit:
        region = sets.Iris(obstacles, left[0], domain, options)
        regions.append((region.A(), region.b()))
        left = left[1:][~_inside(*regions[-1], left[1:])]
    spent = time.perf_counter() - began
    blocked = _blocked(world, checks)
    covered = np.any([_inside(A, b, checks) for A, b in regions], axis=0)
    free = (~blocked).sum()
    return {
        "pieces": len(regions),
        "seconds": spent,
        "lost": float((~covered & ~blocked).sum() / free),
        "leaked": float((covered & blocked).sum() / free),
        "note": f"volumes by {SAMPLES:,} points"
        + ("" if len(left) <= wanted else f"; stopped after {limit:g} s"),
    }


def _inside(A: Floats, b: Floats, X: Floats) -> Bools:
    return np.asarray((X @ A.T - b).max(axis=1) <= 0.0)


def _blocked(world: World, X: Floats) -> Bools:
    """Which points are inside an obstacle."""
    return np.asarray(np.any([_inside(block.A, block.b, X) for block in world.obstacles], axis=0))
