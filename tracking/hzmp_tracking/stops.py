"""Straight rest-to-rest motion along a polyline, and the first move from a given state (ruckig).

On a straight segment the limits of axes and norms become limits of the arc length, so one scalar
ruckig profile is time-optimal there and stays on the line exactly: inside, by convexity of the
cells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import ruckig

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SolverError
from hzmp_tracking.constants import LIMIT_TOL
from hzmp_tracking.limits import Limits

_LEFT = 0.01  # of a norm, shared by the axes at least: without any room ruckig finds no motion


@dataclass(frozen=True, eq=False)
class Pieces:
    """Cubic pieces in sequence, and the range (first, last + 1) of cells each may lie in."""

    coefficients: Floats
    """Ascending powers of local time, shape (m, 4, n)."""
    durations: Floats
    """Shape (m,) [s]."""
    windows: tuple[tuple[int, int], ...]

    @property
    def duration(self) -> float:
        """Total time [s]."""
        return float(self.durations.sum())

    @property
    def end(self) -> Floats:
        """Position at the end of the last piece, shape (n,) [m]."""
        powers = self.durations[-1] ** np.arange(4)
        return np.asarray(powers @ self.coefficients[-1])

    def moved(self, cells: int) -> Pieces:
        """The same pieces with their windows moved by a number of cells."""
        windows = tuple((first + cells, last + cells) for first, last in self.windows)
        return Pieces(self.coefficients, self.durations, windows)

    @staticmethod
    def join(parts: Sequence[Pieces]) -> Pieces:
        """The parts one after another."""
        return Pieces(
            np.concatenate([part.coefficients for part in parts]),
            np.concatenate([part.durations for part in parts]),
            tuple(window for part in parts for window in part.windows),
        )


def polyline(points: Floats, corners: Sequence[int], limits: Limits) -> Pieces:
    """Straight motion through `points[corners]`, resting at each; shape of points (K + 1, n).

    Segment from corner i to corner j is allowed the cells i .. j - 1.
    """
    parts = [straight(points[i], points[j], limits, (i, j)) for i, j in pairwise(corners)]
    return Pieces.join(parts)


def straight(start: Floats, goal: Floats, limits: Limits, window: tuple[int, int]) -> Pieces:
    """Time-optimal rest-to-rest motion on the line from start to goal, both (n,) [m]."""
    n = start.size
    length = float(np.linalg.norm(goal - start))
    if length == 0.0:
        standing = np.zeros((1, 4, n))
        standing[0, 0] = start
        return Pieces(standing, np.zeros(1), (window,))
    direction = (goal - start) / length
    request = ruckig.InputParameter(1)
    request.current_position, request.target_position = [0.0], [length]
    return _on_line(request, start, direction, limits, window)


def brake_straight(
    position: Floats, velocity: Floats, acceleration: Floats, limits: Limits,
    window: tuple[int, int],
) -> Pieces | None:  # fmt: skip
    """The fastest stop on the line of motion; None when the acceleration, (n,), leaves that line.

    Where norms alone are bounded no stop is faster.
    """
    speed = float(np.linalg.norm(velocity))
    if speed == 0.0:
        return None
    direction = velocity / speed
    along = float(acceleration @ direction)
    if float(np.linalg.norm(acceleration - along * direction)) > LIMIT_TOL * (1.0 + abs(along)):
        return None
    request = ruckig.InputParameter(1)
    request.control_interface = ruckig.ControlInterface.Velocity
    request.current_position, request.current_velocity = [0.0], [speed]
    request.current_acceleration = [along]
    return _on_line(request, position, direction, limits, window)


def _on_line(
    request: ruckig.InputParameter, start: Floats, direction: Floats, limits: Limits,
    window: tuple[int, int],
) -> Pieces:  # fmt: skip
    """The scalar motion along the line from `start`, within the limits of that direction."""
    v, a, j = limits.along(direction)
    request.max_velocity, request.max_acceleration, request.max_jerk = [v], [a], [j]
    coefficients, durations = _pieces(request)
    spread = coefficients * direction  # (m, 4, 1) * (n,)
    spread[:, 0] += start
    return Pieces(spread, durations, (window,) * durations.size)


def from_state(
    position: Floats,
    velocity: Floats,
    acceleration: Floats,
    target: Floats | None,
    limits: Limits,
    window: tuple[int, int],
) -> Pieces:
    """Motion from a moving state to rest at `target`, or to rest anywhere (None).

    All states have shape (n,). Time-optimal where axes alone are bounded; norms are bounded through
    a box inside them. The path is not straight: containment is for the caller to check, and norms
    as well, which a state at the edge of one may exceed.
    """
    n = position.size
    request = ruckig.InputParameter(n)
    request.current_position = position.tolist()
    request.current_velocity = velocity.tolist()
    request.current_acceleration = acceleration.tolist()
    v, a, j = box_for(velocity, acceleration, limits)
    request.max_velocity, request.max_acceleration = v.tolist(), a.tolist()
    request.max_jerk = j.tolist()
    if target is None:
        request.control_interface = ruckig.ControlInterface.Velocity
        request.synchronization = ruckig.Synchronization.No
    else:
        request.target_position = target.tolist()
    coefficients, durations = _pieces(request)
    return Pieces(coefficients, durations, (window,) * durations.size)


def box_for(
    velocity: Floats, acceleration: Floats, limits: Limits
) -> tuple[Floats, Floats, Floats]:
    """Bounds of each axis, (n,), within all limits as far as the state lets them be.

    What a norm leaves beside the state is shared evenly by the axes; where that is nothing, a
    little beyond it, which the caller has to judge.
    """
    n = velocity.size
    jerk = limits.boxes(n)[2]
    jerk = jerk * min(1.0, limits.norms[2] / float(np.linalg.norm(jerk)))
    # Jerk needs |a| / j to end the acceleration, which adds a|a| / 2j to the velocity.
    ended = velocity + acceleration * np.abs(acceleration) / (2.0 * jerk)
    boxes = []
    for needed, axis, norm in zip(
        (np.maximum(np.abs(velocity), np.abs(ended)), np.abs(acceleration)),
        limits.per_axis(n)[:2], limits.norms[:2], strict=True,
    ):  # fmt: skip
        if not np.isfinite(norm):
            boxes.append(axis)
            continue
        rest = max(norm**2 - float(needed @ needed), (_LEFT * norm) ** 2) / n
        boxes.append(np.minimum(axis, np.sqrt(needed**2 + rest)))
    return boxes[0], boxes[1], jerk


def _pieces(request: ruckig.InputParameter) -> tuple[Floats, Floats]:
    """Run ruckig; coefficients (m, 4, n) and durations (m,) of its cubic pieces.

    Raises:
        SolverError: ruckig has no answer (limits or states at the edge of double precision).
    """
    n = request.degrees_of_freedom
    result = ruckig.Trajectory(n)
    code = ruckig.Ruckig(n).calculate(request, result)
    if code not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise SolverError(f"ruckig found no motion from {request.current_position}: {code.name}")
    phases = [np.array([*axis.brake.t, *axis.t]) for axis in result.profiles[0]]
    ends = [np.cumsum(phase) for phase in phases]
    times = np.unique(
        np.clip(np.concatenate([[0.0, result.duration], *ends]), 0.0, result.duration)
    )
    if times.size == 1:
        times = np.array([0.0, 0.0])
    middle = 0.5 * (times[:-1] + times[1:])
    jerk = np.zeros((middle.size, n))
    for axis, (profile, end) in enumerate(zip(result.profiles[0], ends, strict=True)):
        # The last entry is the rest of an axis that arrives before the others.
        values = np.array([*profile.brake.j, *profile.j, 0.0])
        jerk[:, axis] = values[np.searchsorted(end, middle, side="right")]
    states = np.array([result.at_time(float(t)) for t in times[:-1]])  # (m, 3, n)
    coefficients = np.stack([states[:, 0], states[:, 1], states[:, 2] / 2.0, jerk / 6.0], axis=1)
    return coefficients, np.diff(times)
