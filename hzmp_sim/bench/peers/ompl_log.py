"""The results in the text format of OMPL's benchmarks, which `ompl_benchmark_statistics.py` reads.

One file for each scene and kind of edge check. With it come OMPL's plots and Planner Arena.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from hzmp_sim import __version__
from hzmp_sim.bench.peers.analysis import effort, is_free
from hzmp_sim.bench.peers.planners import BY_NAME, PLANNERS, is_sampler
from hzmp_sim.bench.peers.results import Results, Run, SceneResult

FOLDER = "ompl_logs"
_STATUSES = ("Timeout", "Exact solution")
_PROPERTIES = (
    "time REAL", "solved BOOLEAN", "status ENUM", "solution length REAL",
    "correct solution strict BOOLEAN", "time to first solution REAL", "lower bound REAL",
    "preprocessing time REAL", "checked motions INTEGER", "checked states INTEGER",
)  # fmt: skip
_PROGRESS = ("time REAL", "best cost REAL")


def write_logs(results: Results, folder: Path) -> list[Path]:
    """Write SCENE.CHECK.log for each scene and check to a folder that is made; returns paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for check in effort(results)["checks"]:
        for scene in results.scenes:
            path = folder / f"{scene.name}.{check}.log"
            path.write_text(log_text(results, scene, check), encoding="utf-8")
            paths.append(path)
    return paths


def log_text(results: Results, scene: SceneResult, check: str) -> str:
    """The log of one scene with one kind of edge check."""
    runs = {
        planner.name: [run for run in results.of(planner.name, check) if run.scene == scene.name]
        for planner in PLANNERS
    }
    there = {name: mine for name, mine in runs.items() if mine}
    done, facts = effort(results), results.machine
    spent = sum(run.total_s for mine in there.values() for run in mine)
    lines = [
        f"hzmp-sim version {__version__}",
        # A name is one word in this format.
        f"Experiment {scene.name}_{check}",
        "0 experiment properties",
        "Running on localhost",
        f"Starting at {results.started}",
        "<<<|",
        f"{scene.obstacles} boxes in {scene.n} dimensions; edges checked: {check}",
        f"{results.command}",
        "|>>>",
        "<<<|",
        f"{facts['processor']}, {facts['cores']} cores",
        "|>>>",
        f"{results.settings['seed']} is the random seed",
        f"{done['budget']:g} seconds per run",
        "0 MB per run",
        f"{done['runs']} runs per planner",
        f"{spent:.6f} seconds spent to collect the data",
        "1 enum type",
        "status|" + "|".join(_STATUSES),
        f"{len(there)} planners",
    ]
    for name, mine in there.items():
        lines += _planner(name, mine, scene)
    return "\n".join(lines) + "\n"


def _planner(name: str, runs: Sequence[Run], scene: SceneResult) -> list[str]:
    family = "geometric_" if is_sampler(name) else ""
    return [
        f"{family}{name.replace('-', '_')}",
        "1 common properties",
        f"name = {BY_NAME[name].title}",
        f"{len(_PROPERTIES)} properties for each run",
        *_PROPERTIES,
        f"{len(runs)} runs",
        *(_line(run, scene) for run in runs),
        f"{len(_PROGRESS)} progress properties for each run",
        *_PROGRESS,
        f"{len(runs)} runs",
        *("".join(f"{when:.9f},{cost:.12g},;" for when, cost in run.history) for run in runs),
        ".",
    ]


def _line(run: Run, scene: SceneResult) -> str:
    """The values of a run, each with "; " behind it; nan where there is none."""
    solved = is_free(run, scene)
    first = run.history[0][0] if run.history else math.nan
    values = (
        f"{run.total_s:.9f}", str(int(solved)), str(int(solved)),
        f"{math.nan if run.cost is None else run.cost:.12g}", str(int(solved)), f"{first:.9f}",
        f"{run.lower_bound:.12g}", f"{run.offline_s:.9f}", str(run.edges), str(run.states),
    )  # fmt: skip
    return "".join(f"{value}; " for value in values)
