"""Merging leaves whose union is convex."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hzmp_planners._arrays import Bools, Ints
from hzmp_planners._ragged import counts_of, distinct, extents, owners_of, reduced, spans, starts_of
from hzmp_planners.constants import PLANE_TOL
from hzmp_planners.free_space.complexes import Complex, from_incidence
from hzmp_planners.free_space.planes import PlaneTable


def merge_convex_unions(
    whole: Complex, table: PlaneTable, scale: float, fresh: Bools | None = None
) -> tuple[Complex, Ints]:
    """Join pairs of leaves while a pair with a convex union is left.

    Two leaves on opposite sides of a plane have a convex union iff they meet in one whole facet
    and each satisfies the other's remaining half-spaces: then
    A u B = {half-spaces of A and of B without the common plane}.
    All pairs are tested at once, those with the widest doors are joined, and what they have become
    is tested again.

    Args:
        whole: leaves with disjoint interiors.
        table: the planes of their facets.
        scale: unit of the tolerances [m].
        fresh: only pairs with one of these are tested, shape (N,); all when not given.

    Returns:
        The merged leaves, and the leaf that each given one became part of.
    """
    tol = 2.0 * PLANE_TOL * scale
    number = np.arange(len(whole))
    if fresh is None:
        fresh = np.ones(len(whole), dtype=np.bool_)
    draws = np.random.default_rng(0).integers(0, 2**63, len(whole.vertices), dtype=np.uint64)
    while fresh.any():
        one, two, plane = _pairs(whole, draws, fresh)
        if not len(one):
            break
        keep = _convex(whole, one, two, plane, table, tol)
        one, two, plane = one[keep], two[keep], plane[keep]
        matched = _match(one, two, len(whole))
        one, two, plane = one[matched], two[matched], plane[matched]
        whole, renumber = _unite(whole, one, two, plane)
        number = renumber[number]
        fresh = np.arange(len(whole)) >= len(whole) - len(one)
    return whole, number


def _pairs(whole: Complex, draws: NDArray[np.uint64], fresh: Bools) -> tuple[Ints, Ints, Ints]:
    """Leaves that meet in one whole facet, at least one of them fresh; widest facets first."""
    sums = np.add.reduceat(draws[whole.rows], whole.facet_starts[:-1])
    # Facets with the same vertices on the same plane have the same key.
    plane = whole.facets >> 1
    keys = sums + plane.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    order = np.argsort(keys, kind="stable")
    twin = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    one, two = order[twin], order[twin + 1]
    leaf = whole.facet_owner
    good = (whole.facets[one] ^ whole.facets[two]) == 1
    good &= fresh[leaf[one]] | fresh[leaf[two]]
    one, two = one[good], two[good]
    widths = counts_of(whole.facet_starts)[one]
    corners = whole.vertices[whole.rows[spans(whole.facet_starts[one], widths)]]
    lists = starts_of(widths)
    extent = reduced(np.maximum, corners, lists) - reduced(np.minimum, corners, lists)
    order = np.argsort(-extent.sum(axis=1), kind="stable")
    one, two = one[order], two[order]
    return leaf[one], leaf[two], plane[one]


def _convex(
    whole: Complex, one: Ints, two: Ints, plane: Ints, table: PlaneTable, tol: float
) -> Bools:
    """Whether each of two leaves satisfies the other's half-spaces but that of their plane."""
    good = np.ones(len(one), dtype=np.bool_)
    starts = whole.members[1]
    for leaf, other in ((one, two), (two, one)):
        rows = np.flatnonzero(good)
        counts = counts_of(whole.leaf_starts)[leaf[rows]]
        facets = spans(whole.leaf_starts[leaf[rows]], counts)
        pair = rows.repeat(counts)
        outer = whole.facets[facets] >> 1 != plane[pair]
        facets, pair = facets[outer], pair[outer]
        normals, offsets = table.halfspaces(whole.facets[facets])
        _, highest = extents(whole.corners, starts, other[pair], normals)
        good[pair[highest > offsets + tol]] = False
    return good


def _match(one: Ints, two: Ints, count: int) -> Ints:
    """Pairs in the given order that have no leaf in common with an earlier one."""
    taken = [False] * count
    kept = []
    for row, (i, j) in enumerate(zip(one.tolist(), two.tolist(), strict=True)):
        if not (taken[i] or taken[j]):
            taken[i] = taken[j] = True
            kept.append(row)
    return np.array(kept, dtype=np.int64)


def _unite(whole: Complex, one: Ints, two: Ints, plane: Ints) -> tuple[Complex, Ints]:
    """Replace pairs of leaves by their unions, which come last."""
    rest = np.ones(len(whole), dtype=np.bool_)
    rest[one] = rest[two] = False
    kept = np.flatnonzero(rest)
    number = np.cumsum(rest) - 1
    number[one] = number[two] = len(kept) + np.arange(len(one))
    pairs = whole.take(np.concatenate([one, two]))
    facet = owners_of(pairs.facet_starts)
    union = np.concatenate([np.arange(len(one))] * 2)[pairs.facet_owner[facet]]
    code, vertex = pairs.facets[facet], pairs.rows
    outer = code >> 1 != plane[union]
    on_plane = distinct(union[~outer] * len(whole.vertices) + vertex[~outer])
    united = from_incidence(whole.vertices, union[outer], code[outer], vertex[outer], len(one))
    # A vertex of the common facet stays only where enough other facets meet.
    facet = owners_of(united.facet_starts)
    keys = united.facet_owner[facet] * len(whole.vertices) + united.rows
    ascending = np.sort(keys, kind="stable")
    meeting = np.searchsorted(ascending, keys, "right") - np.searchsorted(ascending, keys)
    place = np.minimum(np.searchsorted(on_plane, keys), len(on_plane) - 1)
    stays = (meeting >= whole.n) | (on_plane[place] != keys)
    if not stays.all():
        facet = facet[stays]
        united = from_incidence(
            whole.vertices,
            united.facet_owner[facet],
            united.facets[facet],
            united.rows[stays],
            len(one),
        )
    return whole.take(kept).joined(united), number
