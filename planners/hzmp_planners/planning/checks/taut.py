"""Why no taut string joins two pieces of edges: plain arithmetic, valid whatever is asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.planning.certificate import SOURCE, TARGET
from hzmp_planners.planning.checks.edge_list import Edge
from hzmp_planners.sets import Polytope

_FEW = 3_000_000  # numbers worked on at a time


def never_taut(edge: Edge, here: Floats, pieces: Floats, tiny: float) -> Bools:
    """Pieces to which no taut string leaves straight from the edge, shape (P,).

    A string that bends at an edge rises above one of its two facet planes and sinks below the
    other. So it does not go where all points are above both, or below both, or on the edge's line.

    Args:
        edge: one that the string bends at.
        here: the part of it where it does, shape (2, 3) [m].
        pieces: where it goes, shape (P, 2, 3) [m].
        tiny: heights and distances that are none [m].
    """
    away = pieces - edge.ends[0]
    along = edge.ends[1] - edge.ends[0]
    length = float(np.linalg.norm(along))
    if length == 0.0:
        return np.zeros(len(pieces), dtype=np.bool_)
    heights = (pieces - here[0]) @ edge.normals.T
    above = (heights > tiny).all(axis=(1, 2))
    below = (heights < -tiny).all(axis=(1, 2))
    axis = along / length
    aside = np.linalg.norm(away - (away @ axis)[:, :, None] * axis, axis=2)
    return np.asarray(above | below | (aside <= tiny).all(axis=1))


def too_long(pieces: Floats, limit: float) -> Bools:
    """Pairs of pieces on no way from start to goal shorter than the limit, shape (P, P).

    Each piece is in the ball around its middle. No way enters the start (0) or leaves the goal (1),
    and none is from a piece to itself.
    """
    middle = pieces.mean(axis=1)
    radius = np.linalg.norm(pieces[:, 1] - middle, axis=1)
    to = cdist(middle, middle)
    between = np.maximum(to - radius[:, None] - radius, 0.0)
    legs = (to[SOURCE] - radius)[:, None] + between + (to[TARGET] - radius)
    never = legs >= limit
    never[:, SOURCE] = never[TARGET] = True
    np.fill_diagonal(never, True)
    return np.asarray(never)


@dataclass(frozen=True, eq=False)
class Sight:
    """Obstacles that stop lines of sight."""

    obstacles: Sequence[Polytope]
    depth: float
    """A point this deep inside an obstacle is in its interior [m]."""

    def blocked(self, pieces: Floats, pairs: Ints) -> Bools:
        """Whether no point of one piece sees one of the other, shape (E,); False if not known.

        Either the whole pieces or all four pairs of their halves have an obstacle in between.

        Args:
            pieces: shape (P, 2, 3) [m].
            pairs: shape (E, 2).
        """
        stopped = self._between(pieces, pairs)
        middle = pieces.mean(axis=1)
        both = [np.stack([pieces[:, end], middle], axis=1) for end in (0, 1)]
        halves = np.stack(both, axis=1).reshape(-1, 2, 3)
        rest = np.flatnonzero(~stopped)
        for one in (0, 1):
            for two in (0, 1):
                rest = rest[self._between(halves, 2 * pairs[rest] + np.array([one, two]))]
        stopped[rest] = True
        return stopped

    def _between(self, pieces: Floats, pairs: Ints) -> Bools:
        """Whether some obstacle is between the pieces of each pair as wholes, shape (E,).

        At one share t of the way from x to z all points (1 - t) x + t z are inside it: for each
        facet the highest of them is made of the highest x and the highest z.
        """
        stopped = np.zeros(len(pairs), dtype=np.bool_)
        for block in self.obstacles:
            top = (pieces @ block.A.T - block.b).max(axis=1) + self.depth
            open_still = np.flatnonzero(~stopped)
            for first in range(0, len(open_still), _FEW // top.shape[1]):
                rows = open_still[first : first + _FEW // top.shape[1]]
                tail, head = top[pairs[rows, 0]], top[pairs[rows, 1]]
                # A facet that one end is outside of and that the other is not inside of: no.
                rows = rows[~((tail >= 0.0) & (head >= 0.0)).any(axis=1)]
                tail, head = top[pairs[rows, 0]], top[pairs[rows, 1]]
                with np.errstate(divide="ignore", invalid="ignore"):
                    share = tail / (tail - head)
                first_t = np.where(tail >= 0.0, share, 0.0).max(axis=1)
                last_t = np.where(head >= 0.0, share, 1.0).min(axis=1)
                t = ((first_t + last_t) / 2.0)[:, None]
                stopped[rows] = ((1.0 - t) * tail + t * head < 0.0).all(axis=1)
        return stopped
