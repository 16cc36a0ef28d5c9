"""Other ways to get convex pieces of free space, or to prepare them; each is optional."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hzmp_sim.bench.missing import missing_line
from hzmp_sim.bench.scale.settings import Sizes


@dataclass(frozen=True)
class Peer:
    """Another library, and the function that measures it on a world."""

    name: str
    modules: tuple[str, ...]
    """What must be importable."""
    packages: str
    """What to install for that."""
    distributions: tuple[str, ...]
    task: str
    """Takes the fields of a `WorldSpec` and a time [s], returns part of a `PeerResult`."""
    does: str
    family: str
    counts: Callable[[Sizes], tuple[int, ...]]
    patience: float = 1.0
    """How long past its time limit it may take until its process is ended [s]."""

    @property
    def missing(self) -> str | None:
        """A line that says what to install, None when nothing is missing."""
        return missing_line(self.name, self.modules, self.packages)


_HERE = "hzmp_sim.bench.scale.peers"

PEERS = (
    Peer(
        "fastpathplanning",
        ("fastpathplanning",),
        "fastpathplanning",
        ("fastpathplanning", "cvxpy", "clarabel"),
        f"{_HERE}.box_graph:measure_box_graph",
        "prepares our leaves for its queries",
        "boxes",
        lambda sizes: sizes.fastpathplanning,
    ),
    Peer(
        "Drake IRIS",
        ("pydrake",),
        "drake",
        ("drake",),
        f"{_HERE}.iris:measure_iris",
        "covers 99 % of free space with regions that overlap",
        "turned",
        lambda sizes: sizes.iris,
        patience=60.0,  # it stops by itself, but not amid a region
    ),
    Peer(
        "manifold3d + CoACD",
        ("manifold3d", "coacd"),
        "manifold3d coacd",
        ("manifold3d", "coacd"),
        f"{_HERE}.mesh_pieces:measure_mesh_pieces",
        "cuts the mesh of free space into approximate hulls",
        "turned",
        lambda sizes: sizes.coacd,
    ),
)
