"""Measure everything that the settings ask for, each run in a fresh process."""

from __future__ import annotations

import datetime
import math
import time
from contextlib import ExitStack
from dataclasses import asdict
from typing import Any

import numpy as np
from rich.console import Console

from hzmp_sim.bench.boxes.laws import default_scenes
from hzmp_sim.bench.boxes.scene import BoxScene, read_scenes
from hzmp_sim.bench.fresh import FreshProcesses
from hzmp_sim.bench.machine import machine
from hzmp_sim.bench.peers.jobs import jobs_of, run_job
from hzmp_sim.bench.peers.planners import asked_for, is_sampler
from hzmp_sim.bench.peers.results import CLEAN_TOL, OURS, Results, Run, SceneResult
from hzmp_sim.bench.peers.settings import PeersSettings, effort_of
from hzmp_sim.bench.peers.visible import VISIBILITY
from hzmp_sim.progress import progress

_PEERS = "hzmp_sim.bench.peers"
_LIBRARIES = ("numpy", "scipy", "clarabel")


def bench_peers(settings: PeersSettings, command: str) -> Results:
    """Run the benchmark.

    Args:
        settings: what to measure.
        command: how to call it again, for the record.

    Raises:
        TaskError: this system cannot run the measuring process.
        SceneError: a scene file that cannot be read.
    """
    began = time.monotonic()
    started = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M:%S")
    effort = effort_of(settings)
    scenes, remarks = _scenes(settings)
    peers = asked_for(settings)
    skipped = list(dict.fromkeys(line for one in peers if (line := one.missing) is not None))
    there = [one for one in peers if one.missing is None]
    libraries = [name for one in there for name in one.distributions]
    facts = machine(list(dict.fromkeys([*_LIBRARIES, *libraries])))
    rng = np.random.default_rng(settings.seed)
    results: list[SceneResult] = []
    runs: list[Run] = []
    modules = [f"{_PEERS}.ours", f"{_PEERS}.visible"]
    if any(is_sampler(one.name) for one in there):
        modules.append(f"{_PEERS}.ompl.measure")
    listed = [(scene, jobs_of(scene, there, settings, effort)) for scene in scenes]
    with ExitStack() as stack:
        processes = stack.enter_context(FreshProcesses(*modules))
        total = sum(len(jobs) for _, (jobs, _) in listed)
        console = Console(stderr=True, highlight=False)
        advance = stack.enter_context(progress("Planning", total, console=console))
        for scene, (jobs, left_out) in listed:
            skipped += left_out
            found: list[dict[str, Any]] = []
            # In a shuffled order: what else the machine does meets every planner alike.
            for number in rng.permutation(len(jobs)).tolist():
                found.append(run_job(processes, jobs[number]))
                advance(1)
            mine = [Run(**run) for answer in found for run in answer.get("runs", ())]
            mine.sort(key=lambda run: (run.planner, run.check, run.seed))
            runs += mine
            results.append(_scene_result(scene, found, mine))
            console.print(_line(results[-1], len(mine)))
    return Results(
        command=command,
        machine=facts,
        settings=asdict(settings)
        | {"scenes": None if settings.scenes is None else str(settings.scenes)}
        | {"effort": asdict(effort)},
        started=started,
        scenes=results,
        runs=runs,
        skipped=skipped,
        remarks=remarks,
        seconds=time.monotonic() - began,
    )


def _scenes(settings: PeersSettings) -> tuple[list[BoxScene], list[str]]:
    """The scenes, and what there is to say about them."""
    if settings.scenes is None:
        return default_scenes(settings.seed, settings.quick)
    return read_scenes(settings.scenes), []


def _line(scene: SceneResult, runs: int) -> str:
    """How far the benchmark is: a line for each scene that is done."""
    best = "no path" if scene.reference is None else f"best path {scene.reference:.6g} m"
    return f"{scene.name}: {runs} runs, {best}"


def _scene_result(scene: BoxScene, found: list[dict[str, Any]], runs: list[Run]) -> SceneResult:
    """What is known about a scene after all its jobs."""
    none = {"leaves": 0, "faces": 0}  # where ours failed
    counts = next((answer for answer in found if "leaves" in answer), none)
    long = [answer["reference"] for answer in found if "reference" in answer]
    reference, source = _reference(scene, runs, long)
    bounds = [run.lower_bound for run in runs if run.planner in OURS]
    bounds += [answer["lower_bound"] for answer in long]
    cells = len(scene.cells[0]) if scene.cells is not None else counts["leaves"]
    return SceneResult(
        name=scene.name,
        group=scene.group,
        n=scene.n,
        obstacles=len(scene.low),
        size=scene.size,
        leaves=counts["leaves"],
        faces=counts["faces"],
        cells=cells,
        given=scene.cells is not None,
        straight=math.dist(scene.start, scene.goal),
        reference=reference,
        source=source,
        lower_bound=max(bounds, default=0.0),
    )


def _reference(
    scene: BoxScene, runs: list[Run], long: list[dict[str, Any]]
) -> tuple[float | None, str]:
    """Length of the best path known [m], and where it is from.

    In the plane that of the visibility graph, which is exact. Else the shortest that anybody found:
    paths that a solver left a little inside of an obstacle are no evidence.
    """
    known = [(run.cost, run.planner) for run in runs if run.cost is not None and _clean(scene, run)]
    for cost, planner in known:
        if planner == VISIBILITY:
            return cost, planner
    if scene.optimum is not None:
        known.append((scene.optimum, "file"))
    known += [
        (answer["cost"], "long run")
        for answer in long
        if answer["cost"] is not None and answer["depth"] <= CLEAN_TOL * scene.size
    ]
    return min(known) if known else (None, "")


def _clean(scene: BoxScene, run: Run) -> bool:
    return max(run.depth, run.end_error) <= CLEAN_TOL * scene.size
