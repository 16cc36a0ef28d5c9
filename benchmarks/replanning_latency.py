"""How long a decision of the planner takes in the loop, among many static and moving boxes.

Random worlds, flown by the point from corner to corner: 200 static and 10 moving boxes in 3-D, 60
and 20 in 2-D. A decision is prediction, update of the free space, path, trajectory and proof.

    python benchmarks/replanning_latency.py
"""

from __future__ import annotations

from typing import NamedTuple

import cyclopts
import mujoco
import numpy as np

import hzmp_sim as hz

SIDE = 10.0
"""Of the workspace [m]."""
FREE = 0.9
"""Boxes keep this far from start and goal along some axis [m]."""


class Kind(NamedTuple):
    """Of random worlds."""

    n: int
    static: int
    moving: int
    halves: tuple[float, float]
    """Least and largest half side of a static box [m]."""


KINDS = (Kind(3, 200, 10, (0.2, 0.45)), Kind(2, 60, 20, (0.15, 0.35)))


def world(kind: Kind, seed: int) -> hz.Scene:
    """A scene of that kind."""
    rng = np.random.default_rng(seed)
    spec = mujoco.MjSpec()
    spec.add_numeric(name="workspace", data=[0.0, 0.0, 0.0, SIDE, SIDE, SIDE], size=6)
    ends = [np.full(3, 0.5), np.full(3, SIDE - 0.5)]
    if kind.n == 2:
        ends = [np.append(end[:2], 0.5 * SIDE) for end in ends]
    spec.worldbody.add_site(name="start", pos=ends[0])
    spec.worldbody.add_site(name="goal", pos=ends[1])
    placed = 0
    while placed < kind.static:
        centre = rng.uniform(0.5, SIDE - 0.5, 3)
        half = rng.uniform(*kind.halves, 3)
        if kind.n == 2:
            centre[2] = half[2] = 0.5 * SIDE
        near = [np.abs(centre - end)[: kind.n] < half[: kind.n] + FREE for end in ends]
        if any(axes.all() for axes in near):
            continue
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=centre, size=half)
        placed += 1
    motions = []
    for number in range(kind.moving):
        name, half = f"mover_{number}", np.full(3, 0.3)
        begin = rng.uniform(1.5, SIDE - 1.5, 3)
        way = rng.normal(size=3)
        if kind.n == 2:
            begin[2] = half[2] = 0.5 * SIDE
            way[2] = 0.0
        end = np.clip(begin + rng.uniform(1.5, 4.0) * way / np.linalg.norm(way), 1.5, SIDE - 1.5)
        body = spec.worldbody.add_body(name=name, pos=begin, mocap=True)
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, size=half)
        time = float(np.linalg.norm(end - begin)) / rng.uniform(0.4, 1.0)
        path = hz.Waypoints(
            times=[0.0, max(time, 1.0)], positions=[begin.tolist(), end.tolist()], repeat="bounce"
        )
        motions.append(hz.Motion(body=name, path=path))
    script = hz.MotionScript(motions=motions)
    start, goal = (end[: kind.n] for end in ends)
    return hz.load_scene(spec, body="point", start=start, goal=goal, motion=script)


def main(*, worlds: int = 5) -> None:
    """Print a Markdown table.

    Args:
        worlds: of each kind.
    """
    columns = ("world", "flights", "goal reached", "contacts", "decisions", "median [ms]",
               "p99 [ms]", "longest [ms]")  # fmt: skip
    print("| " + " | ".join(columns) + " |")
    print("|---" * len(columns) + "|")
    for kind in KINDS:
        latency: list[float] = []
        arrived = contacts = 0
        for seed in range(worlds):
            run = hz.simulate(world(kind, seed), settings=hz.RunSettings(video=False))
            assert run.flight_plan is not None
            latency += [1e3 * record.latency for record in run.flight_plan.records]
            arrived += run.metrics["status"] == "goal_reached"
            contacts += run.metrics["collision_steps"]
        middle, late, most = np.quantile(latency, [0.5, 0.99, 1.0]).tolist()
        print(
            f"| {kind.n}-D, {kind.static} + {kind.moving} | {worlds} | {arrived} | {contacts} | "
            f"{len(latency)} | {middle:.0f} | {late:.0f} | {most:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    cyclopts.run(main)
