"""Which pieces of edges may see each other: a line of sight between them may be free."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.planning.bends.blockers import Blockers, below


@dataclass(frozen=True, eq=False)
class Sight:
    """Convex pieces, and what stops lines of sight between them."""

    pieces: Floats
    """By their corners, shape (P, k, n) [m]."""
    blockers: Blockers
    margin: float
    """How deep inside a body counts [m]."""

    def hidden(self, pairs: Ints, halvings: int = 1) -> Bools:
        """Whether every line of sight of a pair is blocked, shape (E,); False where not known.

        All lines of sight from the points of one piece to those of another are blocked by a convex
        body if at one parameter t the points (1 - t) x + t z, x and z anywhere on the pieces, all
        lie inside it. For a facet plane the greatest height at t is (1 - t) max h(x) + t max h(z):
        one comparison, whatever the pieces' shapes. Where no single body does it the pieces are
        halved.

        Args:
            pairs: shape (E, 2).
            halvings: how often pieces are halved to decide; needs segments (k = 2).
        """
        if not len(self.blockers):
            return np.zeros(len(pairs), dtype=np.bool_)
        tail, head = pairs.T
        lows, highs = self._bounds
        low, high = np.minimum(lows[tail], lows[head]), np.maximum(highs[tail], highs[head])
        near = (self.blockers.lows < high[:, None]) & (self.blockers.highs > low[:, None])
        pair, body = np.nonzero(near.all(axis=2))
        heights = self._heights
        ends = heights[tail[pair], :, body], heights[head[pair], :, body]
        return _all_blocked(pair, *ends, len(tail), halvings)

    @cached_property
    def _bounds(self) -> tuple[Floats, Floats]:
        return self.pieces.min(axis=1), self.pieces.max(axis=1)

    @cached_property
    def _heights(self) -> Floats:
        """Of the corners above the facets of the blockers, shape (P, k, m, f) [m]."""
        return self.blockers.heights(self.pieces) + self.margin


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
