"""Via points: the shortest polyline through the overlaps of consecutive cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._clarabel import Cone, second_order_cones, solve_socp
from hzmp_planners.sets import Polytope
from hzmp_tracking.constants import INTERIOR_MARGIN
from hzmp_tracking.facets import opposite

_END_MARGIN = 2e-7  # [m] where the start or the goal lies on a facet: the path leaves it
_ROOM_WEIGHT = 1e3  # metres of length that one metre of margin is worth: margins come first


@dataclass(frozen=True, eq=False)
class Vias:
    """Points x_0 .. x_K, x_k in cells k-1 and k."""

    points: Floats
    """Shape (K + 1, n) [m]."""
    pinched: Bools
    """Shape (K + 1,): the overlap has no interior around the point, not even within a shared face
    (a contact in an edge or a corner). The path can only pass exactly through it."""

    def part(self, i: int, j: int) -> Vias:
        """Points i .. j."""
        return Vias(self.points[i : j + 1], self.pinched[i : j + 1])


def place_vias(waypoints: Floats, cells: Sequence[Polytope]) -> Vias:
    """Shortest polyline from the first to the last waypoint through the overlaps of the cells.

    One second-order cone program: min sum |x_k+1 - x_k| - W sum t_k, with A x_k + t_k <= b for the
    facets of both cells and 0 <= t_k <= `INTERIOR_MARGIN`, so that points keep off the facets
    where there is room. Where two cells share a face, its plane holds as an equality. If the
    solver fails, the waypoints are returned as they are.

    Args:
        waypoints: shape (K + 1, n) [m]; inner ones are used only if the program fails.
        cells: K polytopes.
    """
    K, n = len(cells), waypoints.shape[1]
    points = waypoints.copy()
    pinched = np.zeros(K + 1, dtype=np.bool_)
    if K == 1:
        return Vias(points, pinched)
    overlaps = [_overlap(cells[k], cells[k + 1]) for k in range(K - 1)]
    solution = _solve(waypoints, overlaps)
    if solution is None:
        pinched[1:-1] = True
        return Vias(points, pinched)
    inner, room = solution
    for k, (A, b, plane) in enumerate(overlaps):
        x = inner[k]
        if plane is not None:
            x = x - plane[:n] * (plane[:n] @ x - plane[n])
        pinched[k + 1] = room[k] < 1e-3 * INTERIOR_MARGIN
        before = (A @ waypoints[k + 1] - b).max(initial=-np.inf)
        if not pinched[k + 1] or (A @ x - b).max(initial=-np.inf) < before:
            points[k + 1] = x
    return Vias(points, pinched)


def facet_margins(points: Floats, cells: Sequence[Polytope]) -> list[Floats]:
    """Margin [m] of each facet of each cell that a path near the via points can keep.

    Half the slack of the two via points of the cell, at most half of `INTERIOR_MARGIN`: by
    convexity the polyline itself keeps it.
    """
    margins = []
    last = len(points) - 1
    for k, cell in enumerate(cells):
        slack = cell.b - points[k : k + 2] @ cell.A.T
        at_end = np.array([k == 0, k + 1 == last])
        slack[at_end] = np.maximum(slack[at_end], _END_MARGIN)
        margins.append(0.5 * np.clip(slack.min(axis=0), 0.0, INTERIOR_MARGIN))
    return margins


def shared_plane(first: Polytope, second: Polytope) -> Floats | None:
    """The plane (a, offset) between two cells that share a face, a pointing out of the first."""
    return _overlap(first, second)[2]


def _overlap(first: Polytope, second: Polytope) -> tuple[Floats, Floats, Floats | None]:
    """Half-spaces of the intersection, and the plane (a, offset) that separates them, if any."""
    A, b = np.vstack([first.A, second.A]), np.concatenate([first.b, second.b])
    pairs = np.argwhere(opposite(first.A[:, None], first.b[:, None], second.A, second.b))
    if not len(pairs):
        return A, b, None
    i, j = pairs[0]
    keep = np.ones(b.size, dtype=np.bool_)
    keep[[i, first.b.size + j]] = False
    offset = 0.5 * (first.b[i] - second.b[j])
    return A[keep], b[keep], np.append(first.A[i], offset)


def _solve(
    waypoints: Floats, overlaps: Sequence[tuple[Floats, Floats, Floats | None]]
) -> tuple[Floats, Floats] | None:
    """Inner points (K-1, n) and their margins (K-1,), or None if the solver fails.

    Unknowns: inner points x, margins t, lengths s of the K segments.
    """
    count, n = len(overlaps), waypoints.shape[1]
    x = np.arange(count * n).reshape(count, n)
    t = count * n + np.arange(count)
    s = count * n + count + np.arange(count + 1)
    program = _Rows()
    planes = [(k, plane) for k, (_, _, plane) in enumerate(overlaps) if plane is not None]
    for k, plane in planes:
        program.add(x[k], plane[None, :n], plane[n:])
    for k, (A, b, _) in enumerate(overlaps):
        program.add(np.append(x[k], t[k]), np.hstack([A, np.ones((b.size, 1))]), b)
        program.add(t[k : k + 1], np.array([[1.0], [-1.0]]), np.array([INTERIOR_MARGIN, 0.0]))
    inequalities = program.count - len(planes)
    for k in range(count + 1):
        # The cone holds (s_k, x_k+1 - x_k); the ends of the polyline are constants.
        here = x[k - 1] if k > 0 else x[:0].ravel()
        there = x[k] if k < count else x[:0].ravel()
        step = np.hstack([np.eye(n)[:, : here.size], -np.eye(n)[:, : there.size]])
        lengths = np.zeros((1, here.size + there.size + 1))
        lengths[0, 0] = -1.0
        constant = np.zeros(n)
        constant -= waypoints[0] if k == 0 else 0.0
        constant += waypoints[-1] if k == count else 0.0
        block = np.vstack([lengths, np.hstack([np.zeros((n, 1)), step])])
        program.add(np.concatenate([s[k : k + 1], here, there]), block, np.append(0.0, constant))
    cones: list[Cone] = [("zero", len(planes)), ("nonnegative", inequalities)]
    cones += second_order_cones(n + 1, count + 1)
    cost = np.concatenate([np.zeros(count * n), np.full(count, -_ROOM_WEIGHT), np.ones(count + 1)])
    offsets = np.concatenate(program.offsets)
    solution = solve_socp(cost, program.matrix(cost.size), offsets, cones)
    return (solution.x[x], solution.x[t]) if solution.solved else None


class _Rows:
    """Rows of a sparse matrix, collected as dense blocks on a few columns."""

    def __init__(self) -> None:
        self.count = 0
        self.offsets: list[Floats] = []
        self._rows: list[Ints] = []
        self._columns: list[Ints] = []
        self._values: list[Floats] = []

    def add(self, columns: Ints, block: Floats, offsets: Floats) -> None:
        """Rows block . unknowns[columns] with right-hand sides `offsets`."""
        row = self.count + np.arange(len(block))
        self._rows.append(np.repeat(row, columns.size))
        self._columns.append(np.tile(columns, row.size))
        self._values.append(block.ravel())
        self.offsets.append(offsets)
        self.count += row.size

    def matrix(self, columns: int) -> sparse.csc_array[np.float64]:
        """All rows, shape (count, columns)."""
        where = (np.concatenate(self._rows), np.concatenate(self._columns))
        shape = (self.count, columns)
        return sparse.coo_array((np.concatenate(self._values), where), shape=shape).tocsc()
