"""Which pieces of edges may see each other: a line of sight between them may be free."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.planning.bends.blockers import Blockers, below

_FEW_ENTRIES = 2_000_000  # of heights at a time: they stay small beside the machine's memory


def hidden(
    pieces: Floats, pairs: Ints, blockers: Blockers, margin: float, halvings: int = 1
) -> Bools:
    """Whether every line of sight of a pair is blocked, shape (E,); False where that is not known.

    All lines of sight from the points of one piece to those of another are blocked by a convex
    body if at one parameter t the points (1 - t) x + t z, x and z anywhere on the pieces, all lie
    inside it. For a facet plane the greatest height at t is (1 - t) max h(x) + t max h(z): one
    comparison, whatever the pieces' shapes. Where no single body does it the pieces are halved.

    Args:
        pieces: convex pieces by their corners, shape (P, k, n) [m].
        pairs: shape (E, 2).
        blockers: what stops a line of sight.
        margin: how deep inside a body counts [m].
        halvings: how often pieces are halved to decide; needs segments (k = 2).
    """
    blocked = np.zeros(len(pairs), dtype=np.bool_)
    if not len(blockers):
        return blocked
    heights = blockers.heights(pieces) + margin
    lows, highs = pieces.min(axis=1), pieces.max(axis=1)
    step = max(1, _FEW_ENTRIES // (blockers.b.size * pieces.shape[1]))
    for first in range(0, len(pairs), step):
        tail, head = pairs[first : first + step].T
        low, high = np.minimum(lows[tail], lows[head]), np.maximum(highs[tail], highs[head])
        near = (blockers.lows < high[:, None]) & (blockers.highs > low[:, None])
        pair, body = near.all(axis=2).nonzero()
        blocked[first : first + step] = _all_blocked(
            pair, heights[tail[pair], :, body], heights[head[pair], :, body], len(tail), halvings
        )
    return blocked


def _all_blocked(pair: Ints, tail: Floats, head: Floats, count: int, halvings: int) -> Bools:
    """Pairs whose lines of sight are all blocked, from heights (c, k, f) above bodies nearby."""
    blocked = np.zeros(count, dtype=np.bool_)
    enters, leaves = below(tail.max(axis=1), head.max(axis=1))
    blocked[pair[enters < leaves]] = True
    if not halvings:
        return blocked
    rows = np.flatnonzero(~blocked[pair])
    undecided = np.zeros(count, dtype=np.bool_)
    undecided[pair[rows]] = True
    for x in (0, 1):
        for z in (0, 1):
            parts = pair[rows], _half(tail[rows], x), _half(head[rows], z)
            undecided &= _all_blocked(*parts, count, halvings - 1)
            rows = rows[undecided[pair[rows]]]
    return blocked | undecided


def _half(heights: Floats, side: int) -> Floats:
    """Heights at the ends of the first or second half of segments, shape (c, 2, f)."""
    middle = heights.mean(axis=1)
    ends = (heights[:, 0], middle) if side == 0 else (middle, heights[:, 1])
    return np.stack(ends, axis=1)
