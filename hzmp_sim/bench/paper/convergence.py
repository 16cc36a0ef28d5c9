"""Sections 4.1 to 4.3: the cost in each iteration of algorithm 1."""

from __future__ import annotations

import statistics
from dataclasses import asdict
from itertools import pairwise
from typing import Any

import numpy as np

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import plan, verify
from hzmp_planners.planning.paper import Iteration, PaperSettings
from hzmp_sim.bench.paper.results import Convergence, Step
from hzmp_sim.bench.paper.worlds import WORLDS, PaperWorld
from hzmp_sim.bench.process_clock import process_clock

AFTER = (1, 8, 50)
"""Iterations after which costs are compared; the paper's figure 6 ends at 8."""
SHOWN = 24
"""Iterations that are drawn."""
_LONG = 60.0  # [s]: iterations end a run, not the clock
_PROVED = 1e-6  # gap of the optima


def measure_convergence(world: str, seeds: list[int]) -> dict[str, Any]:
    """Run algorithm 1 for a fixed number of iterations.

    Args:
        world: one of `WORLDS`.
        seeds: one run each.

    Returns:
        Fields of a `Convergence`.
    """
    where = WORLDS[world]()
    space = where.free_space()
    known = plan(space, where.start, where.goal, gap=_PROVED, time_limit=_LONG)
    checked = verify(known)
    with process_clock():
        runs = [iterations(where, space, max(AFTER), seed) for seed in seeds]
    spent = [b.time_s - a.time_s for run in runs for a, b in pairwise(run)]
    result = Convergence(
        world=world,
        section=where.section,
        unit=where.unit,
        n=space.n,
        obstacles=len(where.obstacles),
        leaves=len(space),
        faces=len(space.graph),
        straight=float(np.linalg.norm(where.goal - where.start)),
        optimum=known.cost,
        bound=known.lower_bound,
        defects=[] if checked.ok else [checked.describe()],
        steps=[_step(one) for one in runs[0][:SHOWN]],
        # A run ends early when its path is as short as the straight line.
        after={str(k): [run[min(k, len(run)) - 1].best for run in runs] for k in AFTER},
        iteration_s=statistics.median(spent),
        made_up=where.made_up,
    )
    return asdict(result)


def iterations(
    world: PaperWorld, space: FreeSpace, count: int, seed: int = 0, samples: int | None = None
) -> list[Iteration]:
    """The first iterations of algorithm 1 in a world.

    Args:
        world: what to plan in.
        space: its decomposition.
        count: how many iterations.
        seed: of the samples.
        samples: points on each shared face in each iteration; None: as many as by default.
    """
    seen: list[Iteration] = []
    method = PaperSettings(
        iterations=count, samples=samples or PaperSettings().samples, observe=seen.append
    )
    plan(space, world.start, world.goal, gap=0.0, time_limit=_LONG, seed=seed, method=method)
    return seen


def _step(one: Iteration) -> Step:
    return Step(
        number=one.number, cost=one.cost, best=one.best, adopted=one.adopted,
        sequences=one.sequences, faces=one.faces, leaves=int(np.count_nonzero(one.leaves)),
    )  # fmt: skip
