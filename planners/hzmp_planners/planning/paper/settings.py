"""What the paper leaves to its user, and a record of each iteration for those who watch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import QueryError


@dataclass(frozen=True, eq=False)
class Iteration:
    """One pass through lines 12 to 19 of algorithm 1."""

    number: int
    """From 1 on."""
    time_s: float
    """When it ended, since line 6 was begun [s]."""
    cost: float
    """Length of the shortest path over this iteration's samples [m]."""
    best: float
    """c_best after it [m]."""
    adopted: bool
    """Whether the path became the best one: a star in figure 8 of the paper."""
    waypoints: Floats
    """The shortest path over this iteration's samples, shape (K+1, n) [m]."""
    sequences: int
    """|P|: leaf sequences that were sampled."""
    faces: int
    """Shared faces that the informed set of c_best still meets, of all."""
    leaves: NDArray[np.int8]
    """`Activity` of each leaf for c_best, shape (N,)."""


@dataclass(frozen=True, kw_only=True)
class PaperSettings:
    """How much algorithm 1 samples. `plan(..., method=PaperSettings(...))` runs it with these.

    Attributes:
        hop_limit: L_max, the most leaves of a candidate sequence; None: no limit.
        sequences: K, the most candidate sequences that are sampled at the same time.
        samples: N_s, points on each shared face in each iteration.
        iterations: N_max; None: until the gap or the time limit is reached.
        observe: called after each iteration.
    """

    hop_limit: int | None = None
    sequences: int = 128
    samples: int = 16
    iterations: int | None = None
    observe: Callable[[Iteration], None] | None = None

    def __post_init__(self) -> None:
        for name in ("hop_limit", "sequences", "samples", "iterations"):
            value = getattr(self, name)
            if value is not None and (not isinstance(value, int | np.integer) or value < 1):
                raise QueryError(f"{name} must be a whole number of at least 1, got {value!r}")
