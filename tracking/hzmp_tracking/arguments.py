"""What a trajectory is asked for, checked: corridor, start state, and a way that is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, as_point, as_points
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking.constants import JOIN_TOL, LIMIT_TOL, WAYPOINT_TOL
from hzmp_tracking.cover import shifted
from hzmp_tracking.limits import Limits
from hzmp_tracking.stops import Pieces
from hzmp_tracking.trajectory import Trajectory


def checked_corridor(
    waypoints: ArrayLike, cells: Sequence[Polytope]
) -> tuple[Floats, tuple[Polytope, ...]]:
    """Waypoints (K + 1, n) and K cells that fit each other.

    Raises:
        ShapeError: shapes that do not fit each other, entries that are not finite.
        QueryError: a waypoint outside its cell.
    """
    chain = tuple(cells)
    if not chain:
        raise ShapeError("cells must hold at least one Polytope, got none")
    n = chain[0].n
    for k, cell in enumerate(chain):
        if cell.n != n:
            raise ShapeError(f"cell {k} has {cell.n} dimensions but cell 0 has {n}")
    points = as_points(waypoints, "waypoints", n)
    if len(points) != len(chain) + 1:
        raise ShapeError(f"{len(chain)} cells need {len(chain) + 1} waypoints, got {len(points)}")
    for k, cell in enumerate(chain):
        excess = cell.violation(points[k : k + 2])
        worst = int(np.argmax(excess))
        if excess[worst] > WAYPOINT_TOL:
            raise QueryError(
                f"waypoint {k + worst} {points[k + worst].tolist()} lies {excess[worst]:.3g} m "
                f"outside cell {k}; at most {WAYPOINT_TOL:g} m is accepted"
            )
    return points, chain


def start_state(
    velocity: ArrayLike | None, acceleration: ArrayLike | None, limits: Limits, n: int
) -> tuple[Floats, Floats]:
    """Velocity and acceleration at the start, checked against the limits."""
    v = as_point(np.zeros(n) if velocity is None else velocity, "start_velocity", n)
    a = as_point(np.zeros(n) if acceleration is None else acceleration, "start_acceleration", n)
    for name, state, norm in zip(("velocity", "acceleration"), (v, a), limits.norms, strict=False):
        size = float(np.linalg.norm(state))
        if size > norm * (1.0 + LIMIT_TOL):
            raise QueryError(f"start_{name} is {size:.6g} in all; the limit is {norm:g}")
    v_max, a_max, j_max = limits.per_axis(n)
    # Jerk needs |a| / j to end the acceleration, which adds a|a| / 2j to the velocity.
    peak = np.maximum(np.abs(v), np.abs(v + a * np.abs(a) / (2.0 * j_max)))
    for name, value, bound in (
        ("acceleration", np.abs(a), a_max),
        ("velocity, or the velocity that start_acceleration leads to,", peak, v_max),
    ):
        axis = int(np.argmax(value / bound))
        if value[axis] > bound[axis] * (1.0 + LIMIT_TOL):
            raise QueryError(
                f"start_{name} is {value[axis]:.6g} on axis {axis}; the limit is {bound[axis]:g}"
            )
    return v, a


def known_pieces(
    previous: Trajectory, points: Floats, limits: Limits, velocity: Floats, acceleration: Floats
) -> Pieces:
    """The pieces of a trajectory from the start state to rest at the last waypoint.

    Raises:
        ShapeError: another dimension.
        QueryError: it starts or ends elsewhere, or exceeds the limits.
    """
    n = points.shape[1]
    if previous.n != n:
        raise ShapeError(f"previous has {previous.n} dimensions but the waypoints have {n}")
    ends = previous.coefficients[0], shifted(previous.coefficients[-1], previous.durations[-1])
    wanted = (points[0], velocity, acceleration), (points[-1], np.zeros(n), np.zeros(n))
    size = max(1.0, float(np.abs(points).max()))
    for name, end, states in zip(("start", "end"), ends, wanted, strict=True):
        gaps = np.abs(end[:3] * np.array([[1.0], [1.0], [2.0]]) - np.array(states))
        scales = [np.array([size]), *limits.per_axis(n)[:2]]
        if any((gap > JOIN_TOL * s).any() for gap, s in zip(gaps, scales, strict=True)):
            raise QueryError(
                f"previous has another {name} than asked for, off by {float(gaps.max()):.3g}"
            )
    usage = limits.usage(previous.peaks, previous.norm_peaks)
    if usage.max() > 1.0 + LIMIT_TOL:
        raise QueryError(f"previous uses {float(usage.max()):.6g} of a limit; at most 1 is valid")
    every = ((0, len(points) - 1),) * previous.durations.size
    return Pieces(previous.coefficients, previous.durations, every)
