"""What bevels along the edges of grown boxes cost, and by how much they shorten paths.

Prints a table: each world with the default tolerance, which keeps the facets of boxes, and with
0.23 (radius + clearance), which adds a bevel along each edge.

    python benchmarks/bevels.py [--runs 5]
"""

from __future__ import annotations

import json
import statistics
import time
from pathlib import Path
from typing import NamedTuple

import cyclopts
import mujoco
import numpy as np

import hzmp_sim as hz

BEVEL = 0.23
"""Share of the growth: just above the sqrt(1.5) - 1 by which a box with bevels stands out."""

SCALE = 10.0
"""Of the random scenes, which are 1 m wide: the point of 0.1 m needs more room [1]."""

SCENES = Path(__file__).resolve().parents[1] / "tests" / "data" / "scenes"
WORLDS = (
    ("enclosure", "point"),
    ("enclosure", "quadrotor"),
    ("narrow_passage", "quadrotor"),
    ("maze", "point"),
    ("maze", "quadrotor"),
    ("random_3d_s000", "point"),
    ("random_3d_s004", "point"),
)


class Row(NamedTuple):
    """Medians over the runs; times in ms."""

    facets: int
    leaves: int
    decompose: float
    first: float
    closed: float
    cost: float


def boxes(name: str) -> mujoco.MjSpec:
    """A random scene of tests/data/scenes as a world, `SCALE` times as large."""
    scene = json.loads((SCENES / f"{name}.json").read_text())
    spec = mujoco.MjSpec()
    spec.modelname = name
    for box in scene["obstacles"]:
        lo, hi = SCALE * np.array(box["lo"]), SCALE * np.array(box["hi"])
        kind = mujoco.mjtGeom.mjGEOM_BOX
        spec.worldbody.add_geom(type=kind, pos=(lo + hi) / 2.0, size=(hi - lo) / 2.0)
    corners = np.concatenate([scene["bounds"]["lo"], scene["bounds"]["hi"]])
    spec.add_numeric(name="workspace", size=6, data=SCALE * corners)
    for end in ("start", "goal"):
        spec.worldbody.add_site(name=end, pos=SCALE * np.array(scene[end]))
    return spec


def measure(world: str, body: str, tolerance: float | None, runs: int) -> tuple[hz.Scene, Row]:
    """One world with one tolerance."""
    source = boxes(world) if (SCENES / f"{world}.json").is_file() else world
    scene = hz.load_scene(source, body, tolerance=tolerance)
    rows, leaves, cost = [], 0, float("nan")
    for _ in range(runs):
        began = time.perf_counter()
        space = scene.free_space()
        _ = space.graph
        decomposed = time.perf_counter()
        hz.plan(space, scene.start, scene.goal)  # the first query of a space prepares it
        again = time.perf_counter()
        plan = hz.plan(space, scene.start, scene.goal)
        closed = time.perf_counter() - again
        first = plan.history[0][0]
        leaves, cost = len(space), plan.cost
        rows.append((1e3 * (decomposed - began), 1e3 * first, 1e3 * closed))
    times = [statistics.median(column) for column in zip(*rows, strict=True)]
    facets = max(report.facets for report in scene.geoms if report.type == "box")
    return scene, Row(facets, leaves, times[0], times[1], times[2], cost)


def main(runs: int = 5) -> None:
    """Print the table.

    Args:
        runs: of each world; times are medians.
    """
    print(
        "| world, body | facets of a box | leaves | decompose [ms] | first path [ms] "
        "| gap closed [ms] | path [m] |\n|---|---|---|---|---|---|---|"
    )
    for world, body in WORLDS:
        scene, sharp = measure(world, body, None, runs)
        tolerance = BEVEL * (scene.radius + scene.clearance)
        _, bevelled = measure(world, body, tolerance, runs)
        formats = ("d", "d", ".0f", ".1f", ".0f", ".3f")
        cells = [
            f"{before:{form}} / {after:{form}}"
            for before, after, form in zip(sharp, bevelled, formats, strict=True)
        ]
        print(f"| {world}, {body} in {scene.n}-D | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    cyclopts.run(main)
