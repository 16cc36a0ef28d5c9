"""The two solvers' forms of a program over balls; what they return is not checked here."""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import block_array, csc_array, hstack

from hzmp_planners._arrays import Floats
from hzmp_planners._ball_program import Block, ConvexProgram, Matrix
from hzmp_planners._clarabel import Cone, solve_socp
from hzmp_planners._linprog import attempt_linear


def solve_by_simplex(program: ConvexProgram) -> tuple[Floats, Floats] | None:
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


def solve_by_interior_point(
    program: ConvexProgram, tolerance: float
) -> tuple[Floats, Floats] | None:
    """Interior point: balls as second-order cones, other norms as power cones."""
    nx, m = program.q.size, program.e.size
    builder = _Cones(nx)
    start = 0
    for block in program.blocks:
        builder.add(block, start)
        start += block.size
    A, b, cones = builder.rows(program.E, program.e)
    cost = np.append(program.q, np.zeros(A.shape[1] - nx))
    solution = solve_socp(cost, A, b, [("zero", m), *cones], tolerance=tolerance)
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
