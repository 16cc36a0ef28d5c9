"""Other libraries through the corridors of `benchmarks/trajectories.py`.

toppra (Pham and Pham 2018) times a given path within velocity and acceleration limits, as fast as
that path can be driven: it knows neither jerk nor corridors. Its path here is the one planned, with
each corner rounded by a parabola from `BLEND` before it to `BLEND` behind it.

Drake's GcsTrajectoryOptimization (Marcucci, Petersen, von Wrangel and Tedrake 2023) is given the
same cells in the same order: Bezier curves of order 5, one in each cell, least time, continuous in
velocity and acceleration, all three limits. Its convex relaxation is solved by Clarabel, the
program with derivatives, which is not convex, by SNOPT (IPOPT takes several times as long).
"""

from __future__ import annotations

import importlib
import importlib.util
import logging
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import hzmp_sim as hz

Floats = NDArray[np.float64]
Derivatives = Sequence[Callable[[Floats], Floats]]

BLEND = 0.5
"""How far from a corner its rounding begins, at most 45 % of the leg [m]."""
_SPACING = 0.1  # [m] of the points that toppra's spline goes through
_SAME = 1e-3  # [m] waypoints nearer than this to the next are one with it
_GRID = 501  # points of toppra's grid
_ORDER = 5  # of Drake's Bezier curves: three conditions at either end
_STAY = 1e-3, 10.0  # [s] least and most in one of Drake's cells
_SAMPLES = 20_001  # at which peers are checked


class Timed(NamedTuple):
    """A trajectory of another library, as sampled."""

    duration: float
    """[s]"""
    cpu: float
    """[ms]"""
    outside: float
    """Largest distance out of all cells [m]; negative when inside."""
    usage: tuple[float, ...]
    """Largest share of the limits of velocity, acceleration and, where there is one, jerk."""


Peer = Callable[[Floats, Sequence[hz.Polytope], hz.Limits], Timed | None]
"""From waypoints (k, n), cells (k - 1 of them) and limits to a trajectory, None if not found."""


def installed(module: str) -> bool:
    """Whether a peer can be measured."""
    return importlib.util.find_spec(module) is not None


def time_by_toppra(
    waypoints: Floats, cells: Sequence[hz.Polytope], limits: hz.Limits
) -> Timed | None:
    """The rounded path within velocity and acceleration limits; None when toppra finds nothing."""
    toppra: Any = importlib.import_module("toppra")
    toppra.setup_logging("ERROR")
    n = waypoints.shape[1]
    velocity, acceleration, _ = limits.per_axis(n)
    began = time.process_time()
    points = rounded(waypoints)
    along = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    constraints = [
        toppra.constraint.JointVelocityConstraint(np.column_stack([-velocity, velocity])),
        toppra.constraint.JointAccelerationConstraint(
            np.column_stack([-acceleration, acceleration])
        ),
    ]
    grid = np.linspace(0.0, along[-1], _GRID)
    path = toppra.SplineInterpolator(along, points)
    timed = toppra.algorithm.TOPPRA(constraints, path, gridpoints=grid).compute_trajectory(0.0, 0.0)
    spent = 1e3 * (time.process_time() - began)
    if timed is None:
        return None
    values = [lambda t, k=k: np.asarray(timed(t, k)) for k in range(3)]
    return checked(float(timed.duration), spent, values, cells, limits)


