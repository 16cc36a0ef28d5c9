"""Many seeded flights through the worlds that move, with the planner in the loop.

Each seed begins the motions of a world at other moments and speeds. What is compared: planning in
flight; planning only when at rest, as a planner outside of the loop would; other latencies; and
predictions that do not hold, since half of the motions are not announced and turn about.

    python benchmarks/replanning_flights.py --flights 500
"""

from __future__ import annotations

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple

import cyclopts
import numpy as np

import hzmp_sim as hz

WORLDS = ("crossing_traffic", "pendulum_gallery", "sliding_doors", "warehouse")
BODIES = ("point", "quadrotor")


class Case(NamedTuple):
    """One flight."""

    world: str
    body: str
    seed: int
    latency: float
    """[s]"""
    from_rest: bool
    announced: bool
    """Whether the planner is told of the motions."""


def fly(case: Case) -> dict[str, Any]:
    """The metrics of a flight, and its length in `time_s`."""
    script = hz.load_scene(case.world, body=case.body).motion
    assert script is not None
    script = script.with_phases(case.seed)
    if not case.announced:
        motions = [
            replace(one, announced=number % 2 == 0) for number, one in enumerate(script.motions)
        ]
        script = replace(script, motions=motions)
    scene = hz.load_scene(case.world, body=case.body, motion=script)
    loop = hz.Replanning(latency=case.latency, from_rest=case.from_rest, duration=90.0)
    run = hz.simulate(scene, settings=hz.RunSettings(seed=case.seed, video=False, replanning=loop))
    assert run.log is not None
    return {**run.metrics, "time_s": float(run.log.time[-1])}


def main(*, flights: int = 48, others: int = 16, processes: int | None = None) -> None:
    """Print a Markdown table.

    Args:
        flights: with the planner in the loop, in all.
        others: for each of the ways to compare with.
        processes: that fly at the same time; default: as many as there are cores.
    """
    modes: list[tuple[str, int, dict[str, Any]]] = [("in the loop, 50 ms", flights, {})]
    modes += [("from rest only", flights, {"from_rest": True})]
    modes += [(f"{1e3 * t:.0f} ms", others, {"latency": t}) for t in (0.0, 0.02, 0.1, 0.3)]
    modes += [("half not announced", others, {"announced": False})]
    columns = ("planning", "flights", "goal reached", "with contact", "of these predicted",
               "without a proof [s]", "time to goal, mean [s]", "ratio", "replans, mean",
               "latency, median [ms]", "p99 [ms]")  # fmt: skip
    print("| " + " | ".join(columns) + " |")
    print("|---" * len(columns) + "|")
    usual: dict[tuple[str, str, int], float] = {}
    with ProcessPoolExecutor(processes or os.cpu_count()) as pool:
        for name, count, changes in modes:
            cases = _cases(count, changes)
            found = list(pool.map(fly, cases))
            times = {case[:3]: m["time_s"] for case, m in zip(cases, found, strict=True)
                     if m["status"] == "goal_reached"}  # fmt: skip
            usual = usual or times
            both = [key for key in times if key in usual]
            ratio = np.mean([times[key] for key in both]) / np.mean([usual[key] for key in both])
            touched = [m for m in found if m["collision_steps"]]
            predicted = sum(any(c["predicted"] for c in m["contacts"].values()) for m in touched)
            for case, m in zip(cases, found, strict=True):
                if m["status"] != "goal_reached":
                    print(f"{case}: {m['status']} {m['planner_failure']}", file=sys.stderr)
            latency = [m["replan_latency_ms"] for m in found if m["plans_asked"]]
            print(
                f"| {name} | {count} | {len(times)} | {len(touched)} | {predicted} | "
                f"{sum(m['unproved_s'] for m in found):.2f} | "
                f"{np.mean(list(times.values())):.1f} | {ratio:.2f} | "
                f"{np.mean([m['replans'] for m in found]):.0f} | "
                f"{np.median([one['median'] for one in latency]):.0f} | "
                f"{np.median([one['p99'] for one in latency]):.0f} |",
                flush=True,
            )


def _cases(count: int, changes: dict[str, Any]) -> list[Case]:
    settings: dict[str, Any] = {"latency": 0.05, "from_rest": False, "announced": True, **changes}
    kinds = [(world, body) for world in WORLDS for body in BODIES]
    return [
        Case(*kinds[number % len(kinds)], number // len(kinds), **settings)
        for number in range(count)
    ]


if __name__ == "__main__":
    cyclopts.run(main)
