"""Lists of different lengths kept end to end in one array, worked on all at once."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats, Ints


def starts_of(counts: Ints) -> Ints:
    """Where each list begins, and where the last one ends: shape (m + 1,)."""
    starts = np.zeros(len(counts) + 1, dtype=np.int64)
    counts.cumsum(out=starts[1:])
    return starts


def counts_of(starts: Ints) -> Ints:
    """How long each list is."""
    return starts[1:] - starts[:-1]


def owners_of(starts: Ints) -> Ints:
    """The list that each entry belongs to."""
    return np.arange(len(starts) - 1).repeat(counts_of(starts))


def spans(begins: Ints, counts: Ints) -> Ints:
    """begins[0], begins[0] + 1, ... (counts[0] numbers), then from begins[1], and so on."""
    ends = counts.cumsum()
    if not len(ends):
        return ends
    return np.asarray(np.arange(ends[-1]) + (begins - ends + counts).repeat(counts))


def runs_of(values: Ints) -> Ints:
    """Where each run of equal neighbours begins, and where the last one ends."""
    if not len(values):
        return np.zeros(1, dtype=np.int64)
    changes = (values[1:] != values[:-1]).nonzero()[0] + 1
    return np.concatenate([[0], changes, [len(values)]])


def distinct(keys: Ints) -> Ints:
    """The different numbers, ascending; np.unique hashes, which is slower for a few thousand.

    Keys come in ascending runs mostly, which the stable sort makes use of.
    """
    keys = np.sort(keys, kind="stable")
    return keys[runs_of(keys)[:-1]]


def distinct_points(points: Floats) -> tuple[Ints, Ints]:
    """The first of each set of points that agree to the last bit, and the set of each point."""
    order = np.lexsort(points.T)
    ordered = points.take(order, axis=0)
    begins = np.ones(len(order), dtype=np.bool_)
    begins[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    group = np.empty_like(order)
    group[order] = begins.cumsum() - 1
    return order[begins], group


def order_by(group: Ints, count: int) -> Ints:
    """The stable order of entries by their group, a number below `count`.

    numpy sorts numbers of 16 bits by radix, several times as fast as longer ones.
    """
    short = group.astype(np.uint16) if count <= 1 << 16 else group
    return short.argsort(kind="stable")


def order_within(keys: Floats, starts: Ints) -> Ints:
    """The order that sorts each list by its keys; np.lexsort takes five times as long."""
    order = keys.argsort(kind="stable")
    return order[order_by(owners_of(starts)[order], len(starts))]


def reduced(ufunc: np.ufunc, values: Floats, starts: Ints) -> Floats:
    """The ufunc over each list; every list must have an entry."""
    return np.asarray(ufunc.reduceat(values, starts[:-1])) if len(starts) > 1 else values[:0]


def extents(
    points: Floats, starts: Ints, chosen: Ints, directions: Floats
) -> tuple[Floats, Floats]:
    """Least and greatest a.x of lists of points along directions a, shape (k,) each.

    Args:
        points: of all lists, end to end, shape (p, n).
        starts: where each list begins, shape (m + 1,); every list has a point.
        chosen: which list is measured along each direction, shape (k,).
        directions: shape (k, n).
    """
    counts = counts_of(starts)[chosen]
    members = points.take(spans(starts[chosen], counts), axis=0)
    heights = np.einsum("ij,ij->i", members, directions.repeat(counts, axis=0))
    lists = starts_of(counts)
    return reduced(np.minimum, heights, lists), reduced(np.maximum, heights, lists)


def sorted_along(points: Floats, starts: Ints) -> Ints:
    """The order that sorts each list of points along the axis on which it is longest."""
    extent = reduced(np.maximum, points, starts) - reduced(np.minimum, points, starts)
    axis = extent.argmax(axis=1)[owners_of(starts)]
    return order_within(points[np.arange(len(points)), axis], starts)
