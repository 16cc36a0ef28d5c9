"""Split the pieces of a trajectory so that each lies in one cell of a chain of cells."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ragged import counts_of, owners_of, reduced, spans, starts_of
from hzmp_planners.sets import Polytope
from hzmp_tracking.containment import round_off, worst_values
from hzmp_tracking.extrema import sign_changes
from hzmp_tracking.facets import Facets

_SAMPLED = np.linspace(0.0, 1.0, 4)  # of each piece, to see whether it leaves all cells
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
    bounds = np.array(windows)
    starts = starts_of(bounds[:, 1] - bounds[:, 0])
    pieces, allowed = owners_of(starts), spans(bounds[:, 0], counts_of(starts))
    values = worst_values(coefficients[pieces], durations[pieces], allowed, cells)
    best = [int(values[i:j].argmin()) for i, j in pairwise(starts.tolist())]
    kept = values[starts[:-1] + best] <= tol
    splits = _splits(coefficients, durations, windows, cells, tol, np.flatnonzero(~kept))
    parts: list[Floats] = []
    times: list[float] = []
    owners: list[int] = []
    for i, (piece, h) in enumerate(zip(coefficients, durations, strict=True)):
        if kept[i]:
            cuts, owner = np.array([0.0, h]), [windows[i][0] + best[i]]
        else:
            cuts, owner = next(splits)
        for start, end, cell in zip(cuts[:-1], cuts[1:], owner, strict=True):
            parts.append(shifted(piece, float(start)))
            times.append(float(end - start))
            owners.append(cell)
    return np.array(parts), np.array(times), np.array(owners, dtype=np.int64)


def outside(coefficients: Floats, durations: Floats, cells: Sequence[Polytope]) -> bool:
    """Whether a sample of the pieces lies in no cell: quick, and they cannot be covered then.

    Args:
        coefficients: pieces, shape (m, 4, n).
        durations: shape (m,) [s].
        cells: any of which may hold any piece.
    """
    powers = np.vander(_SAMPLED, 4, increasing=True)  # (samples, 4)
    units = coefficients * (durations[:, None] ** np.arange(4))[:, :, None]
    points = (powers @ units).reshape(-1, units.shape[2])
    A, b, starts = Facets.of(cells)
    excess = reduced(np.maximum, A @ points.T - b[:, None], starts)  # (cells, points)
    return bool(excess.min(axis=0).max() > round_off(coefficients, cells))


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


def _splits(
    coefficients: Floats,
    durations: Floats,
    windows: Sequence[tuple[int, int]],
    cells: Sequence[Polytope],
    tol: float,
    torn: Ints,
) -> Iterator[tuple[Floats, list[int]]]:
    """For each piece i in `torn`, cut times (including 0 and h) and the cells between them."""
    if not torn.size:
        return
    scalars = [_against(coefficients[i], cells[slice(*windows[i])]) for i in torn]
    sizes = starts_of(np.array([len(scalar) for scalar in scalars]))
    ends = durations[torn].repeat(counts_of(sizes))
    crossings, there = sign_changes(np.concatenate(scalars), ends, _BISECTIONS)
    for i, scalar, (first, last) in zip(torn, scalars, pairwise(sizes), strict=True):
        own = slice(first, last)
        found = crossings[own][there[own]]
        yield _split(scalar, float(durations[i]), found, range(*windows[i]), cells, tol)


def _against(piece: Floats, cells: Sequence[Polytope]) -> Floats:
    """The cubics a.x(s) - b of all facets of some cells, shape (facets, 4)."""
    A, b, _ = Facets.of(cells)
    scalar = (piece @ A.T).T.copy()
    scalar[:, 0] -= b
    return scalar


def _split(
    scalar: Floats, h: float, crossings: Floats, window: range, cells: Sequence[Polytope],
    tol: float,
) -> tuple[Floats, list[int]]:  # fmt: skip
    """Cut times (including 0 and h) and the cell of each stretch between them.

    Args:
        scalar: the piece against all facets of the cells in the window, shape (facets, 4).
        h: duration of the piece [s].
        crossings: times at which it crosses a facet, unordered [s].
        window: indices of the cells that it may lie in.
        cells: the chain.
        tol: what counts as inside [m].
    """
    cuts = np.concatenate([[0.0], np.sort(crossings), [h]])
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
