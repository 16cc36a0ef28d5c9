"""What the benchmark measures, as plain data: peers.json is these."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Self

SOLVER_TOL = 1e-6
"""What the peers' convex solvers leave, relative to the workspace: their paths count as free up to
it. The depths are in the table."""
CLEAN_TOL = 1e-12
"""A path this deep, relative to the workspace, is free up to round-off: its length is evidence."""
BOUND_TOL = 1e-9
"""A bound above the length of a free path by more than this, relative to it, is wrong."""


@dataclass(frozen=True)
class Run:
    """One planner on one scene, once."""

    scene: str
    planner: str
    check: str
    """How edges were checked: "exact", "states", or "" for a planner that reads the obstacles."""
    seed: int
    history: list[list[float]]
    """(time since the query [s], cost [m]) each time the cost improved."""
    total_s: float
    """Until the planner returned [s]."""
    offline_s: float = 0.0
    """What was prepared before, for any start and goal [s]."""
    cost: float | None = None
    """Length of the path that was returned, measured anew [m]; None without one."""
    claimed: float | None = None
    """Its length as the planner has it [m]."""
    lower_bound: float = 0.0
    """What the planner proved [m]; 0: nothing."""
    bounds: list[list[float]] = field(default_factory=list)
    """(time since the query [s], lower bound [m]) each time the bound improved."""
    bound_s: float = 0.0
    """What that took, where it is not a part of `total_s` [s]."""
    depth: float = 0.0
    """How deep the path is inside an obstacle [m]."""
    end_error: float = 0.0
    """How far its ends are from start and goal [m]."""
    edges: int = 0
    """Edges that were checked."""
    states: int = 0
    """States that were checked, on edges and alone."""
    edges_first: int = 0
    """Edges until the first path."""
    states_first: int = 0
    """States until the first path."""
    python_s: float = 0.0
    """Estimated part of `total_s` that calls from C++ to Python took [s]."""
    python_first_s: float = 0.0
    """The same until the first path [s]."""
    defects: list[str] = field(default_factory=list)
    """What is wrong with this answer, for answers of ours."""
    note: str = ""

    @property
    def gap(self) -> float:
        """(cost - lower bound) / lower bound; inf without a path or a bound."""
        if self.cost is None or not self.lower_bound:
            return math.inf
        return (self.cost - self.lower_bound) / self.lower_bound


@dataclass(frozen=True)
class SceneResult:
    """A scene, and what is known about it."""

    name: str
    group: str
    n: int
    obstacles: int
    size: float
    """Largest side of the workspace [m]."""
    leaves: int
    """Of our decomposition."""
    faces: int
    cells: int
    """That the planners on convex sets are given."""
    given: bool
    """Whether these come with the scene; else they are our leaves."""
    straight: float
    """Distance of start and goal [m]."""
    reference: float | None
    """Length of the best path known [m]; costs are ratios to it."""
    source: str
    """Where that comes from."""
    lower_bound: float
    """The best that we proved [m]."""


@dataclass(frozen=True)
class Results:
    """Everything from one run."""

    command: str
    machine: Mapping[str, Any]
    settings: Mapping[str, Any]
    started: str
    """Date and time (UTC)."""
    scenes: list[SceneResult]
    runs: list[Run]
    skipped: list[str]
    """Planners that were not measured, or not everywhere, and why."""
    remarks: list[str]
    """About the scenes."""
    seconds: float

    @property
    def defects(self) -> list[str]:
        """Wrong answers of ours: what must never be."""
        known = {scene.name: scene for scene in self.scenes}
        found = []
        for run in self.runs:
            where = f"{run.scene}, seed {run.seed}: "
            found += [where + defect for defect in run.defects]
            best = known[run.scene].reference
            if run.planner not in OURS or best is None:
                continue
            if run.note == INFEASIBLE:
                found.append(f"{where}called infeasible, but there is a path of {best:.12g} m")
            if run.lower_bound > best * (1.0 + BOUND_TOL):
                found.append(
                    f"{where}lower bound {run.lower_bound:.12g} m above the length of a free path, "
                    f"{best:.12g} m"
                )
        return found

    def of(self, planner: str, check: str) -> list[Run]:
        """The runs of a planner with a kind of edge check; without checks it is in both."""
        return [run for run in self.runs if run.planner == planner and run.check in ("", check)]

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {"benchmark": "peers"} | asdict(self) | {"defects": self.defects}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """What `to_dict` made."""
        made = {entry.name: data[entry.name] for entry in fields(cls)}
        made["scenes"] = [SceneResult(**row) for row in data["scenes"]]
        made["runs"] = [Run(**row) for row in data["runs"]]
        return cls(**made)


COLD, WARM = "hzmp-cold", "hzmp-warm"
INFEASIBLE = "infeasible"
"""Note of a run of ours that proved that there is no path."""
OURS = (COLD, WARM)
"""HZ-MP with the decomposition in its time, and on a free space that is there."""
