"""Convex programs over balls whose verdicts are checked, whatever solver they come from.

    minimise q.v  subject to  E v = e,  v in K,   K a product of balls and norm cones, all bounded

Since K is bounded, every vector y gives a lower bound by weak duality,

    q.v  =  e.y + (q - E'y).v  >=  e.y + min over w in K of (q - E'y).w  =  L(y)

and the inner minimum has a closed form on each block. So a solver's word is never taken: its point
is clipped into K and its residual recomputed, its multipliers become a bound, and the two must
meet. Infeasibility is proved by the same bound on the least residual.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import block_array, csc_array, eye_array, hstack

from hzmp_planners._arrays import Floats
from hzmp_planners._clarabel import Cone, solve_socp
from hzmp_planners._linprog import attempt_linear
from hzmp_planners.constants import GAP_TOL, RESIDUAL_TOL
from hzmp_planners.errors import SolverError

Matrix = csc_array[np.float64]


class Block(NamedTuple):
    """Consecutive variables that share one bounded convex set."""

    size: int
    p: float
    r"""The norm: inf for a box, 2 for a ball, any p >= 1."""
    radius: float = 1.0
    """:math:`\\|v\\|_p \\le` radius; of an epigraph, the largest value of its first variable."""
    epigraph: bool = False
    r"""If True the block is (t, w) with :math:`\\|w\\|_p \\le t \\le` radius."""


@dataclass(frozen=True, eq=False)
class ConvexProgram:
    """Minimise q.v subject to E v = e and v in the product of the blocks.

    The caller scales lengths so that the numbers are of order one: tolerances are absolute here.
    """

    q: Floats
    """Shape (nx,)."""
    E: Floats | Matrix
    """Shape (m, nx)."""
    e: Floats
    """Shape (m,)."""
    blocks: tuple[Block, ...]

    @property
    def is_linear(self) -> bool:
        return all(block.p == math.inf or block.size == 1 for block in self.blocks)

    def clip(self, v: Floats) -> Floats:
        """Nearest point of K along rays (componentwise in boxes), shape (nx,)."""
        clipped = v.copy()
        for block, part in _parts(self.blocks, clipped):
            if block.epigraph:
                part[0] = min(max(float(part[0]), norm(part[1:], block.p)), block.radius)
                reach, inner = float(part[0]), part[1:]
            else:
                reach, inner = block.radius, part
            if block.p == math.inf:
                np.clip(inner, -reach, reach, out=inner)
            elif (length := norm(inner, block.p)) > reach:
                inner *= reach / length
        return clipped

    def lower_bound(self, y: Floats) -> float:
        """L(y), a lower bound of the optimum for every y of shape (m,)."""
        reduced = self.q - self.E.T @ y
        total = float(self.e @ y)
        for block, part in _parts(self.blocks, reduced):
            if block.epigraph:
                slope = float(part[0]) - norm(part[1:], conjugate(block.p))
                total += min(0.0, slope) * block.radius
            else:
                total -= norm(part, conjugate(block.p)) * block.radius
        return total

    def residual(self, v: Floats) -> float:
        """Largest violation of E v = e, relative to e where that is above 1."""
        size = max(1.0, float(np.abs(self.e).max(initial=0.0)))
        return float(np.abs(self.E @ v - self.e).max(initial=0.0)) / size


@dataclass(frozen=True, eq=False)
class Optimum:
    """A point whose residual and distance from the bound were recomputed."""

    v: Floats
    """Point of K, shape (nx,)."""
    value: float
    """q.v."""
    bound: float
    """L(y): no feasible point has a smaller value."""
    y: Floats
    """Multipliers that prove the bound, shape (m,)."""


def minimize(program: ConvexProgram, purpose: str) -> Optimum | None:
    """The verified optimum, or None when it is proved that no point of K has E v = e.

    Feasible means up to a residual of `RESIDUAL_TOL`.

    Args:
        program: what to solve.
        purpose: what it is solved for, for the error message.

    Raises:
        SolverError: neither solver returned a verdict that could be verified.
    """
    found = _attempt(program)
    if found is not None:
        return found
    nearest = least_residual(program, purpose)
    if nearest.bound > RESIDUAL_TOL:
        return None
    found = _attempt(_elastic(program, 10.0 * RESIDUAL_TOL))
    if found is None:
        raise SolverError(f"{purpose}: neither HiGHS nor Clarabel found a verdict that holds")
    nx = program.q.size
    return Optimum(found.v[:nx], float(program.q @ found.v[:nx]), found.bound, found.y)


def least_residual(program: ConvexProgram, purpose: str) -> Optimum:
    """Minimise the largest entry of |E v - e| over K: always feasible, so always decided.

    Raises:
        SolverError: neither solver returned an optimum that could be verified.
    """
    m = program.e.size
    most = float(np.abs(program.e).max(initial=0.0)) + 1.0
    relaxed = ConvexProgram(
        np.concatenate([np.zeros(program.q.size), [1.0], np.zeros(m)]),
        _beside(program.E, csc_array((m, 1)), csc_array(eye_array(m))),
        program.e,
        (*program.blocks, Block(m + 1, math.inf, most, epigraph=True)),
    )
    found = _attempt(relaxed)
    if found is None:
        raise SolverError(f"{purpose}: neither HiGHS nor Clarabel found a verdict that holds")
    return found


def norm(x: Floats, p: float) -> float:
    """The p-norm; 0 for no entries."""
    if not x.size:
        return 0.0
    return float(np.abs(x).max()) if p == math.inf else float(np.linalg.norm(x, p))


def conjugate(p: float) -> float:
    """The q with 1/p + 1/q = 1."""
    if p == math.inf:
        return 1.0
    return math.inf if p == 1.0 else p / (p - 1.0)


def _parts(blocks: tuple[Block, ...], v: Floats) -> list[tuple[Block, Floats]]:
    found, start = [], 0
    for block in blocks:
        found.append((block, v[start : start + block.size]))
        start += block.size
    return found


def _beside(*matrices: Floats | Matrix) -> Floats | Matrix:
    """Columns of several matrices side by side; dense if the first one is."""
    if isinstance(matrices[0], np.ndarray):
        return np.hstack([m if isinstance(m, np.ndarray) else m.toarray() for m in matrices])
    return csc_array(hstack([csc_array(m) for m in matrices]))


def _elastic(program: ConvexProgram, room: float) -> ConvexProgram:
    """The same program with every equation free to miss by `room`."""
    m = program.e.size
    return ConvexProgram(
        np.append(program.q, np.zeros(m)),
        _beside(program.E, csc_array(eye_array(m))),
        program.e,
        (*program.blocks, Block(m, math.inf, room)),
    )


def _attempt(program: ConvexProgram) -> Optimum | None:
    """Ask one solver, then the other, for an optimum that passes the check."""
    for solve in (_highs, _clarabel) if program.is_linear else (_clarabel,):
        answer = solve(program)
        if answer is None:
            continue
        v, y = program.clip(answer[0]), answer[1]
        value, bound = float(program.q @ v), program.lower_bound(y)
        close = value - bound <= GAP_TOL * max(1.0, abs(value))
        if close and program.residual(v) <= RESIDUAL_TOL:
            return Optimum(v, value, bound, y)
    return None


def _highs(program: ConvexProgram) -> tuple[Floats, Floats] | None:
    """Simplex: boxes become bounds, norm cones of the box two inequalities an entry."""
    nx = program.q.size
    lo, hi = np.full(nx, -np.inf), np.full(nx, np.inf)
    rows: list[Matrix] = []
    start = 0
    for block in program.blocks:
        stop = start + block.size
        if block.epigraph:
            lo[start], hi[start] = 0.0, block.radius
            entries = block.size - 1
            select = csc_array(
                (np.ones(entries), (np.arange(entries), np.arange(start + 1, stop))),
                shape=(entries, nx),
            )
            above = csc_array(
                (np.ones(entries), (np.arange(entries), np.full(entries, start))),
                shape=(entries, nx),
            )
            rows += [select - above, -select - above]
        else:
            lo[start:stop], hi[start:stop] = -block.radius, block.radius
        start = stop
    upper = None
    if rows:
        A = csc_array(block_array([[row] for row in rows]))
        upper = (A, np.zeros(A.shape[0]))
    answer = attempt_linear(program.q, upper=upper, equal=(program.E, program.e), lo=lo, hi=hi)
    return None if answer is None else (answer.x, answer.equal)


def _clarabel(program: ConvexProgram) -> tuple[Floats, Floats] | None:
    """Interior point: balls as second-order cones, other norms as power cones."""
    nx, m = program.q.size, program.e.size
    builder = _Cones(nx)
    start = 0
    for block in program.blocks:
        builder.add(block, start)
        start += block.size
    A, b, cones = builder.rows(program.E, program.e)
    cost = np.append(program.q, np.zeros(A.shape[1] - nx))
    solution = solve_socp(cost, A, b, [("zero", m), *cones])
    if not (np.isfinite(solution.x).all() and np.isfinite(solution.z).all()):
        return None
    return solution.x[:nx], -solution.z[:m]


class _Cones:
    """Rows of `b - A x in cones` for the blocks of a program."""

    def __init__(self, nx: int) -> None:
        self._columns = nx
        self._entries: list[tuple[int, int, float]] = []  # row, column, value
        self._b: list[float] = []
        self._cones: list[Cone] = []

    def add(self, block: Block, start: int) -> None:
        """Rows of one block whose first variable has the given index."""
        top = start if block.epigraph else None
        inner = range(start + (1 if block.epigraph else 0), start + block.size)
        if top is not None:
            self._nonnegative([(block.radius, [(top, -1.0)])])
        if block.p == math.inf or len(inner) == 1:
            self._nonnegative(
                [self._bounded(block, top, [(j, sign)]) for j in inner for sign in (-1.0, 1.0)]
            )
        elif block.p == 2.0:
            rows = [self._bounded(block, top, []), *((0.0, [(j, 1.0)]) for j in inner)]
            self._append(rows, ("second_order", len(rows)))
        else:
            self._power(block, top, inner)

    def _power(self, block: Block, top: int | None, inner: range) -> None:
        """|v_j| <= w_j^(1/p) reach^(1-1/p) and sum w <= reach, which is the p-norm."""
        weights = range(self._columns, self._columns + len(inner))
        self._columns += len(inner)
        self._nonnegative([self._bounded(block, top, [(w, -1.0) for w in weights])])
        for j, w in zip(inner, weights, strict=True):
            if block.p == 1.0:
                self._nonnegative([(0.0, [(w, 1.0), (j, sign)]) for sign in (-1.0, 1.0)])
            else:
                reach = self._bounded(block, top, [])
                rows = [(0.0, [(w, 1.0)]), reach, (0.0, [(j, 1.0)])]
                self._append(rows, ("power", 1.0 / block.p))

    @staticmethod
    def _bounded(
        block: Block, top: int | None, terms: list[tuple[int, float]]
    ) -> tuple[float, list[tuple[int, float]]]:
        """The affine function reach + terms, as (constant, [(column, coefficient)])."""
        if top is None:
            return block.radius, terms
        return 0.0, [(top, 1.0), *terms]

    def _nonnegative(self, rows: list[tuple[float, list[tuple[int, float]]]]) -> None:
        self._append(rows, ("nonnegative", len(rows)))

    def _append(self, rows: list[tuple[float, list[tuple[int, float]]]], cone: Cone) -> None:
        for constant, terms in rows:
            self._entries += [(len(self._b), column, -value) for column, value in terms]
            self._b.append(constant)
        self._cones.append(cone)

    def rows(self, E: Floats | Matrix, e: Floats) -> tuple[Matrix, Floats, list[Cone]]:
        """All rows, the equations first."""
        index = np.array([(row, column) for row, column, _ in self._entries], dtype=np.int64)
        index = index.reshape(-1, 2)
        values = np.array([value for _, _, value in self._entries])
        shape = (len(self._b), self._columns)
        cone_rows = csc_array((values, (index[:, 0], index[:, 1])), shape=shape)
        blank = csc_array((e.size, self._columns - E.shape[1]))
        equations = csc_array(hstack([csc_array(E), blank]))
        A = csc_array(block_array([[equations], [cone_rows]])) if e.size else cone_rows
        return A, np.concatenate([e, self._b]), self._cones
