"""The half-spaces of leaves, end to end: of a whole complex, or of what an update made of it."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats, Ints, frozen
from hzmp_planners._ragged import counts_of, starts_of
from hzmp_planners.constants import SPLINTER_TOL
from hzmp_planners.free_space.complexes import Complex
from hzmp_planners.free_space.planes import PlaneTable
from hzmp_planners.free_space.splinters import fences

Halfspaces = tuple[Floats, Floats, Ints]
"""A x <= b of all leaves one after the other: unit normals A (m, n), b (m,) [m], and where the
rows of each leaf start, shape (N+1,)."""


def leaf_halfspaces(whole: Complex, table: PlaneTable, scale: float) -> Halfspaces:
    """The facets of each leaf, then the fences of splinters.

    Args:
        whole: the leaves.
        table: the planes of their facets.
        scale: unit of the tolerances [m].
    """
    A, b = table.halfspaces(whole.facets)
    leaf, normals, offsets = fences(whole, table, SPLINTER_TOL * scale)
    starts = whole.leaf_starts
    if len(leaf):
        owner = np.concatenate([whole.facet_owner, leaf])
        order = owner.argsort(kind="stable")
        starts = starts_of(np.bincount(owner, minlength=len(whole)))
        A, b = np.concatenate([A, normals])[order], np.concatenate([b, offsets])[order]
    return frozen(A), frozen(b), frozen(starts)


def update_halfspaces(
    known: Halfspaces, number: Ints, whole: Complex, table: PlaneTable, scale: float
) -> Halfspaces:
    """The half-spaces after some leaves were cut: those of kept leaves are taken over.

    Args:
        known: of the leaves before.
        number: what each of them is called now, -1 for those that were cut; the others stay in
            order.
        whole: the leaves now, the kept ones first.
        table: the planes of their facets.
        scale: unit of the tolerances [m].
    """
    A, b, starts = known
    kept = number >= 0
    counts = counts_of(starts)
    rows = kept.repeat(counts).nonzero()[0]
    first = int(kept.sum())
    fresh = leaf_halfspaces(whole.take(np.arange(first, len(whole))), table, scale)
    return (
        frozen(np.concatenate([A.take(rows, axis=0), fresh[0]])),
        frozen(np.concatenate([b.take(rows), fresh[1]])),
        frozen(starts_of(np.concatenate([counts[kept], counts_of(fresh[2])]))),
    )
