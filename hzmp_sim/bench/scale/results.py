"""What the benchmark measures, as plain data: scale.json is these."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, Self


@dataclass(frozen=True)
class WorldResult:
    """One world that stands still."""

    family: str
    title: str
    n: int
    obstacles: int
    seed: int
    leaves: int
    faces: int
    decompose_s: list[float]
    """Of each repeat [s]; the first in a fresh process comes first."""
    graph_s: list[float]
    """The leaf graph after each of them [s]."""
    cpu_s: float
    """Processor time of both, mean of all repeats: less than the time on a busy machine [s]."""
    peak_mb: float
    """Largest resident memory of the process after the first repeat [MB]."""
    base_mb: float
    """Resident memory just before it: the interpreter, the libraries and the obstacles [MB]."""
    cover_error: float
    """|leaves + union of obstacles - workspace|, relative to the volume of the workspace."""
    points: int
    misplaced: int
    """Points that are both in a leaf and inside an obstacle, or neither."""
    locate_s: float
    """`leaf_of` for all points together."""
    file_mb: float
    """Size of the saved space with its graph [MB]."""
    save_s: float
    load_s: float
    overlapping: int | None = None
    """Leaves after `overlapping`, None where it was not run."""
    overlapping_s: float | None = None
    naive: int | None = None
    """Cells of the naive order, None where it was not run."""
    naive_reach: int | None = None
    """Cells of the naive order that takes the facet of the greatest reach first."""

    @property
    def total_s(self) -> float:
        """Median time of decomposition and graph together [s]."""
        pairs = zip(self.decompose_s, self.graph_s, strict=True)
        return statistics.median(one + two for one, two in pairs)

    @property
    def leaf_ratio(self) -> float | None:
        """Leaves per naive cell."""
        return self.leaves / self.naive if self.naive else None


@dataclass(frozen=True)
class MovingResult:
    """A world in which some obstacles move; each time includes the leaf graph."""

    family: str
    title: str
    obstacles: int
    moved: int
    seed: int
    static_s: list[float]
    """`with_obstacles(shapes)` on the space of the others, for each step."""
    numbered_s: list[float]
    """`with_obstacles({number: shape})` on the space of all, for each step after the first."""
    first_s: float
    """The first step of these, which builds the space of the others."""
    fresh_s: list[float]
    """A new decomposition, for some of the steps."""
    leaves: float
    """Median leaves after an update on the space of the others."""
    fresh_leaves: float
    cover_error: float
    """Largest of some steps and both ways, relative to the volume of the workspace."""


@dataclass(frozen=True)
class PeerResult:
    """Another way to decompose or to prepare free space, on a world of ours."""

    peer: str
    does: str
    title: str
    obstacles: int
    our_leaves: int
    our_s: float
    """Our decomposition with its graph, best of two in the same process [s]."""
    pieces: int | None = None
    """Convex sets, None if it did not end."""
    seconds: float | None = None
    """What it took, or None if it did not end."""
    lost: float | None = None
    """Part of the free volume that no piece covers."""
    leaked: float | None = None
    """Volume of the pieces inside obstacles, relative to the free volume."""
    note: str = ""


@dataclass(frozen=True)
class Fit:
    """Time over count at constant density: t ~ N^exponent."""

    family: str
    title: str
    counts: list[int]
    exponent: float
    """Least squares over all counts."""
    last: float
    """Between the two largest counts."""


@dataclass(frozen=True)
class Target:
    """What is asked, and what was measured."""

    asked: str
    limit: float
    unit: str
    measured: float | None
    """None when this run did not measure it."""

    @property
    def verdict(self) -> str:
        """One of "met", "missed" and "not measured"."""
        if self.measured is None:
            return "not measured"
        return "met" if self.measured <= self.limit else "missed"


@dataclass(frozen=True)
class Results:
    """Everything from one run."""

    command: str
    machine: Mapping[str, Any]
    settings: Mapping[str, Any]
    worlds: list[WorldResult]
    moving: list[MovingResult]
    peers: list[PeerResult]
    skipped: list[str]
    """Peers that are not installed, each with what to install."""
    fits: list[Fit]
    targets: list[Target]
    seconds: float

    @property
    def cpu_share(self) -> float:
        """Part of their time that the decompositions had a processor; 1 on an idle machine."""
        spent = sum(sum(world.decompose_s) + sum(world.graph_s) for world in self.worlds)
        return sum(world.cpu_s * len(world.graph_s) for world in self.worlds) / (spent or 1.0)

    @property
    def exact(self) -> bool:
        """Whether every cover was exact."""
        return worst_cover(self.worlds, self.moving) <= EXACT and not any(
            world.misplaced for world in self.worlds
        )

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        targets = [asdict(target) | {"verdict": target.verdict} for target in self.targets]
        return {"benchmark": "scale"} | asdict(self) | {"targets": targets, "exact": self.exact}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """What `to_dict` made."""
        kinds: dict[str, type] = {
            "worlds": WorldResult, "moving": MovingResult, "peers": PeerResult, "fits": Fit,
            "targets": Target,
        }  # fmt: skip
        made: dict[str, Any] = {}
        for field in fields(cls):
            kind = kinds.get(field.name)
            rows = data[field.name]
            made[field.name] = rows if kind is None else [_row(kind, row) for row in rows]
        return cls(**made)


def _row(kind: type, values: Mapping[str, Any]) -> Any:
    """A dataclass from the values of its fields, others left out."""
    return kind(**{field.name: values[field.name] for field in fields(kind)})


EXACT = 1e-12
"""Volumes that agree to this, relative to the workspace, agree up to round-off."""


def worst_cover(worlds: Sequence[WorldResult], moving: Sequence[MovingResult]) -> float:
    """The largest relative error of a cover."""
    errors = [world.cover_error for world in worlds] + [world.cover_error for world in moving]
    return max(errors, default=0.0)
