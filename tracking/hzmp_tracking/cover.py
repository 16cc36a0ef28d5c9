"""Split the pieces of a trajectory so that each lies in one cell of a chain of cells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.sets import Polytope
from hzmp_tracking.containment import facet_values, round_off
from hzmp_tracking.extrema import sign_changes

_BISECTIONS = 60  # halves an interval of length 1 down to one rounding


def cover(
    coefficients: Floats,
    durations: Floats,
    windows: Sequence[tuple[int, int]],
    cells: Sequence[Polytope],
) -> tuple[Floats, Floats, Ints]:
    """Assign each piece to one cell of its window, splitting it where it changes cells.

    A piece that lies in one cell of its window as a whole is kept. Others are cut at their
    crossings of facets and covered from left to right by the cell that holds longest, which needs
    the fewest cuts. A stretch that no cell holds goes to the cell it violates least, so that the
    containment of the result tells by how much.

    Args:
        coefficients: pieces, shape (m, 4, n).
        durations: shape (m,) [s].
        windows: for each piece, the range (first, last + 1) of cells it may lie in.
        cells: the chain.

    Returns:
        Coefficients (m', 4, n), durations (m',) and cell indices (m',) of the split pieces.
    """
    tol = 0.5 * round_off(coefficients, cells)
    table = _worst_values(coefficients, durations, windows, cells)
    parts: list[Floats] = []
    times: list[float] = []
    owners: list[int] = []
    for piece, h, window, row in zip(coefficients, durations, windows, table, strict=True):
        best = int(np.argmin(row))
        if row[best] <= tol:
            cuts, owner = np.array([0.0, h]), [window[0] + best]
        else:
            cuts, owner = _split(piece, float(h), range(*window), cells, tol)
        for start, end, cell in zip(cuts[:-1], cuts[1:], owner, strict=True):
            parts.append(shifted(piece, float(start)))
            times.append(float(end - start))
            owners.append(cell)
    return np.array(parts), np.array(times), np.array(owners, dtype=np.int64)


def shifted(piece: Floats, s: float) -> Floats:
    """The cubic x(s + t) as a polynomial in t, shape (4, n)."""
    if s == 0.0:
        return piece
    c0, c1, c2, c3 = piece
    return np.array(
        [
            c0 + s * (c1 + s * (c2 + s * c3)),
            c1 + s * (2.0 * c2 + 3.0 * s * c3),
            c2 + 3.0 * s * c3,
            c3,
        ]
    )


def _worst_values(
    coefficients: Floats,
    durations: Floats,
    windows: Sequence[tuple[int, int]],
    cells: Sequence[Polytope],
) -> list[Floats]:
    """For each piece, its worst facet value in each cell of its window."""
    table = [np.full(last - first, np.inf) for first, last in windows]
    bounds = np.array(windows)
    for index in range(int(bounds.min()), int(bounds.max())):
        near = np.nonzero((bounds[:, 0] <= index) & (index < bounds[:, 1]))[0]
        if near.size:
            values = facet_values(coefficients[near], durations[near], cells[index]).max(axis=1)
            for i, value in zip(near, values, strict=True):
                table[int(i)][index - bounds[i, 0]] = value
    return table


def _split(
    piece: Floats, h: float, window: range, cells: Sequence[Polytope], tol: float
) -> tuple[Floats, list[int]]:
    """Cut times (including 0 and h) and the cell of each stretch between them."""
    A = np.vstack([cells[k].A for k in window])
    b = np.concatenate([cells[k].b for k in window])
    scalar = (piece @ A.T).T.copy()
    scalar[:, 0] -= b
    crossings, there = sign_changes(scalar, h, _BISECTIONS)
    cuts = np.concatenate([[0.0], np.sort(crossings[there]), [h]])
    cuts = cuts[np.concatenate([[True], np.diff(cuts) > 1e-12 * h])]
    cuts[-1] = h
    middle = 0.5 * (cuts[:-1] + cuts[1:])
    powers = np.vander(middle, 4, increasing=True)
    values = powers @ scalar.T  # (stretches, all facets)
    ends = np.cumsum([cells[k].b.size for k in window])[:-1]
    worst = np.stack([part.max(axis=1) for part in np.split(values, ends, axis=1)], axis=1)
    inside = worst <= tol
    times: list[float] = [0.0]
    owners: list[int] = []
    i = 0
    while i < middle.size:
        runs = [int(np.argmin(np.append(column, False))) for column in inside[i:].T]
        longest = max(runs)
        chosen = runs.index(longest) if longest else int(np.argmin(worst[i]))
        if owners:
            # Change over in the middle of the time that both cells hold: off their facets.
            entry = i
            while cuts[entry] > times[-1] and inside[entry - 1, chosen]:
                entry -= 1
            times.append(0.5 * (max(float(cuts[entry]), times[-1]) + float(cuts[i])))
        owners.append(window[chosen])
        i += max(longest, 1)
    return np.array([*times, h]), owners
