"""Candidates as trajectories, and which of them is the fastest that is proved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hzmp_planners.sets import Polytope
from hzmp_tracking.constants import LIMIT_TOL
from hzmp_tracking.cover import cover
from hzmp_tracking.limits import Limits
from hzmp_tracking.stops import Pieces
from hzmp_tracking.trajectory import Trajectory
from hzmp_tracking.vias import Vias


def fastest_proved(
    candidates: Sequence[Pieces | None],
    cells: tuple[Polytope, ...],
    vias: Vias,
    limits: Limits,
) -> Trajectory:
    """The fastest candidate that is within cells and limits; if none is, the one nearest to it."""
    trials: list[Trajectory] = []
    made = [pieces for pieces in candidates if pieces is not None]
    for pieces in sorted(made, key=lambda pieces: pieces.duration):
        trials.append(proved(pieces, cells, vias, limits))
        if holds(trials[-1]):
            return trials[-1]
    return min(trials, key=lambda trial: (not within(trial), trial.containment))


def proved(pieces: Pieces, cells: tuple[Polytope, ...], vias: Vias, limits: Limits) -> Trajectory:
    """The pieces, split where they change cells, as a trajectory that can tell its containment."""
    coefficients, durations, owners = cover(
        pieces.coefficients, pieces.durations, pieces.windows, cells
    )
    times = np.concatenate([[0.0], np.cumsum(durations)])
    return Trajectory(times, coefficients, owners, cells, vias.points, limits)


def holds(trial: Trajectory) -> bool:
    """Whether it is proved in its cells and keeps the limits."""
    return trial.containment <= 0.0 and within(trial)


def within(trial: Trajectory) -> bool:
    """Whether it keeps the limits on norms; those on the axes hold by construction."""
    if not np.isfinite(trial.limits.norms).any():
        return True
    return bool(trial.limit_usage[:, -1].max() <= 1.0 + LIMIT_TOL)
