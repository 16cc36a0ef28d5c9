"""Run the experiments, each in a fresh process."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import asdict
from typing import Any

from hzmp_sim.bench.fresh import FreshProcesses
from hzmp_sim.bench.machine import machine
from hzmp_sim.bench.paper.reported import LEAST_COST
from hzmp_sim.bench.paper.results import Convergence, Results, Run, Scene
from hzmp_sim.bench.paper.settings import PaperBenchSettings, effort_of
from hzmp_sim.bench.paper.worlds import WORLDS
from hzmp_sim.progress import progress

_PAPER = "hzmp_sim.bench.paper"
_BATCH = 25  # runs in one process


def bench_paper(settings: PaperBenchSettings, command: str) -> Results:
    """Run the benchmark.

    Args:
        settings: what to measure.
        command: how to call it again, for the record.

    Raises:
        TaskError: a run that failed, which is a defect.
    """
    began = time.monotonic()
    effort = effort_of(settings)
    facts = machine(("numpy", "scipy", "clarabel"))
    seeds = list(range(settings.seed, settings.seed + effort.runs))
    batches = [seeds[k : k + _BATCH] for k in range(0, len(seeds), _BATCH)]
    with ExitStack() as stack:
        modules = [f"{_PAPER}.convergence", f"{_PAPER}.rectangles"]
        processes = stack.enter_context(FreshProcesses(*modules))
        total = len(WORLDS) + 1 + len(batches) + effort.scenes
        advance = stack.enter_context(progress("Planning", total))

        def measured(task: str, **arguments: Any) -> dict[str, Any]:
            found: dict[str, Any] = processes.run(f"{_PAPER}.{task}", arguments)
            advance(1)
            return found

        repeats = list(range(settings.seed, settings.seed + effort.repeats))
        experiments = [
            measured("convergence:measure_convergence", world=world, seeds=repeats)
            for world in WORLDS
        ]
        drawn = measured("rectangles:find_scenes", count=effort.scenes, seed=settings.seed)
        scenes = [Scene(**one) for one in drawn["scenes"]]
        chosen = min(scenes, key=lambda scene: abs(scene.optimum - LEAST_COST)).seed
        task, budget = "rectangles:measure_rectangles", settings.budget
        many_runs = [measured(task, scene=chosen, seeds=part, budget=budget) for part in batches]
        many_scenes = [
            measured(task, scene=scene.seed, seeds=[settings.seed], budget=budget)
            for scene in scenes
        ]
    return Results(
        command=command,
        machine=facts,
        settings=asdict(settings) | {"effort": asdict(effort)},
        experiments=[Convergence.from_dict(found) for found in experiments],
        scenes=scenes,
        passed=drawn["passed"],
        chosen=chosen,
        many_runs=[Run(**run) for found in many_runs for run in found["runs"]],
        many_scenes=[Run(**run) for found in many_scenes for run in found["runs"]],
        seconds=time.monotonic() - began,
    )
