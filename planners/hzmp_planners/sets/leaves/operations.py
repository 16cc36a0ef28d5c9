"""Operations on hybrid zonotopes: their matrices, and the same operation on every leaf.

Results know their leaves when the operands do: what is known by construction is not searched for.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csc_array, csr_array, hstack

from hzmp_planners._arrays import Floats, Ints, frozen
from hzmp_planners.constants import SET_TOL
from hzmp_planners.sets.base import Set
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope
from hzmp_planners.sets.form.form import halfspace_rows
from hzmp_planners.sets.hybrid_zonotope import HybridZonotope, LeafSource
from hzmp_planners.sets.leaves.leaf_table import LeafTable, StackedPoints
from hzmp_planners.sets.polytope import Polytope
from hzmp_planners.sets.sparse import Matrix, stack, zeros

if TYPE_CHECKING:
    LeafMap = Callable[[ConstrainedZonotope], Set]


def linear_map(R: Floats, union: HybridZonotope) -> HybridZonotope:
    """R times the union."""
    source = _mapped_leaves(union, lambda leaf: R @ leaf, lambda points: points @ R.T)
    return HybridZonotope(
        csc_array(R @ union.Gc),
        csc_array(R @ union.Gb),
        R @ union.c,
        union.Ac,
        union.Ab,
        union.b,
        source,
    )


def shift(union: HybridZonotope, v: Floats) -> HybridZonotope:
    """The union moved by v."""
    source = _mapped_leaves(union, lambda leaf: leaf + v, lambda points: points + v)
    return HybridZonotope(union.Gc, union.Gb, union.c + v, union.Ac, union.Ab, union.b, source)


def cut(union: HybridZonotope, half_spaces: Polytope) -> HybridZonotope:
    """Points of the union inside half-spaces: a factor and a row a half-space that cuts."""
    H, f = half_spaces.A, half_spaces.b
    mapped_c, mapped_b = csr_array(H @ union.Gc), csr_array(H @ union.Gb)
    reach = np.asarray(abs(mapped_c).sum(axis=1) + abs(mapped_b).sum(axis=1), dtype=np.float64)
    rows, columns, offsets = halfspace_rows(H, f, f - H @ union.c, reach)
    return HybridZonotope(
        stack([[union.Gc, zeros(union.n, columns.shape[1])]]),
        union.Gb,
        union.c,
        stack([[union.Ac, zeros(union.nc, columns.shape[1])], [mapped_c[rows], columns]]),
        stack([[union.Ab], [mapped_b[rows]]]),
        np.concatenate([union.b, offsets]),
        _cut_leaves(union, half_spaces) if _knows(union) else None,
    )


def minkowski_sum(one: HybridZonotope, two: HybridZonotope) -> HybridZonotope:
    """Sums of a point of each."""
    source = _paired_leaves(one, two, _all_pairs, lambda a, b: a + b, may_be_empty=False)
    return HybridZonotope(
        stack([[one.Gc, two.Gc]]),
        stack([[one.Gb, two.Gb]]),
        one.c + two.c,
        _diagonal(one.Ac, two.Ac),
        _diagonal(one.Ab, two.Ab),
        np.concatenate([one.b, two.b]),
        source if _knows(one, two) else None,
    )


def cartesian_product(one: HybridZonotope, two: HybridZonotope) -> HybridZonotope:
    """Points (x, y) with x in one union and y in the other."""
    source = _paired_leaves(
        one, two, _all_pairs, lambda a, b: a.cartesian_product(b), may_be_empty=False
    )
    return HybridZonotope(
        _diagonal(one.Gc, two.Gc),
        _diagonal(one.Gb, two.Gb),
        np.concatenate([one.c, two.c]),
        _diagonal(one.Ac, two.Ac),
        _diagonal(one.Ab, two.Ab),
        np.concatenate([one.b, two.b]),
        source if _knows(one, two) else None,
    )


def intersection(one: HybridZonotope, two: HybridZonotope, R: Floats | None) -> HybridZonotope:
    """Points z of one union with R z in the other (Bird et al. 2023, proposition 7)."""
    Gc, Gb, c = (one.Gc, one.Gb, one.c) if R is None else (R @ one.Gc, R @ one.Gb, R @ one.c)
    choose = near_pairs if R is None else _all_pairs
    source = _paired_leaves(one, two, choose, lambda a, b: a.intersection(b, R), may_be_empty=True)
    return HybridZonotope(
        stack([[one.Gc, zeros(one.n, two.ng)]]),
        stack([[one.Gb, zeros(one.n, two.nb)]]),
        one.c,
        stack([[_diagonal(one.Ac, two.Ac)], [stack([[Gc, -two.Gc]])]]),
        stack([[_diagonal(one.Ab, two.Ab)], [stack([[Gb, -two.Gb]])]]),
        np.concatenate([one.b, two.b, two.c - c]),
        source if _knows(one, two) else None,
    )


def _knows(*unions: HybridZonotope) -> bool:
    return all(u._source is not None or "leaf_table" in u.__dict__ for u in unions)


def _mapped_leaves(
    union: HybridZonotope, act: LeafMap, move: Callable[[Floats], Floats]
) -> LeafSource | None:
    if not _knows(union):
        return None

    def source() -> LeafTable:
        table, stack = union.leaf_table, union.leaf_table.known_stack
        moved = None if stack is None else StackedPoints(frozen(move(stack.points)), stack.starts)
        return LeafTable(
            table.choices, lambda i: _zonotope(act(table.part(i))), moved, may_be_empty=False
        )

    return source


def _paired_leaves(
    one: HybridZonotope,
    two: HybridZonotope,
    choose: Callable[[HybridZonotope, HybridZonotope], Ints],
    act: Callable[[ConstrainedZonotope, ConstrainedZonotope], Set],
    *,
    may_be_empty: bool,
) -> LeafSource:
    def source() -> LeafTable:
        pairs = choose(one, two)
        tables = one.leaf_table, two.leaf_table
        choices = csr_array(
            hstack([table.choices[pairs[:, k]] for k, table in enumerate(tables)]) > 0
        )
        indices = pairs.tolist()

        def make(k: int) -> ConstrainedZonotope:
            i, j = indices[k]
            return _zonotope(act(tables[0].part(i), tables[1].part(j)))

        return LeafTable(choices, make, may_be_empty=may_be_empty)

    return source


def _all_pairs(one: HybridZonotope, two: HybridZonotope) -> Ints:
    counts = len(one.leaf_table), len(two.leaf_table)
    return np.argwhere(np.ones(counts, dtype=np.bool_)).astype(np.int64)


def near_pairs(one: HybridZonotope, two: HybridZonotope) -> Ints:
    """Pairs of leaves whose boxes meet, shape (k, 2)."""
    if not len(one.leaf_table) or not len(two.leaf_table):
        return np.zeros((0, 2), dtype=np.int64)
    (lo, hi), (low, high) = one.leaf_table.stack.boxes, two.leaf_table.stack.boxes
    room = SET_TOL * float(max(np.abs([lo, hi]).max(), np.abs([low, high]).max()))
    found = []
    for start in range(0, len(lo), 256):
        block = slice(start, start + 256)
        meet = np.ones((len(lo[block]), len(low)), dtype=np.bool_)
        for axis in range(one.n):
            meet &= lo[block, axis][:, None] <= high[:, axis] + room
            meet &= hi[block, axis][:, None] >= low[:, axis] - room
        found.append(np.argwhere(meet) + np.array([start, 0]))
    return np.concatenate(found).astype(np.int64)


def _cut_leaves(union: HybridZonotope, half_spaces: Polytope) -> LeafSource:
    """Leaves that the half-spaces miss, or that they hold, need no program."""

    def source() -> LeafTable:
        table = union.leaf_table
        if not len(table):
            return table
        stack = table.stack
        heights = stack.points @ half_spaces.A.T - half_spaces.b
        lo, hi = stack.boxes
        away = np.maximum(np.abs(lo), np.abs(hi))  # a point has no extent, but round-off
        room = SET_TOL * np.maximum(hi - lo, 1e-5 * away).max(axis=1)
        lowest = np.minimum.reduceat(heights, stack.starts, axis=0).max(axis=1)
        highest = np.maximum.reduceat(heights, stack.starts, axis=0).max(axis=1)
        near = np.flatnonzero(lowest <= room)
        indices, held = near.tolist(), (highest <= 0.0).tolist()

        def make(k: int) -> ConstrainedZonotope:
            leaf = table.part(indices[k])
            return leaf if held[indices[k]] else _zonotope(leaf & half_spaces)

        return LeafTable(csr_array(table.choices[near]), make, may_be_empty=True)

    return source


def _zonotope(body: Set) -> ConstrainedZonotope:
    assert isinstance(body, ConstrainedZonotope)
    return body


def _diagonal(one: Matrix, two: Matrix) -> Matrix:
    return stack(
        [[one, zeros(one.shape[0], two.shape[1])], [zeros(two.shape[0], one.shape[1]), two]]
    )
