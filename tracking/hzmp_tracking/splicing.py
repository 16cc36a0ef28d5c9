"""Parts of trajectories, and trajectories one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from hzmp_planners.errors import QueryError, ShapeError
from hzmp_tracking.constants import JOIN_TOL
from hzmp_tracking.cover import shifted

if TYPE_CHECKING:
    from hzmp_tracking.trajectory import Trajectory


def part_fields(trajectory: Trajectory, start: float, end: float) -> dict[str, Any]:
    """The arguments of the part from start to end, its time counted from 0.

    Raises:
        QueryError: not 0 <= start < end <= duration.
    """
    if not 0.0 <= start < end <= trajectory.duration:
        raise QueryError(
            f"no part from {start:g} to {end:g} s: a part begins before it ends, within "
            f"0 to {trajectory.duration:g} s"
        )
    times = trajectory.breakpoints
    first = int(np.searchsorted(times, start, side="right")) - 1
    last = int(np.searchsorted(times, end, side="left"))
    coefficients = trajectory.coefficients[first:last].copy()
    coefficients[0] = shifted(coefficients[0], start - float(times[first]))
    owners = trajectory.piece_cells[first:last]
    low, high = int(owners.min()), int(owners.max()) + 1
    ends = trajectory.sample([start, end]).position
    return {
        "breakpoints": np.concatenate([[start], times[first + 1 : last], [end]]) - start,
        "coefficients": coefficients,
        "piece_cells": owners - low,
        "cells": trajectory.cells[low:high],
        "waypoints": np.vstack([ends[:1], trajectory.waypoints[low + 1 : high], ends[1:]]),
        "limits": trajectory.limits,
    }


def joined_fields(parts: Sequence[Trajectory]) -> dict[str, Any]:
    """The arguments of the trajectory that runs through all parts.

    Raises:
        ShapeError: there is none, or they differ in dimension.
        QueryError: one does not go on where and as the one before ends, or has other limits.
    """
    if not parts:
        raise ShapeError("no trajectory to join")
    for number, (one, two) in enumerate(pairwise(parts)):
        _check_joint(number, one, two)
    cells, owners = list(parts[0].cells), [parts[0].piece_cells]
    waypoints, times = parts[0].waypoints, [parts[0].breakpoints]
    for part in parts[1:]:
        shared = int(part.cells[0] is cells[-1])  # the last cell goes on
        owners.append(part.piece_cells + len(cells) - shared)
        waypoints = np.vstack([waypoints[: len(waypoints) - shared], part.waypoints[1:]])
        cells += part.cells[shared:]
        times.append(times[-1][-1] + part.breakpoints[1:])
    return {
        "breakpoints": np.concatenate(times),
        "coefficients": np.concatenate([part.coefficients for part in parts]),
        "piece_cells": np.concatenate(owners),
        "cells": tuple(cells),
        "waypoints": waypoints,
        "limits": parts[0].limits,
    }


def _check_joint(number: int, one: Trajectory, two: Trajectory) -> None:
    if one.n != two.n:
        raise ShapeError(f"part {number} has dimension {one.n}, part {number + 1} has {two.n}")
    limits = np.array(one.limits.per_axis(one.n))
    if not one.limits.same_as(two.limits, one.n):
        raise QueryError(f"parts {number} and {number + 1} have different limits")
    scale = np.full(one.n, max(1.0, float(np.abs(one.waypoints).max())))
    end = shifted(one.coefficients[-1], float(one.durations[-1]))
    jumps = np.abs(two.coefficients[0] - end)[:3] * [[1.0], [1.0], [2.0]]
    sizes = np.array([scale, limits[0], limits[1]])
    for name, jump, size in zip(
        ("position", "velocity", "acceleration"), jumps, sizes, strict=True
    ):
        if (jump > JOIN_TOL * size).any():
            raise QueryError(
                f"part {number + 1} does not go on as part {number} ends: its {name} is off by "
                f"{float(jump.max()):.3g}"
            )
