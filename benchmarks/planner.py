"""The planner on scenes with known optima: the table of the README.

Each scene is decomposed and planned several times in one process; times are medians. Cost and
bound are ratios to the scene's reference: the exact optimum in 2-D (visibility graph), the best
known length in 3-D.

    python benchmarks/planner.py tests/data/scenes --runs 5
"""

from __future__ import annotations

import json
import statistics
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cyclopts

import hzmp_sim as hz


@dataclass(frozen=True)
class Result:
    """Medians over the runs of one scene."""

    name: str
    obstacles: int
    leaves: int
    faces: int
    decompose_ms: float
    first_ms: float
    first_ratio: float
    total_ms: float
    cost_ratio: float
    bound_ratio: float
    gap: float
    status: str


def measure(scene: dict[str, Any], runs: int, time_limit: float, gap: float) -> Result:
    """Decompose and plan one scene `runs` times."""
    obstacles = [hz.Polytope.from_box(box["lo"], box["hi"]) for box in scene["obstacles"]]
    bounds = scene["bounds"]["lo"], scene["bounds"]["hi"]
    best = scene["optimum"]["cost"]
    decompose: list[float] = []
    total: list[float] = []
    plans: list[hz.Plan] = []
    space = hz.FreeSpace.decompose(bounds=bounds)
    for _ in range(runs):
        began = time.perf_counter()
        space = hz.FreeSpace.decompose(bounds=bounds, obstacles=obstacles)
        _ = space.graph
        decompose.append(time.perf_counter() - began)
        began = time.perf_counter()
        plans.append(hz.plan(space, scene["start"], scene["goal"], time_limit=time_limit, gap=gap))
        total.append(time.perf_counter() - began)
    first = [next(row for row in plan.history if row[1] < float("inf")) for plan in plans]
    plan = plans[-1]
    return Result(
        scene["name"],
        len(obstacles),
        len(space),
        len(space.graph),
        1e3 * statistics.median(decompose),
        1e3 * statistics.median(row[0] for row in first),
        first[-1][1] / best,
        1e3 * statistics.median(total),
        plan.cost / best,
        plan.lower_bound / best,
        plan.gap,
        plan.status.name.lower(),
    )


def main(
    folder: Path = Path("tests/data/scenes"),
    *,
    runs: int = 5,
    time_limit: float = 1.0,
    gap: float = 1e-3,
) -> None:
    """Print a Markdown table of all scenes in a folder that know their optimum.

    Args:
        folder: holds boxscene files (JSON).
        runs: how often each scene is planned; times are medians.
        time_limit: of one plan [s].
        gap: at which a plan stops.
    """
    scenes = [json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))]
    results = [measure(s, runs, time_limit, gap) for s in scenes if "optimum" in s]
    columns = (
        "scene", "boxes", "leaves", "faces", "decompose [ms]", "first path [ms]",
        "first / best", "plan [ms]", "cost / best", "bound / best", "gap [%]", "status",
    )  # fmt: skip
    print("| " + " | ".join(columns) + " |")
    print("|---" * len(columns) + "|")
    for r in results:
        print(
            f"| {r.name} | {r.obstacles} | {r.leaves} | {r.faces} | {r.decompose_ms:.0f} | "
            f"{r.first_ms:.1f} | {r.first_ratio:.3f} | {r.total_ms:.0f} | {r.cost_ratio:.5f} | "
            f"{r.bound_ratio:.5f} | {100 * r.gap:.3f} | {r.status} |"
        )


if __name__ == "__main__":
    cyclopts.run(main)
