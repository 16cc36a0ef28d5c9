"""How CoACD cuts a mesh: the settings that matter, under the names of its paper."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from hzmp_planners.errors import QueryError

SEED = 0
"""Of CoACD's tree search: the same mesh and settings give the same pieces."""


@dataclass(frozen=True, kw_only=True)
class ConvexDecomposition:
    """Settings of CoACD (Wei, Liu, Ling, Su: Approximate convex decomposition, SIGGRAPH 2022).

    The search is smaller than CoACD's own default (20 nodes, 150 iterations, depth 3), which takes
    several times as long for about as many pieces.

    Attributes:
        threshold: how concave a piece may stay, as a share of the mesh's size, 0.01 to 1; smaller
            gives more pieces that follow the mesh closer, and takes longer.
        max_pieces: merge pieces until there are no more than this; default: as many as it takes.
        mcts_nodes: cutting planes tried along each axis.
        mcts_iterations: rounds of the tree search for each cut.
        mcts_max_depth: cuts that the search looks ahead.
        preprocess: rebuild the surface as a closed one first: on, off, or only when it is not.
        preprocess_resolution: how finely it is rebuilt, in cells along the mesh, 20 to 100.
        time_limit: for each mesh, until CoACD is given up [s].
    """

    threshold: float = 0.05
    max_pieces: int | None = None
    mcts_nodes: int = 10
    mcts_iterations: int = 40
    mcts_max_depth: int = 2
    preprocess: Literal["auto", "on", "off"] = "auto"
    preprocess_resolution: int = 50
    time_limit: float = 600.0

    def __post_init__(self) -> None:
        if not 0.01 <= self.threshold <= 1.0:
            raise QueryError(f"coacd threshold must be from 0.01 to 1, got {self.threshold}")
        for name, least, most in (
            ("mcts_nodes", 1, 100),
            ("mcts_iterations", 1, 10_000),
            ("mcts_max_depth", 1, 10),
            ("preprocess_resolution", 20, 100),
        ):
            if not least <= getattr(self, name) <= most:
                raise QueryError(
                    f"coacd {name} must be from {least} to {most}, got {getattr(self, name)}"
                )
        if self.max_pieces is not None and self.max_pieces < 1:
            raise QueryError(f"coacd max_pieces must be at least 1, got {self.max_pieces}")
        if self.preprocess not in ("auto", "on", "off"):
            raise QueryError(f"coacd preprocess must be auto, on or off, got {self.preprocess!r}")
        if not 0.0 < self.time_limit < math.inf:
            raise QueryError(f"coacd time_limit must be positive, got {self.time_limit}")

    def coacd_arguments(self) -> dict[str, float | int | str]:
        """Keyword arguments of `coacd.run_coacd`; what decides the pieces, and nothing else.

        Never `decimate`: pieces of fewer corners cut into the mesh by up to 1 % of its size.
        """
        return {
            "threshold": self.threshold,
            "max_convex_hull": -1 if self.max_pieces is None else self.max_pieces,
            "mcts_nodes": self.mcts_nodes,
            "mcts_iterations": self.mcts_iterations,
            "mcts_max_depth": self.mcts_max_depth,
            "preprocess_mode": self.preprocess,
            "preprocess_resolution": self.preprocess_resolution,
            "seed": SEED,
        }
