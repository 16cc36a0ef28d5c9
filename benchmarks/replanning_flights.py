"""Many seeded flights through the worlds that move, with the planner in the loop.

Each seed begins the motions of a world at other moments and speeds. What is compared: planning in
flight; planning only when at rest, as a planner outside of the loop would; other latencies; and
predictions that are broken on purpose: every other motion is not announced, and turns back all of a
sudden, again and again.

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
BETWEEN = 2.0
"""Mean time between two sudden reversals [s]."""
DURATION = 90.0
"""After which a flight is given up [s]."""


class Case(NamedTuple):
    """One flight."""

    world: str
    body: str
    seed: int
    latency: float
    """[s]"""
    from_rest: bool
    reversals: bool
    """Whether every other motion is not announced, and turns back without notice."""


def fly(case: Case) -> dict[str, Any]:
    """The metrics of a flight; also its length in `time_s`, and the planner's `latencies` [s]."""
    script = hz.load_scene(case.world, body=case.body).motion
    assert script is not None
    script = script.with_phases(case.seed)
    if case.reversals:
        rng = np.random.default_rng(case.seed)
        motions = [
            reversing(one, rng) if number % 2 else one for number, one in enumerate(script.motions)
        ]
        script = replace(script, motions=motions)
    scene = hz.load_scene(case.world, body=case.body, motion=script)
    loop = hz.Replanning(latency=case.latency, from_rest=case.from_rest, duration=DURATION)
    run = hz.simulate(scene, settings=hz.RunSettings(seed=case.seed, video=False, replanning=loop))
    assert run.log is not None
    assert run.flight_plan is not None
    latencies = [record.latency for record in run.flight_plan.records]
    still = float(np.linalg.norm(run.log.velocity[-1])) < 0.05
    return {
        **run.metrics,
        "time_s": float(run.log.time[-1]),
        "latencies": latencies,
        "stopped": still and (not latencies or run.flight_plan.records[-1].proved),
    }


def reversing(motion: hz.Motion, rng: np.random.Generator) -> hz.Motion:
    """The same motion, which nobody announces, and which turns back at random times."""
    turns = np.concatenate([[0.0], rng.exponential(BETWEEN, 2 * int(DURATION)).cumsum()])
    ways = np.diff(turns) * (-1.0) ** np.arange(len(turns) - 1)
    along = np.concatenate([[0.0], ways.cumsum()])

    def path(time: float) -> Any:
        row = np.asarray(motion.at(float(np.interp(time, turns, along))))
        if row.size != 4:
            return row
        half = 0.5 * row[3]  # these bodies stand upright in the MJCF
        return row[:3], np.array([np.cos(half), 0.0, 0.0, np.sin(half)])

    return replace(motion, path=hz.Callback(path), announced=False, speed=1.0, offset=0.0)


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
    modes += [("sudden reversals", others, {"reversals": True})]
    columns = ("planning", "flights", "goal reached", "stopped, proved", "with contact",
               "of these as predicted", "broken predictions", "without a proof [s]",
               "time to goal, mean [s]", "ratio", "replans, mean", "latency, median [ms]",
               "p99 [ms]")  # fmt: skip
    print("| " + " | ".join(columns) + " |")
    print("|---" * len(columns) + "|")
    usual: dict[tuple[str, str, int], float] = {}
    with ProcessPoolExecutor(processes or os.cpu_count()) as pool:
        for name, count, changes in modes:
            cases = _cases(count, changes)
            found = dict(zip(cases, pool.map(fly, cases), strict=True))
            arrived = {case[:3]: m for case, m in found.items() if m["status"] == "goal_reached"}
            times = {key: m["time_s"] for key, m in arrived.items()}
            usual = usual or times
            both = [key for key in times if key in usual]
            ratio = np.mean([times[key] for key in both]) / np.mean([usual[key] for key in both])
            others_stopped = 0
            for case, m in found.items():
                if m["status"] != "goal_reached":
                    others_stopped += m["stopped"] and not m["collision_steps"]
                    print(f"{case}: {m['status']} {m['planner_failure']}", file=sys.stderr)
                if m["contacts"]:
                    print(f"{case}: {m['contacts']}", file=sys.stderr)
            touched = [m for m in found.values() if m["contacts"]]
            predicted = sum(any(c["predicted"] for c in m["contacts"].values()) for m in touched)
            latency = 1e3 * np.concatenate([m["latencies"] for m in found.values()])
            print(
                f"| {name} | {count} | {len(times)} | {others_stopped} | {len(touched)} | "
                f"{predicted} | {sum(len(m['broken_predictions']) for m in found.values())} | "
                f"{sum(m['unproved_s'] for m in found.values()):.2f} | "
                f"{np.mean(list(times.values())):.1f} | {ratio:.2f} | "
                f"{np.mean([m['replans'] for m in found.values()]):.0f} | "
                f"{np.median(latency):.0f} | {np.quantile(latency, 0.99):.0f} |",
                flush=True,
            )


def _cases(count: int, changes: dict[str, Any]) -> list[Case]:
    settings: dict[str, Any] = {"latency": 0.05, "from_rest": False, "reversals": False, **changes}
    kinds = [(world, body) for world in WORLDS for body in BODIES]
    return [
        Case(*kinds[number % len(kinds)], number // len(kinds), **settings)
        for number in range(count)
    ]


if __name__ == "__main__":
    cyclopts.run(main)
