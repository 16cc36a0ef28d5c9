"""Hybrid zonotopes (Bird, Pangborn, Jain and Koeln 2023): unions of convex leaves as one set."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import block_array, csc_array, eye_array

from hzmp_planners._arrays import Bools, Floats, as_floats, as_points
from hzmp_planners.errors import ShapeError, SolverError
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope

Matrix = csc_array[np.float64]


@dataclass(frozen=True, eq=False)
class HybridZonotope:
    r"""Union of constrained zonotopes, one for each admissible choice of the binary factors.

    .. math::

        \mathcal{Z} = \{ G_c \xi_c + G_b \xi_b + c : \|\xi_c\|_\infty \le 1,\
        \xi_b \in \{-1, 1\}^{n_b},\ A_c \xi_c + A_b \xi_b = b \}

    Matrices may be dense or scipy sparse; they are kept as compressed sparse columns.
    """

    Gc: Matrix
    """Continuous generators, shape (n, ng)."""
    Gb: Matrix
    """Binary generators, shape (n, nb)."""
    c: Floats
    """Centre, shape (n,)."""
    Ac: Matrix
    """Continuous constraint matrix, shape (nc, ng)."""
    Ab: Matrix
    """Binary constraint matrix, shape (nc, nb)."""
    b: Floats
    """Constraint offsets, shape (nc,)."""
    _cells: tuple[Floats, ...] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        c, b = as_floats(self.c, "c", 1), as_floats(self.b, "b", 1)
        Gc, Gb = _sparse(self.Gc, "Gc"), _sparse(self.Gb, "Gb")
        Ac, Ab = _sparse(self.Ac, "Ac"), _sparse(self.Ab, "Ab")
        ng, nb = Gc.shape[1], Gb.shape[1]
        expected = {
            "Gc": (Gc, (c.size, ng)),
            "Gb": (Gb, (c.size, nb)),
            "Ac": (Ac, (b.size, ng)),
            "Ab": (Ab, (b.size, nb)),
        }
        for name, (matrix, shape) in expected.items():
            if matrix.shape != shape:
                raise ShapeError(f"{name} must have shape {shape}, got {matrix.shape}")
            object.__setattr__(self, name, matrix)
        object.__setattr__(self, "c", c)
        object.__setattr__(self, "b", b)

    @classmethod
    def from_vertices(cls, V: ArrayLike, M: ArrayLike | csc_array[Any]) -> HybridZonotope:
        r"""Union of the convex hulls that the columns of M select from the rows of V.

        With 0/1 factors: :math:`x = V^T\lambda,\ 1^T\lambda = 1,\ 1^T\beta = 1,\
        \lambda + s = M\beta` (Siefert et al. 2023), so :math:`\beta = e_i` gives leaf i. Here in
        factors of [-1, 1] and {-1, 1}: ng = 2 nv, nb = N, nc = nv + 2. The slack of a vertex that
        no leaf uses twice needs no degree: (M beta)_j <= 1 whenever 1'beta = 1.

        Args:
            V: vertices, shape (nv, n) [m].
            M: incidence, dense or sparse bool, shape (nv, N).

        Raises:
            ShapeError: shapes do not fit, or a column of M is empty.
        """
        vertices = as_floats(V, "V", 2)
        incidence = _sparse(M, "M").copy()
        nv, n = vertices.shape
        if incidence.shape[0] != nv:
            raise ShapeError(f"M must have {nv} rows, one a vertex, got {incidence.shape[0]}")
        if not np.isin(incidence.data, (0.0, 1.0)).all():
            raise ShapeError("M must hold only 0 and 1")
        incidence.eliminate_zeros()
        counts = np.diff(incidence.indptr)
        if (counts == 0).any():
            raise ShapeError(f"column {int(np.argmin(counts))} of M selects no vertex")
        N = incidence.shape[1]
        half = eye_array(nv, format="csc") / 2.0
        blank = _zeros(1, nv)
        Ac = _stack([[_ones(1, nv), blank], [blank, blank], [half, half]])
        Ab = _stack([[_zeros(1, N)], [_ones(1, N)], [-incidence / 2.0]])
        degree = np.bincount(incidence.indices, minlength=nv)
        b = np.concatenate([[2.0 - nv, 2.0 - N], degree / 2.0 - 1.0])
        Gc = _stack([[csc_array(vertices.T / 2.0), _zeros(n, nv)]])
        spans = pairwise(incidence.indptr.tolist())
        cells = tuple(vertices[incidence.indices[start:stop]] for start, stop in spans)
        return cls(Gc, _zeros(n, N), vertices.sum(axis=0) / 2.0, Ac, Ab, b, cells)

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.c.size)

    @property
    def ng(self) -> int:
        """Number of continuous generators."""
        return int(self.Gc.shape[1])

    @property
    def nb(self) -> int:
        """Number of binary generators."""
        return int(self.Gb.shape[1])

    @property
    def nc(self) -> int:
        """Number of constraints."""
        return int(self.b.size)

    def leaves(self) -> tuple[ConstrainedZonotope, ...]:
        """The convex leaves.

        For a union built by `from_vertices` they are known by construction (one generator a
        vertex, one constraint). For any other hybrid zonotope every admissible vector of binary
        factors is found by mixed-integer programming with no-good cuts.

        Raises:
            SolverError: a mixed-integer program ended without a verdict.
        """
        return self._leaves

    @cached_property
    def _leaves(self) -> tuple[ConstrainedZonotope, ...]:
        if self._cells is not None:
            return tuple(ConstrainedZonotope.from_vertices(cell) for cell in self._cells)
        found: list[Floats] = []
        while (binaries := self._admissible(found)) is not None:
            found.append(binaries)
        return tuple(
            ConstrainedZonotope(
                self.Gc.toarray(), self.c + self.Gb @ xi, self.Ac.toarray(), self.b - self.Ab @ xi
            )
            for xi in found
        )

    def contains(self, X: ArrayLike, tol: float = 1e-9) -> Bools:
        """Which of the points (k, n) lie in some leaf, up to `tol` in each coordinate; (k,)."""
        points = as_points(X, "X", self.n)
        inside = np.zeros(len(points), dtype=np.bool_)
        for leaf in self.leaves():
            inside[~inside] = leaf.contains(points[~inside], tol)
        return inside

    def is_empty(self) -> bool:
        """True when no factors satisfy the constraints."""
        return self._cells == () if self._cells is not None else self._admissible([]) is None

    def _admissible(self, excluded: list[Floats]) -> Floats | None:
        """Binary factors of some leaf that is not excluded yet, shape (nb,); None if none is left.

        Binaries enter as xi_b = 2 beta - 1 with beta in {0, 1}.
        """
        ng, nb = self.ng, self.nb
        if ng + nb == 0:  # a point, or nothing: no program to solve
            return None if excluded or self.b.any() else np.zeros(0)
        constraints = []
        if self.nc:
            rows = _stack([[self.Ac, 2.0 * self.Ab]])
            offset = self.b + self.Ab @ np.ones(nb)
            constraints.append(LinearConstraint(rows, offset, offset))
        for xi in excluded:
            cut = np.concatenate([np.zeros(ng), -xi])
            constraints.append(LinearConstraint(cut[None], 1.0 - (xi > 0).sum(), np.inf))
        result = milp(
            np.zeros(ng + nb),
            integrality=np.concatenate([np.zeros(ng), np.ones(nb)]),
            bounds=Bounds(np.append(-np.ones(ng), np.zeros(nb)), np.ones(ng + nb)),
            constraints=constraints,
        )
        if result.status == 2:
            return None
        if result.status != 0 or result.x is None:
            raise SolverError(f"leaves of a hybrid zonotope: {result.message}")
        return np.asarray(2.0 * np.round(result.x[ng:]) - 1.0)


def _zeros(rows: int, columns: int) -> Matrix:
    return csc_array((rows, columns), dtype=np.float64)


def _ones(rows: int, columns: int) -> Matrix:
    return csc_array(np.ones((rows, columns)))


def _stack(blocks: list[list[Any]]) -> Matrix:
    return csc_array(block_array(blocks))


def _sparse(value: Any, name: str) -> Matrix:
    try:
        matrix = csc_array(value).astype(np.float64)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{name} must be a matrix of numbers: {error}") from error
    if matrix.ndim != 2:
        raise ShapeError(f"{name} must have 2 axes, got {matrix.ndim}")
    if not np.isfinite(matrix.data).all():
        raise ShapeError(f"{name} must be finite")
    matrix.sum_duplicates()
    matrix.sort_indices()
    for part in (matrix.data, matrix.indices, matrix.indptr):
        part.setflags(write=False)
    return matrix
