"""What is measured: one dataclass for the Python call and the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from hzmp_planners.errors import QueryError
from hzmp_sim.bench.command_line import command_line

DEFAULT_OUT = Path("runs/bench_scale")


@dataclass(frozen=True, kw_only=True)
class ScaleSettings:
    """What to measure, and how often.

    Attributes:
        quick: small worlds only: half a minute instead of a quarter of an hour.
        counts: obstacles of the worlds of each series; other worlds get at most the largest.
        repeats: how often each world is decomposed; times are medians.
        seed: of all random worlds.
        peers: measure other ways to decompose free space too, as far as they are installed.
        peer_time: a peer that takes longer for one world is stopped [s].
        scenes: folder of scene files (JSON, boxes) to measure too.
    """

    quick: bool = False
    counts: Annotated[tuple[int, ...] | None, Parameter(consume_multiple=True)] = None
    repeats: int = 5
    seed: int = 0
    peers: bool = True
    peer_time: float | None = None
    scenes: Path | None = None

    def __post_init__(self) -> None:
        if self.counts is not None and (len(self.counts) < 1 or min(self.counts) < 1):
            raise QueryError(f"counts must be whole numbers of at least 1, got {self.counts}")
        for name, least in (("repeats", 1), ("seed", 0)):
            if getattr(self, name) < least:
                raise QueryError(f"{name} must be at least {least}, got {getattr(self, name)}")
        if self.peer_time is not None and not 0.0 < self.peer_time < math.inf:
            raise QueryError(f"peer_time must be positive and finite, got {self.peer_time}")
        if self.scenes is not None and not self.scenes.is_dir():
            raise QueryError(f"scenes must be a folder, got {self.scenes}")

    def command(self, out: Path = DEFAULT_OUT) -> str:
        """The command line that measures this."""
        more = () if out == DEFAULT_OUT else ("--out", str(out))
        return command_line(("hzmp-sim", "bench", "scale"), self, more)


@dataclass(frozen=True)
class Sizes:
    """How large the worlds are."""

    turned: tuple[int, ...]
    boxes: tuple[int, ...]
    flat: tuple[int, ...]
    dense: int
    """Obstacles of the dense worlds."""
    dense_seeds: int
    squares: int
    """Squares along one side of the grid."""
    moving: int
    moved: int
    steps: int
    checks: int
    points: int
    """To locate in each world."""
    naive: int
    """The naive orders are counted for worlds of at most so many obstacles."""
    overlapping: int
    """Leaves are made to overlap in worlds of at most so many obstacles."""
    fastpathplanning: tuple[int, ...]
    iris: tuple[int, ...]
    coacd: tuple[int, ...]
    peer_time: float

    def at_most(self, counts: tuple[int, ...]) -> Sizes:
        """The series with these counts, and no other world with more obstacles."""
        most, ordered = max(counts), tuple(sorted(set(counts)))

        def cut(sizes: tuple[int, ...]) -> tuple[int, ...]:
            return tuple(dict.fromkeys(min(size, most) for size in sizes))

        return replace(
            self,
            turned=ordered,
            boxes=ordered,
            flat=ordered,
            dense=min(self.dense, most),
            squares=min(self.squares, math.isqrt(most)),
            moving=min(self.moving, most),
            moved=min(self.moved, most),
            points=min(self.points, 1000 * most),
            fastpathplanning=cut(self.fastpathplanning),
            iris=cut(self.iris),
            coacd=cut(self.coacd),
        )


FULL = Sizes(
    turned=(50, 100, 200, 500, 1000),
    boxes=(50, 100, 200, 500, 1000),
    flat=(35, 100, 200, 500, 1000, 2000),
    dense=233,
    dense_seeds=10,
    squares=49,
    moving=200,
    moved=10,
    steps=60,
    checks=6,
    points=1_000_000,
    naive=1000,
    overlapping=200,
    fastpathplanning=(50, 200),
    iris=(20, 50),
    coacd=(10, 20),
    peer_time=120.0,
)
QUICK = Sizes(
    turned=(50, 100, 200),
    boxes=(50, 100, 200),
    flat=(35, 100, 200),
    dense=233,
    dense_seeds=1,
    squares=49,
    moving=200,
    moved=10,
    steps=10,
    checks=2,
    points=20_000,
    naive=50,
    overlapping=35,
    fastpathplanning=(20,),
    iris=(5,),
    coacd=(),
    peer_time=8.0,
)


def sizes_of(settings: ScaleSettings) -> Sizes:
    """The sizes that the settings ask for."""
    sizes = QUICK if settings.quick else FULL
    return sizes if settings.counts is None else sizes.at_most(settings.counts)
