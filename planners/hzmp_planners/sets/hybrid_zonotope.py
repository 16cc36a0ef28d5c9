"""Hybrid zonotopes (Bird, Pangborn, Jain and Koeln 2023): unions of convex leaves as one set."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, csr_array, hstack

from hzmp_planners._arrays import Bools, Floats, as_count, as_floats, as_point, as_points, frozen
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.base import Set
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope
from hzmp_planners.sets.convex_set import ConvexSet
from hzmp_planners.sets.leaves import queries, unions
from hzmp_planners.sets.leaves.leaf_search import admissible_choices, leaf_of_choice
from hzmp_planners.sets.leaves.leaf_table import LeafTable
from hzmp_planners.sets.polytope import Polytope
from hzmp_planners.sets.sparse import Matrix, MatrixLike, as_sparse

LeafSource = Callable[[], LeafTable]


@dataclass(frozen=True, eq=False, init=False)
class HybridZonotope(Set):
    r"""Union of constrained zonotopes, one for each admissible choice of the binary factors.

    .. math::

        \mathcal{Z} = \{ G_c \xi_c + G_b \xi_b + c : \|\xi_c\|_\infty \le 1,\
        \xi_b \in \{-1, 1\}^{n_b},\ A_c \xi_c + A_b \xi_b = b \}

    Matrices may be dense or scipy sparse; they are kept as compressed sparse columns. A set that
    was built from known leaves, and every set computed from it, knows its leaves by construction;
    one that was given by its matrices alone searches for them, exactly, when they are first needed.
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
    _source: LeafSource | None = field(repr=False)

    def __init__(
        self,
        Gc: MatrixLike,
        Gb: MatrixLike,
        c: ArrayLike,
        Ac: MatrixLike,
        Ab: MatrixLike,
        b: ArrayLike,
        _source: LeafSource | None = None,
    ) -> None:
        centre, offsets = as_floats(c, "c", 1), as_floats(b, "b", 1)
        if centre.size == 0:
            raise ShapeError("c must have at least one coordinate: a set needs a space")
        blocks = {"Gc": Gc, "Gb": Gb, "Ac": Ac, "Ab": Ab}
        matrices = {name: as_sparse(block, name) for name, block in blocks.items()}
        n, nc = centre.size, offsets.size
        ng, nb = matrices["Gc"].shape[1], matrices["Gb"].shape[1]
        for name, shape in zip(blocks, ((n, ng), (n, nb), (nc, ng), (nc, nb)), strict=True):
            if matrices[name].shape != shape:
                raise ShapeError(f"{name} must have shape {shape}, got {matrices[name].shape}")
        vars(self).update(matrices, c=centre, b=offsets, _source=_source)

    @classmethod
    def from_vertices(cls, V: ArrayLike, M: MatrixLike) -> HybridZonotope:
        r"""Union of the convex hulls that the columns of M select from the rows of V.

        With 0/1 factors: :math:`x = V^T\lambda,\ 1^T\lambda = 1,\ 1^T\beta = 1,\
        \lambda + s = M\beta` (Siefert et al. 2023), so :math:`\beta = e_i` gives leaf i. Here in
        factors of [-1, 1] and {-1, 1}: ng = 2 nv, nb = N, nc = nv + 2. The slack of a vertex that
        no leaf uses twice needs no degree: (M beta)_j <= 1 whenever 1'beta = 1.

        Args:
            V: vertices, shape (nv, n) [m].
            M: incidence, dense or sparse bool, shape (nv, N).

        Raises:
            ShapeError: shapes do not fit, M is not binary, or a column of M is empty.
        """
        return cls(*unions.of_vertices(as_floats(V, "V", 2), as_sparse(M, "M")))

    @classmethod
    def from_polytopes(cls, polytopes: Iterable[ConvexSet]) -> HybridZonotope:
        """Union of bounded polytopal sets in the V-rep form of `from_vertices`.

        Vertices that coincide (to 1e-11 of the union's size) are one. Empty sets are left out.

        Raises:
            ShapeError: no set at all, different dimensions, or a curved or unbounded set.
        """
        V, M = unions.merged_vertices(tuple(polytopes))
        return cls.from_vertices(V, M)

    @classmethod
    def from_union(cls, sets: Sequence[Set]) -> HybridZonotope:
        """Union of polytopal and hybrid sets of any kind.

        Sets whose vertices are known are united in V-rep form. Otherwise each set keeps its own
        factors, switched on by its own binary (for zonotopic sets, Glunt et al. 2025 call it the
        disaggregated form): ng = sum (ng_i + 1), nb = sum nb_i + N, nc = 1 + sum (nc_i + 1).

        Raises:
            ShapeError: no set at all, different dimensions, or a curved or unbounded set.
        """
        bodies = tuple(sets)
        if all(isinstance(s, Polytope) or s._points is not None for s in bodies):
            return cls.from_polytopes([s for s in bodies if isinstance(s, ConvexSet)])
        return cls(*unions.disaggregated([cls.from_convex(s) for s in bodies]))

    @classmethod
    def from_convex(cls, body: Set) -> HybridZonotope:
        """A polytopal set as a hybrid zonotope without binaries.

        Raises:
            ShapeError: the set is curved or unbounded.
        """
        if isinstance(body, HybridZonotope):
            return body
        if not isinstance(body, ConvexSet) or not body.form.is_polytopal:
            raise ShapeError(
                f"a hybrid zonotope cannot hold a curved {type(body).__name__}: enclose it first"
            )
        form = body.form
        none = csc_array((form.c.size, 0)), csc_array((form.b.size, 0))
        leaf = ConstrainedZonotope._of_form(form)
        if body._points is not None:
            leaf._remember_points(body._points)
        choices = csr_array((1, 0), dtype=np.bool_)
        return cls(
            csc_array(form.G), none[0], form.c, csc_array(form.A), none[1], form.b,
            lambda: LeafTable(choices, lambda _: leaf, may_be_empty=True),
        )  # fmt: skip

    @classmethod
    def empty(cls, n: int) -> HybridZonotope:
        """The empty set of R^n: the V-rep form without vertices and leaves."""
        return cls.from_vertices(np.zeros((0, n)), csc_array((0, 0)))

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

    @property
    def leaf_count(self) -> int:
        """Number of leaves."""
        return len(self.leaf_table)

    def leaves(self, time_limit: float = math.inf) -> tuple[ConstrainedZonotope, ...]:
        """The convex leaves as compact constrained zonotopes, in the order of `leaf_index`.

        Known by construction, or found by an exact search (see `leaf_search`).

        Args:
            time_limit: of the search [s].

        Raises:
            LimitError: the time was up before the search was complete.
            SolverError: no verdict that holds.
        """
        if self._source is None and "leaf_table" not in self.__dict__:
            vars(self)["leaf_table"] = self._searched(time_limit)
        return self.leaf_table.parts

    @cached_property
    def leaf_table(self) -> LeafTable:
        """Leaves with their binaries and points."""
        known = self._source is not None
        return self._candidates.without_empty() if known else self._searched(math.inf)

    @cached_property
    def _candidates(self) -> LeafTable:
        assert self._source is not None
        return self._source()

    def _searched(self, time_limit: float) -> LeafTable:
        found = list(admissible_choices(self, time_limit))
        choices = csr_array(np.array(found).reshape(len(found), self.nb) > 0.0)
        return LeafTable(choices, lambda i: leaf_of_choice(self, found[i]), may_be_empty=False)

    @cached_property
    def binaries(self) -> Floats:
        """Binary factors of each leaf, -1 or 1, shape (N, nb)."""
        return frozen(np.where(self.leaf_table.choices.toarray(), 1.0, -1.0))

    def leaf_index(self, xi_b: ArrayLike) -> int:
        """Index of the leaf with these binary factors (nb,): ID of Remark 3.1 of the HZ-MP paper.

        Raises:
            ShapeError: entries other than -1 and 1, or no leaf has these factors.
        """
        choice = as_point(xi_b, "xi_b", self.nb)
        if not np.isin(choice, (-1.0, 1.0)).all():
            raise ShapeError(f"xi_b must hold only -1 and 1, got {choice}")
        chosen = csr_array((choice > 0.0)[None])
        agree = self.leaf_table.choices.astype(np.int64) @ chosen.astype(np.int64).T
        sizes = self.leaf_table.choices.sum(axis=1)
        same = (agree.toarray().ravel() == chosen.sum()) & (sizes == chosen.sum())
        if not same.any():
            raise ShapeError(f"no leaf has the binary factors {choice}")
        return int(same.argmax())

    def adjacency_matrix(self, least_dimension: int = 0) -> csr_array[np.bool_]:
        """Which leaves meet, symmetric, shape (N, N): remark 3.1 of the HZ-MP paper.

        Args:
            least_dimension: only count contacts of this dimension or more; n - 1 for shared faces.

        Raises:
            SolverError: no verdict that holds.
        """
        from hzmp_planners.sets.leaf_pairs import adjacency_matrix

        return adjacency_matrix(self, least_dimension)

    def convex_parts(self) -> tuple[ConstrainedZonotope, ...]:
        """The leaves."""
        return self.leaves()

    def is_empty(self) -> bool:
        """True when no factors satisfy the constraints.

        Raises:
            SolverError: no verdict that holds.
        """
        if "leaf_table" in self.__dict__:
            return len(self.leaf_table) == 0
        if self._source is None:
            return next(admissible_choices(self), None) is None
        return self._candidates.is_empty

    def contains(self, X: ArrayLike, tol: float | None = None) -> Bools:
        """Which of the points (k, n) lie in some leaf; shape (k,).

        Args:
            X: points [m]; one point may be given as (n,).
            tol: as for each leaf; 1e-9 of the leaf's size unless given.
        """
        return queries.contains(self, as_points(X, "X", self.n), tol)

    def contains_set(self, inner: Set) -> bool:
        """Whether every point of `inner` is in some leaf: what the leaves leave of it is empty.

        Raises:
            ShapeError: another dimension, or a curved inner set.
            SolverError: no verdict that holds.
        """
        self._check_dimension(inner)
        return all(
            part.is_empty() or not queries.remainder(part.to_polytope(), self)
            for part in inner.convex_parts()
        )

    def _mapped(self, R: Floats) -> HybridZonotope:
        from hzmp_planners.sets.leaves.operations import linear_map

        return linear_map(R, self)

    def _shifted(self, v: Floats) -> HybridZonotope:
        from hzmp_planners.sets.leaves.operations import shift

        return shift(self, v)

    def _farthest(self, d: Floats) -> Floats | None:
        if not len(self.leaf_table):
            return None
        points = self.leaf_table.stack.points
        return np.asarray(points[int((points @ d).argmax())])

    def project(self, x: ArrayLike) -> Floats:
        """A point of the set nearest to x (n,), shape (n,).

        Leaves are tried in the order of their boxes' distances, until none can be nearer.

        Raises:
            ShapeError: the set is empty.
            SolverError: no verdict that holds.
        """
        return queries.nearest_point(self, as_point(x, "x", self.n))

    def distance(self, other: Set | ArrayLike) -> float:
        """Least Euclidean distance to a set or a point [m]; inf when one of them is empty.

        Raises:
            SolverError: no verdict that holds.
        """
        if isinstance(other, Set):
            return queries.distance(self, other)
        point = as_point(other, "the point", self.n)
        return math.inf if self.is_empty() else math.dist(self.project(point), point)

    def vertices(self) -> Floats:
        """Distinct vertices of all leaves, shape (k, n) [m]; (0, n) when empty."""
        corners = [leaf.vertices() for leaf in self.leaves()]
        return np.unique(np.concatenate([np.zeros((0, self.n)), *corners]), axis=0)

    def volume(self) -> float:
        """Volume (area in 2-D) of the union [m^n]: what leaves share is counted once."""
        return math.fsum(piece.volume() for piece in queries.disjoint_pieces(self))

    def sample(self, k: int, rng: np.random.Generator) -> Floats:
        """K points, uniform in the union of the leaves of largest dimension, shape (k, n) [m].

        A leaf is drawn by its volume, a point in it uniformly, and kept with probability one over
        the number of leaves that hold it.

        Raises:
            ShapeError: the set is empty.
        """
        return queries.sample(self, as_count(k, "k"), rng)

    def complement(self, lo: ArrayLike, hi: ArrayLike) -> HybridZonotope:
        """Closure of the box (lo, hi) minus this set, as convex pieces in V-rep form.

        Raises:
            ShapeError: lo and hi are not the corners of a box of this dimension.
        """
        return HybridZonotope.from_convex(Polytope.from_box(lo, hi)).difference(self)

    def difference(self, other: Set) -> HybridZonotope:
        """Closure of the points of this set that are not in the other, as convex pieces.

        Raises:
            ShapeError: another dimension, or a curved set.
        """
        self._check_dimension(other)
        union = HybridZonotope.from_union([other])
        pieces = [
            piece
            for leaf in self.leaves()
            for piece in queries.remainder(leaf.to_polytope(), union)
        ]
        return HybridZonotope.from_polytopes(pieces) if pieces else HybridZonotope.empty(self.n)

    def convex_relaxation(self) -> ConstrainedZonotope:
        """The set with its binary factors in [-1, 1]: it contains the convex hull.

        For the V-rep form of `from_vertices` it is the convex hull (the form is sharp).
        """
        G = hstack([self.Gc, self.Gb]).toarray()
        return ConstrainedZonotope(G, self.c, hstack([self.Ac, self.Ab]).toarray(), self.b)

    def remove_redundancy(self) -> HybridZonotope:
        """The same union with matrices rebuilt from its leaves' vertices.

        Binaries that are fixed, empty leaves, and leaves inside another leaf are gone.
        """
        kept = queries.outermost(self)
        return HybridZonotope.from_polytopes(kept) if kept else HybridZonotope.empty(self.n)

    def _fields(self) -> dict[str, Any]:
        fields: dict[str, Any] = {"c": self.c.tolist(), "b": self.b.tolist()}
        for name in ("Gc", "Gb", "Ac", "Ab"):
            matrix = getattr(self, name).tocoo()
            fields[name] = {
                "shape": list(matrix.shape),
                "rows": matrix.coords[0].tolist(),
                "columns": matrix.coords[1].tolist(),
                "values": matrix.data.tolist(),
            }
        if self._source is not None or "leaf_table" in self.__dict__:
            choices = self.leaf_table.choices
            spans = zip(choices.indptr[:-1].tolist(), choices.indptr[1:].tolist(), strict=True)
            fields["leaves"] = {
                "chosen": [choices.indices[start:stop].tolist() for start, stop in spans],
                "parts": [part._fields() for part in self.leaf_table.parts],
            }
        return fields