def time_by_drake(
    waypoints: Floats, cells: Sequence[hz.Polytope], limits: hz.Limits
) -> Timed | None:
    """The fastest curves through the cells, in their order; None when the solver finds none."""
    planning: Any = importlib.import_module("pydrake.planning")
    sets: Any = importlib.import_module("pydrake.geometry.optimization")
    solvers: Any = importlib.import_module("pydrake.solvers")
    logging.getLogger("drake").setLevel(logging.ERROR)
    n, last = waypoints.shape[1], len(cells) - 1
    began = time.process_time()
    graph = planning.GcsTrajectoryOptimization(n)
    regions = [sets.HPolyhedron(cell.A, cell.b) for cell in cells]
    order = [(k, k + 1) for k in range(last)]
    inside = graph.AddRegions(regions, order, order=_ORDER, h_min=_STAY[0], h_max=_STAY[1])
    start, goal = (graph.AddRegions([sets.Point(end)], order=0) for end in waypoints[[0, -1]])
    ends = (
        graph.AddEdges(start, inside, edges_between_regions=[(0, 0)]),
        graph.AddEdges(inside, goal, edges_between_regions=[(last, 0)]),
    )
    graph.AddTimeCost()
    velocity, *others = limits.per_axis(n)
    graph.AddVelocityBounds(-velocity, velocity)
    for k, limit in enumerate(others, start=2):
        graph.AddNonlinearDerivativeBounds(-limit, limit, k)
    for k in (1, 2):
        graph.AddContinuityConstraints(k)
        for edge in ends:
            edge.AddZeroDerivativeConstraints(k)
    options = sets.GraphOfConvexSetsOptions()
    options.convex_relaxation, options.preprocessing = True, False
    options.max_rounded_paths = 1  # there is one sequence of cells
    options.solver, options.restriction_solver = solvers.ClarabelSolver(), solvers.SnoptSolver()
    curve, result = graph.SolvePath(start, goal, options)
    spent = 1e3 * (time.process_time() - began)
    if not result.is_success():
        return None
    first = float(curve.start_time())

    def derivative(k: int) -> Callable[[Floats], Floats]:
        return lambda t: np.array([curve.EvalDerivative(first + x, k).ravel() for x in t])

    values = [derivative(k) for k in range(4)]
    return checked(float(curve.end_time()) - first, spent, values, cells, limits)


def rounded(waypoints: Floats) -> Floats:
    """Points on a polygonal path whose corners are parabolas, shape (k, n)."""
    # A corner can lie on two doors: one of such waypoints is enough, the goal not the one dropped.
    steps = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    waypoints = waypoints[np.append(steps > _SAME, True)]
    found = [waypoints[:1]]
    for before, corner, after in zip(waypoints[:-2], waypoints[1:-1], waypoints[2:], strict=True):
        legs = [end - corner for end in (before, after)]
        lengths = [float(np.linalg.norm(leg)) for leg in legs]
        reach = min(BLEND, 0.45 * min(lengths))
        begin, end = (
            corner + reach * leg / length for leg, length in zip(legs, lengths, strict=True)
        )
        found.append(_leg(found[-1][-1], begin))
        s = np.linspace(0.0, 1.0, max(4, round(2.0 * reach / _SPACING)) + 1)[1:, None]
        found.append((1.0 - s) ** 2 * begin + 2.0 * s * (1.0 - s) * corner + s**2 * end)
    found.append(_leg(found[-1][-1], waypoints[-1]))
    return np.concatenate(found)


def _leg(start: Floats, end: Floats) -> Floats:
    """Points from `start`, which is left out, to `end`."""
    count = max(2, round(float(np.linalg.norm(end - start)) / _SPACING))
    return np.linspace(start, end, count + 1)[1:]


def checked(
    duration: float,
    spent: float,
    values: Derivatives,
    cells: Sequence[hz.Polytope],
    limits: hz.Limits,
) -> Timed:
    """Sample position and derivatives [m, m/s, ...], functions of times (k,) to (k, n)."""
    t = np.linspace(0.0, duration, _SAMPLES)
    position, *rates = (value(t) for value in values)
    outside = np.min([cell.violation(position) for cell in cells], axis=0)
    bounds = limits.per_axis(position.shape[1])[: len(rates)]
    usage = tuple(
        float((np.abs(rate) / bound).max()) for rate, bound in zip(rates, bounds, strict=True)
    )
    return Timed(duration, spent, float(outside.max()), usage)
