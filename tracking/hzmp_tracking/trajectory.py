"""Trajectories: piecewise cubic in time, each piece proved in one cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, Ints, as_floats, frozen
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking.containment import derivative_maxima, violations
from hzmp_tracking.extrema import norm_maxima
from hzmp_tracking.limits import Limits
from hzmp_tracking.splicing import joined_fields, part_fields
from hzmp_tracking.storage import fields_from_json, load_fields, save, to_json


class Sample(NamedTuple):
    """State of the reference at k instants, each array of shape (k, n)."""

    position: Floats
    """[m]"""
    velocity: Floats
    """[m/s]"""
    acceleration: Floats
    """[m/s^2]"""
    jerk: Floats
    """[m/s^3]"""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Piecewise cubic curve x(t), 0 <= t <= duration.

    It ends at rest, unless it is a `part` of another one.

    Piece i covers [breakpoints[i], breakpoints[i+1]] with
    x(t) = sum_k coefficients[i, k] (t - breakpoints[i])^k.
    """

    breakpoints: Floats
    """Times where pieces meet [s], shape (m + 1,), ascending from 0."""
    coefficients: Floats
    """Ascending powers of local time, shape (m, 4, n)."""
    piece_cells: Ints
    """Index into `cells` of the cell that each piece is proved in, shape (m,)."""
    cells: tuple[Polytope, ...]
    """The convex cells, in the order of the path."""
    waypoints: Floats
    """The via points as moved into the overlaps of the cells, shape (K + 1, n) [m]."""
    limits: Limits

    def __post_init__(self) -> None:
        m, powers, _ = self.coefficients.shape
        if self.breakpoints.shape != (m + 1,) or powers != 4 or self.piece_cells.shape != (m,):
            raise ShapeError(
                f"a trajectory of {m} pieces needs breakpoints ({m + 1},), coefficients "
                f"({m}, 4, n) and piece_cells ({m},), got {self.breakpoints.shape}, "
                f"{self.coefficients.shape} and {self.piece_cells.shape}"
            )
        for array in (self.breakpoints, self.coefficients, self.piece_cells, self.waypoints):
            frozen(array)

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.coefficients.shape[2])

    @property
    def duration(self) -> float:
        """Total time [s]."""
        return float(self.breakpoints[-1])

    @property
    def durations(self) -> Floats:
        """Time of each piece [s], shape (m,)."""
        return np.diff(self.breakpoints)

    def sample(self, t: ArrayLike) -> Sample:
        """Position and derivatives at times `t` of shape (k,) [s]; a scalar is taken as (1,).

        Times before 0 give the start state; from the end on the body rests where it ended.

        Raises:
            ShapeError: t is not a finite array with at most one axis.
        """
        times = as_floats(np.atleast_1d(np.asarray(t)), "t", 1)
        piece = np.searchsorted(self.breakpoints, times, side="right") - 1
        piece = np.clip(piece, 0, self.coefficients.shape[0] - 1)
        s = (np.clip(times, 0.0, self.duration) - self.breakpoints[piece])[:, None]
        c0, c1, c2, c3 = (self.coefficients[:, k, :][piece] for k in range(4))
        moving = (times < self.duration)[:, None]
        return Sample(
            position=c0 + s * (c1 + s * (c2 + s * c3)),
            velocity=np.where(moving, c1 + s * (2.0 * c2 + 3.0 * s * c3), 0.0),
            acceleration=np.where(moving, 2.0 * c2 + 6.0 * s * c3, 0.0),
            jerk=np.where(moving, 6.0 * c3, 0.0),
        )

    @cached_property
    def containment(self) -> float:
        """Maximum over all instants and facets of a.x - b, unit normals a [m]; <= 0 is the proof.

        Each piece is compared with the facets of its own cell (`piece_cells`), exactly (see
        `containment.violations`; round-off is reported as 0.0).
        """
        values = violations(self.coefficients, self.durations, self.piece_cells, self.cells)
        return float(values.max())

    @cached_property
    def peaks(self) -> tuple[Floats, Floats, Floats]:
        """Exact maxima of |velocity|, |acceleration|, |jerk| on each axis, each (n,)."""
        return derivative_maxima(self.coefficients, self.durations)

    @cached_property
    def norm_peaks(self) -> Floats:
        """Exact maxima of the norms of velocity, acceleration and jerk, shape (3,)."""
        return frozen(norm_maxima(self.coefficients, self.durations))

    @property
    def limit_usage(self) -> Floats:
        """Peaks over limits, (3, n + 1): velocity, acceleration, jerk; axes, then the norm.

        At most 1 up to round-off; 0 where a norm is not bounded. Extrema of polynomials: it
        certifies every instant, not samples.
        """
        return self.limits.usage(self.peaks, self.norm_peaks)

    def part(self, start: float, end: float) -> Self:
        """What happens from `start` to `end` [s], its time counted from 0; it may end in motion.

        Raises:
            QueryError: not 0 <= start < end <= duration.
        """
        return type(self)(**part_fields(self, start, end))

    @classmethod
    def join(cls, parts: Sequence[Trajectory]) -> Self:
        """Trajectories one after the other.

        Raises:
            ShapeError: there is none, or they differ in dimension.
            QueryError: one does not go on where and as the one before ends (position, velocity,
                acceleration), or has other limits.
        """
        return cls(**joined_fields(parts))

    def to_json(self, indent: int | None = None) -> str:
        """One JSON object with every number: pieces, cells, waypoints and limits."""
        return to_json(self, indent)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The trajectory that `to_json` wrote.

        Raises:
            ShapeError: the text is no such trajectory.
        """
        return cls(**fields_from_json(text))

    def save(self, path: str | PathLike[str]) -> None:
        """Write .json, .npz or .parquet (a row a piece), exactly: `load` gives the same back.

        Raises:
            QueryError: another suffix.
        """
        save(self, path)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """A saved trajectory.

        Raises:
            OSError: the file cannot be read.
            QueryError: another suffix.
            ShapeError: it is not a saved trajectory.
        """
        return cls(**load_fields(path))

    def plot(self, axes: Any = None) -> Any:
        """Position, velocity, acceleration and jerk over time, with the limits as bands.

        Args:
            axes: four matplotlib axes, one above the other; new ones when None.

        Returns:
            The four axes.
        """
        from hzmp_tracking.plot import plot_trajectory

        return plot_trajectory(self, axes)
