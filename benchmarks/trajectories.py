"""Trajectories through planned and reference corridors: the table of docs/trajectories.md.

Each scene is planned to 0.1 %, its path and cells are scaled so that the workspace is 10 m wide,
and timed within 2 m/s, 4 m/s^2 and 20 m/s^3 on each axis. Beside it: resting at each waypoint,
which is what state-to-state generators give, for reference corridors the best duration known, and
other libraries where they are installed (`pip install 'hzmp-sim[bench]'`).

    python -m benchmarks.trajectories tests/data/scenes tests/data
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import cyclopts
import numpy as np
from numpy.typing import NDArray

import hzmp_sim as hz
from benchmarks import trajectory_peers as peers

LIMITS = hz.Limits(velocity=2.0, acceleration=4.0, jerk=20.0)
SIZE = 10.0
"""Longest side of a scene's workspace [m]."""


class Corridor(NamedTuple):
    """What is timed."""

    name: str
    waypoints: NDArray[np.float64]
    cells: Sequence[hz.Polytope]
    best_known: float | None
    """[s]"""


def planned(scenes: Path) -> Iterator[Corridor]:
    """Corridors of the plans through all scenes (JSON) in a folder whose path bends."""
    for path in sorted(scenes.glob("*.json")):
        scene = json.loads(path.read_text())
        bounds = scene["bounds"]["lo"], scene["bounds"]["hi"]
        boxes = [hz.Polytope.from_box(box["lo"], box["hi"]) for box in scene["obstacles"]]
        space = hz.FreeSpace.decompose(bounds=bounds, obstacles=boxes)
        plan = hz.plan(space, scene["start"], scene["goal"], time_limit=10.0)
        if len(plan.waypoints) > 2:
            scale = SIZE / float(np.ptp(bounds, axis=0).max())
            cells = [hz.Polytope(cell.A, scale * cell.b) for cell in plan.cells(space)]
            yield Corridor(scene["name"], scale * plan.waypoints, cells, None)


def references(folder: Path) -> Iterator[Corridor]:
    """Reference corridors (corridor_*.json) with the best duration that is known."""
    for path in sorted(folder.glob("corridor_*.json")):
        case = json.loads(path.read_text())
        cells = [hz.Polytope.from_halfspaces(cell["A"], cell["b"]) for cell in case["cells"]]
        best = float(case["reference"]["best_known_s"])
        yield Corridor(case["name"], np.array(case["waypoints"]), cells, best)


def resting(corridor: Corridor) -> float:
    """Duration with a rest at each waypoint [s]."""
    legs = zip(pairwise(corridor.waypoints), corridor.cells, strict=True)
    return sum(hz.time_parameterize([*ends], [cell], LIMITS).duration for ends, cell in legs)


def measured(corridor: Corridor) -> tuple[hz.Trajectory, float]:
    """The trajectory, and the CPU time that it took [ms]."""
    began = time.process_time()
    trajectory = hz.time_parameterize(corridor.waypoints, corridor.cells, LIMITS)
    return trajectory, 1e3 * (time.process_time() - began)


PEERS: dict[str, tuple[str, peers.Peer]] = {
    "toppra": ("toppra", peers.time_by_toppra),
    "Drake": ("pydrake", peers.time_by_drake),
}
"""Module and function of each."""


def by_peers(corridor: Corridor, names: Sequence[str], runs: int) -> dict[str, peers.Timed | None]:
    """What other libraries make of a corridor; CPU times are medians."""
    found: dict[str, peers.Timed | None] = {}
    for name in names:
        function = PEERS[name][1]
        timed = [function(corridor.waypoints, corridor.cells, LIMITS) for _ in range(runs)]
        done = [one for one in timed if one is not None]
        cpu = statistics.median(one.cpu for one in done) if done else 0.0
        found[name] = done[0]._replace(cpu=cpu) if done else None
    return found


def main(
    scenes: Path = Path("tests/data/scenes"), corridors: Path = Path("tests/data"), *, runs: int = 3
) -> None:
    """Print two Markdown tables: ours, and beside other libraries.

    Args:
        scenes: holds boxscene files (JSON).
        corridors: holds reference corridors.
        runs: how often each is timed; CPU times are medians.
    """
    names = [name for name, (module, _) in PEERS.items() if peers.installed(module)]
    for name in PEERS.keys() - set(names):
        print(
            f"{name}: not measured, not installed (pip install 'hzmp-sim[bench]')", file=sys.stderr
        )
    own = [
        "corridor", "cells", "at each waypoint at rest [s]", "trajectory [s]", "ratio",
        "best known [s]", "limits used", "containment [mm]", "CPU [ms]",
    ]  # fmt: skip
    beside = ["corridor", "ours [s]"]
    for name in names:
        beside += [f"{name} [s]", f"{name} / ours", f"{name} outside [mm]", f"{name}: limits used",
                   f"{name} CPU [ms]"]  # fmt: skip
    ratios: list[float] = []
    spent: list[float] = []
    rows: list[list[str]] = []
    versus: dict[str, list[tuple[float, peers.Timed]]] = {name: [] for name in names}
    print(_line(own) + "\n" + "|---" * len(own) + "|")
    for corridor in [*planned(scenes), *references(corridors)]:
        timed = [measured(corridor) for _ in range(runs)]
        trajectory = timed[0][0]
        rest = resting(corridor)
        ratios.append(trajectory.duration / rest)
        spent.append(statistics.median(milliseconds for _, milliseconds in timed))
        best = "" if corridor.best_known is None else f"{corridor.best_known:.3f}"
        print(
            f"| {corridor.name} | {len(corridor.cells)} | {rest:.3f} | "
            f"{trajectory.duration:.3f} | {ratios[-1]:.3f} | {best} | "
            f"{trajectory.limit_usage.max():.9f} | {1e3 * trajectory.containment:.3f} | "
            f"{spent[-1]:.0f} |",
            flush=True,
        )
        row = [corridor.name, f"{trajectory.duration:.3f}"]
        for name, peer in by_peers(corridor, names, runs).items():
            if peer is None:
                row += ["none found", "", "", "", ""]
                continue
            share = peer.duration / trajectory.duration
            versus[name].append((share, peer))
            usage = " / ".join(f"{value:.3f}" for value in peer.usage)
            row += [f"{peer.duration:.3f}", f"{share:.3f}", f"{1e3 * peer.outside:.3f}", usage,
                    f"{peer.cpu:.0f}"]  # fmt: skip
        rows.append(row)
    print(
        f"| median | | | | {statistics.median(ratios):.3f} | | | | {statistics.median(spent):.0f} |"
    )
    if names:
        median = ["median", ""]
        for name in names:
            shares, found = zip(*versus[name], strict=True)
            outside = 1e3 * statistics.median(one.outside for one in found)
            cpu = statistics.median(one.cpu for one in found)
            median += ["", f"{statistics.median(shares):.3f}", f"{outside:.3f}", "", f"{cpu:.0f}"]
        print("\n" + _line(beside) + "\n" + "|---" * len(beside) + "|")
        print("\n".join(_line(row) for row in [*rows, median]))


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    cyclopts.run(main)
