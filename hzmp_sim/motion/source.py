"""What a prediction asks of those that know where geoms will be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from hzmp_planners._arrays import Floats


@dataclass(frozen=True, eq=False)
class Slabs:
    """Where the body's centre could touch each of g geoms, slab by slab of time.

    Within slab k that is inside {x : A[i] x <= b[k, i]} for geom i.
    """

    A: Floats
    """Unit normals, shape (g, F, n); the first 2n are those of a box."""
    b: Floats
    """Offsets [m], shape (count, g, F); -inf where a geom stays out of the bounds and heights."""
    start: float
    """When the first slab begins [s]."""
    step: float
    """How long each is [s]."""


class Source(Protocol):
    """Knows where some geoms will be; i counts them, in the order of `rows`."""

    rows: tuple[int, ...]
    """Which of the moving geoms of the scene they are."""

    def windows(self, start: Floats, end: Floats) -> Floats:
        """Bounds (i, P) [m] of the grown geoms over times start to end, each (i,) [s].

        Planes as of the template; -inf for a geom that is of no concern.
        """
        ...

    def slabs(self, step: float, first: int, count: int) -> Floats:
        """Bounds (count, i, P) [m] for each slab of time; -inf for a geom that is of no concern.

        They are `step` [s] long each; that with number k begins at k steps.
        """
        ...

    def way(self, start: Floats, end: Floats) -> Floats:
        """How far each geom goes from start to end, (i, 3) [m]; 0 for those that turn or jump."""
        ...

    def across(self, start: Floats, end: Floats, normals: Floats) -> Floats:
        """Supports (i, M) [m] of the geoms over these times in world directions (i, M, 3)."""
        ...
