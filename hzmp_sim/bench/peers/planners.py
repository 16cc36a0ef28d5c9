"""Who is measured: what each planner is called, and what it needs."""

from __future__ import annotations

from dataclasses import dataclass

from hzmp_sim.bench.missing import missing_line
from hzmp_sim.bench.peers.convex_graph import GCS
from hzmp_sim.bench.peers.fast_paths import FAST_PATHS
from hzmp_sim.bench.peers.ompl.planners import RRT_CONNECT, SAMPLERS
from hzmp_sim.bench.peers.results import COLD, WARM
from hzmp_sim.bench.peers.settings import PeersSettings
from hzmp_sim.bench.peers.visible import VISIBILITY
from hzmp_sim.output import palette


@dataclass(frozen=True)
class Planner:
    """A planner, ours or not."""

    name: str
    title: str
    colour: str
    modules: tuple[str, ...] = ()
    """What must be importable."""
    packages: str = ""
    """What to install for that."""
    distributions: tuple[str, ...] = ()
    """Whose versions the results note."""

    @property
    def missing(self) -> str | None:
        """A line that says what to install, None when nothing is missing."""
        return missing_line(self.title, self.modules, self.packages)


_OMPL = ("ompl", "numba"), "ompl numba", ("ompl", "numba")

PLANNERS = (
    Planner(WARM, "HZ-MP warm", palette.PATH),
    Planner(COLD, "HZ-MP cold", palette.SAMPLE),
    Planner(VISIBILITY, "visibility graph", palette.INK),
    Planner(RRT_CONNECT, "RRT-Connect + simplify", palette.FLOWN, *_OMPL),
    Planner("aorrtc", "AORRTC", palette.GOAL, *_OMPL),
    Planner("informed-rrt-star", "Informed RRT*", palette.BOUND, *_OMPL),
    Planner("bit-star", "BIT*", palette.INFORMED, *_OMPL),
    Planner(
        FAST_PATHS, "fastpathplanning", palette.GROWN,
        ("fastpathplanning",), "fastpathplanning", ("fastpathplanning", "cvxpy", "clarabel"),
    ),
    Planner(GCS, "Drake GCS", palette.OBSTACLE, ("pydrake",), "drake", ("drake",)),
)  # fmt: skip
"""In the order of the tables."""
BY_NAME = {planner.name: planner for planner in PLANNERS}


def asked_for(settings: PeersSettings) -> list[Planner]:
    """The peers that the settings name, or all."""
    names: tuple[str, ...] = settings.planners or tuple(BY_NAME)
    return [one for one in PLANNERS if one.name in names and one.name not in (COLD, WARM)]


def is_sampler(name: str) -> bool:
    """Whether a planner checks edges, and so is measured with each kind of check."""
    return name in SAMPLERS
