"""Many seeded flights through the paper's worlds with the clearance of their tracking tube.

Start and goal of each flight are random points of the free space; gusts follow the seed. A flight
counts as clear when MuJoCo reports no contact at any step and the tracking error stayed within the
clearance.

    python benchmarks/flights.py --flights 1000
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import cyclopts
import numpy as np

import hzmp_sim as hz
from hzmp_sim.simulation import clearance_for

WORLDS = ("enclosure", "narrow_passage", "maze")
BODIES = ("point", "quadrotor")
GUST = 3.0
"""[m/s]"""


class Case(NamedTuple):
    """Flights through one world by one body."""

    world: str
    body: str
    clearance: float
    """[m]"""
    seeds: range


class Flown(NamedTuple):
    """What came of one flight."""

    status: str
    contacts: int
    error: float
    """Largest [m]."""
    clearance: float
    """Least [m]."""


def settings(seed: int) -> hz.RunSettings:
    """Of the flight with this seed."""
    return hz.RunSettings(seed=seed, disturbance=hz.Disturbance(gust=GUST), video=False)


def fly(case: Case) -> list[Flown]:
    """All flights of a case."""
    scene = hz.load_scene(case.world, body=case.body, clearance=case.clearance)
    space = scene.free_space()
    return [_flown(case, space, scene, seed) for seed in case.seeds]


def _flown(case: Case, space: hz.FreeSpace, scene: hz.Scene, seed: int) -> Flown:
    rng, ends = np.random.default_rng(seed), list[list[float]]()
    while len(ends) < 2:
        point = rng.uniform(*scene.bounds)
        if space.contains(point)[0]:
            ends.append(point.tolist())
    between = hz.load_scene(case.world, case.body, ends[0], ends[1], clearance=case.clearance)
    m = hz.simulate(between, settings=settings(seed)).metrics
    if m["tracking_error_max_m"] is None:
        return Flown(m["status"], 0, 0.0, np.inf)
    return Flown(m["status"], m["collision_steps"], m["tracking_error_max_m"], m["min_clearance_m"])


def cases(flights: int) -> Iterator[Case]:
    """In small parts, for many processes."""
    each = flights // (len(WORLDS) * len(BODIES))
    for world in WORLDS:
        for body in BODIES:
            scene = hz.load_scene(world, body=body, clearance=0.0)
            clearance = clearance_for(hz.tracking_tube(scene, settings(0)))
            for first in range(0, each, 10):
                yield Case(world, body, clearance, range(first, min(first + 10, each)))


def main(*, flights: int = 60, processes: int | None = None) -> None:
    """Print a Markdown table.

    Args:
        flights: in all.
        processes: that fly at the same time; default: as many as there are cores.
    """
    columns = (
        "world", "body", "clearance [mm]", "flights", "goal reached", "proved infeasible",
        "with contact", "largest error [mm]", "error beyond clearance", "least clearance [mm]",
    )  # fmt: skip
    todo = list(cases(flights))
    with ProcessPoolExecutor(processes or os.cpu_count()) as pool:
        results = list(pool.map(fly, todo))
    print("| " + " | ".join(columns) + " |")
    print("|---" * len(columns) + "|")
    for world in WORLDS:
        for body in BODIES:
            pairs = zip(todo, results, strict=True)
            own = [pair for pair in pairs if pair[0][:2] == (world, body)]
            flown = [flight for _, part in own for flight in part]
            clearance = own[0][0].clearance
            status = [flight.status for flight in flown]
            print(
                f"| {world} | {body} | {1e3 * clearance:.0f} | {len(flown)} | "
                f"{status.count('goal_reached')} | {status.count('infeasible')} | "
                f"{sum(flight.contacts > 0 for flight in flown)} | "
                f"{1e3 * max(flight.error for flight in flown):.1f} | "
                f"{sum(flight.error > clearance for flight in flown)} | "
                f"{1e3 * min(flight.clearance for flight in flown):.1f} |"
            )


if __name__ == "__main__":
    cyclopts.run(main)
