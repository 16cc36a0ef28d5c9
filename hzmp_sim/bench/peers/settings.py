"""What is measured: one dataclass for the Python call and the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from hzmp_planners.errors import QueryError
from hzmp_sim.bench.command_line import command_line

DEFAULT_OUT = Path("runs/bench_peers")

PlannerName = Literal[
    "visibility",
    "rrt-connect",
    "aorrtc",
    "informed-rrt-star",
    "bit-star",
    "fastpathplanning",
    "gcs",
]
"""The peers. HZ-MP itself is always measured."""
CheckName = Literal["exact", "states"]
"""How the sampling planners check an edge: at once, or state by state."""


@dataclass(frozen=True, kw_only=True)
class PeersSettings:
    """What to measure, and how often.

    Attributes:
        quick: one scene of each kind, short budgets: a minute instead of half an hour.
        scenes: folder of scene files (JSON, boxes) to plan in, instead of those made by law.
        planners: peers to measure; all that are installed unless given.
        checks: how sampling planners check edges: exactly, state by state, or (unless given) both.
        runs: of each planner on each scene, each with a seed of its own.
        budget: time of one run [s].
        seed: of the scenes, and of the first run.
        gap: at which HZ-MP stops.
        resolution: distance of checked states, relative to the workspace's diagonal.
        reference_time: of a long run of HZ-MP where no exact optimum is known [s].
        gcs_pairs: Drake's graph of convex sets, whose time grows with the pairs of faces of one
            cell, is left out of scenes with more of these.
        peer_time: a convex-set planner that takes longer for one scene is stopped [s].
    """

    quick: bool = False
    scenes: Path | None = None
    planners: Annotated[tuple[PlannerName, ...] | None, Parameter(consume_multiple=True)] = None
    checks: Annotated[tuple[CheckName, ...] | None, Parameter(consume_multiple=True)] = None
    runs: int | None = None
    budget: float | None = None
    seed: int = 0
    gap: float = 1e-3
    resolution: float = 5e-6
    reference_time: float | None = None
    gcs_pairs: int = 20_000
    peer_time: float | None = None

    def __post_init__(self) -> None:
        for name, least in (("runs", 1), ("seed", 0), ("gcs_pairs", 0)):
            value = getattr(self, name)
            if value is not None and value < least:
                raise QueryError(f"{name} must be at least {least}, got {value}")
        for name in ("budget", "gap", "resolution", "reference_time", "peer_time"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < math.inf:
                raise QueryError(f"{name} must be positive and finite, got {value}")
        if self.scenes is not None and not self.scenes.is_dir():
            raise QueryError(f"scenes must be a folder, got {self.scenes}")

    def command(self, out: Path = DEFAULT_OUT) -> str:
        """The command line that measures this."""
        more = () if out == DEFAULT_OUT else ("--out", str(out))
        return command_line(("hzmp-sim", "bench", "peers"), self, more)


@dataclass(frozen=True)
class Effort:
    """How much is measured."""

    runs: int
    budget: float
    reference_time: float
    peer_time: float
    checks: tuple[CheckName, ...]


def effort_of(settings: PeersSettings) -> Effort:
    """The effort that the settings ask for."""
    quick = settings.quick
    return Effort(
        runs=settings.runs or (2 if quick else 5),
        budget=settings.budget or (0.1 if quick else 1.0),
        reference_time=settings.reference_time or (1.0 if quick else 10.0),
        peer_time=settings.peer_time or (5.0 if quick else 120.0),
        checks=settings.checks or ("exact", "states"),
    )
