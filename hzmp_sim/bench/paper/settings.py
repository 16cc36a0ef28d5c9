"""What is measured: one dataclass for the Python call and the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from hzmp_planners.errors import QueryError
from hzmp_sim.bench.command_line import command_line

DEFAULT_OUT = Path("runs/bench_paper")


@dataclass(frozen=True, kw_only=True)
class PaperBenchSettings:
    """What to measure, and how often.

    Attributes:
        quick: few runs on few scenes: half a minute instead of two.
        runs: of each planner on one scene of random rectangles, each with a seed of its own.
        scenes: solvable scenes of random rectangles, each planned in once.
        repeats: runs of each experiment of sections 4.1 to 4.3.
        budget: time of one run on random rectangles [s].
        seed: of the scenes, and of the first run.
    """

    quick: bool = False
    runs: int | None = None
    scenes: int | None = None
    repeats: int | None = None
    budget: float = 0.1
    seed: int = 0

    def __post_init__(self) -> None:
        for name, least in (("runs", 1), ("scenes", 1), ("repeats", 1), ("seed", 0)):
            value = getattr(self, name)
            if value is not None and value < least:
                raise QueryError(f"{name} must be at least {least}, got {value}")
        if not 0.0 < self.budget < math.inf:
            raise QueryError(f"budget must be positive and finite, got {self.budget}")

    def command(self, out: Path = DEFAULT_OUT) -> str:
        """The command line that measures this."""
        more = () if out == DEFAULT_OUT else ("--out", str(out))
        return command_line(("hzmp-sim", "bench", "paper"), self, more)


@dataclass(frozen=True)
class Effort:
    """How much is measured."""

    runs: int
    scenes: int
    repeats: int


def effort_of(settings: PaperBenchSettings) -> Effort:
    """The effort that the settings ask for: the paper's 100 runs unless it is to be quick."""
    quick = settings.quick
    return Effort(
        runs=settings.runs or (10 if quick else 100),
        scenes=settings.scenes or (10 if quick else 100),
        repeats=settings.repeats or (5 if quick else 50),
    )
