"""The planners on convex sets beside HZ-MP, scene by scene."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hzmp_sim.bench.peers.analysis import is_free
from hzmp_sim.bench.peers.convex_graph import GCS
from hzmp_sim.bench.peers.fast_paths import FAST_PATHS
from hzmp_sim.bench.peers.planners import BY_NAME
from hzmp_sim.bench.peers.results import WARM, Results, Run, SceneResult
from hzmp_sim.bench.statistics import median, time_to, time_to_gap
from hzmp_sim.bench.tables import Table
from hzmp_sim.bench.words import costs, times

_EQUAL = 1e-6  # lengths this close, relative to them, are one: solvers' tolerances


def convex_sets(results: Results) -> Table:
    """Offline time, query, cost and bound on the same cells."""
    rows: list[tuple[str, ...]] = []
    asked = float(results.settings["gap"])
    for scene in results.scenes:
        runs = {
            name: [run for run in results.runs if (run.scene, run.planner) == (scene.name, name)]
            for name in (WARM, FAST_PATHS, GCS)
        }
        if not runs[FAST_PATHS] and not runs[GCS]:
            continue
        name = f"{scene.name} ({scene.cells:,}{' given' if scene.given else ''})"
        rows += [
            (name, *_row(scene, planner, mine, runs[WARM], asked))
            for planner, mine in runs.items()
            if mine
        ]
    return Table(
        "Planners on convex sets",
        (
            "scene (cells)", "planner", "offline", "query", "over ours, equal cost",
            "equal cost and gap", "cost / best", "bound / best", "gap", "bound, more time", "note",
        ),
        rows,
        "Offline is what serves any start and goal: ours is decomposition and graph, theirs starts "
        "from the cells. The query of ours runs to the asked gap and includes the bound. Drake's "
        "is one call that solves the relaxation and rounds; it does not return the bound, and a "
        "second call for that is the last time. Over ours: its query over the time "
        "at which HZ-MP had a path as short (up to 1e-6) or shorter, then as small a gap, too (or "
        "the gap at which it was asked to stop).",
    )  # fmt: skip


def _over(
    query: float, cost: float, gap: float, asked: float, ours: Sequence[Run]
) -> tuple[str, str]:
    """A time over that of ours to an equal cost, and to an equal gap as well if there is one."""
    equal = [time_to(run.history, cost * (1.0 + _EQUAL)) for run in ours]
    shown = costs(query / median(equal), 2)
    if math.isinf(gap):
        return shown, ""
    both = [
        max(when, time_to_gap(run.history, run.bounds, max(gap, asked)))
        for when, run in zip(equal, ours, strict=True)
    ]
    return shown, costs(query / median(both), 2)


def _row(
    scene: SceneResult, planner: str, runs: Sequence[Run], ours: Sequence[Run], asked: float
) -> tuple[str, ...]:
    """The cells after the scene's: medians of the runs that end.

    Args:
        scene: where they ran.
        planner: whose runs they are.
        runs: at least one.
        ours: those of HZ-MP there.
        asked: gap at which HZ-MP stops.
    """
    title, best = BY_NAME[planner].title, scene.reference
    done = [run for run in runs if is_free(run, scene)]
    if not done or best is None:
        note = runs[0].note if not done or runs[0].cost is None else "no reference"
        return (title, *["-"] * 8, note or "not free")
    cost = median(run.cost or math.inf for run in done)
    bound = median(run.lower_bound for run in done)
    query = median(run.total_s for run in done)
    extra = median(run.bound_s for run in done)
    gap = (cost - bound) / bound if bound else math.inf
    return (
        title,
        times(median(run.offline_s for run in done)),
        times(query),
        *(("", "") if planner == WARM else _over(query, cost, gap, asked, ours)),
        costs(cost / best, 5),
        costs(bound / best, 5) if bound else "none",
        f"{max(gap, 0.0):.1e}" if bound else "none",
        times(extra) if extra else "",
        "" if planner != WARM else done[0].note,
    )
