"""The facets of a chain of cells, end to end in one array."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._ragged import counts_of, owners_of, spans, starts_of
from hzmp_planners.sets import Polytope

_NORMAL_TOL = 1e-9  # opposite unit normals, per component
_PLANE_TOL = 1e-9  # distance of two planes that are one, relative to the coordinates


class Facets(NamedTuple):
    """Half-spaces a.x <= b of all cells."""

    A: Floats
    """Outward unit normals, shape (f, n)."""
    b: Floats
    """Offsets [m], shape (f,)."""
    starts: Ints
    """Where the facets of each cell begin, and where the last ones end, shape (K + 1,)."""

    @classmethod
    def of(cls, cells: Sequence[Polytope]) -> Self:
        """Those of a chain."""
        starts = starts_of(np.array([cell.b.size for cell in cells]))
        return cls(
            np.concatenate([cell.A for cell in cells]),
            np.concatenate([cell.b for cell in cells]),
            starts,
        )

    def facing(self, owners: Ints) -> tuple[Ints, Ints]:
        """All facets of one cell after another, and how many each has.

        Args:
            owners: cells, shape (r,); the same one may come again.
        """
        counts = counts_of(self.starts)[owners]
        return spans(self.starts[owners], counts), counts

    def shared(self) -> Bools:
        """Whether a facet is on one plane with a facet of the next or the last cell, shape (f,)."""
        found = np.zeros(self.b.size, dtype=np.bool_)
        before = np.arange(self.starts[-2])  # all facets but those of the last cell
        there, counts = self.facing(owners_of(self.starts)[before] + 1)
        here = before.repeat(counts)
        same = opposite(self.A[here], self.b[here], self.A[there], self.b[there])
        found[here[same]] = found[there[same]] = True
        return found


def opposite(A: Floats, b: Floats, C: Floats, d: Floats) -> Bools:
    """Whether half-spaces a.x <= b and c.x <= d are on two sides of one plane; shapes broadcast."""
    scale = max(1.0, float(np.abs(b).max(initial=0.0)), float(np.abs(d).max(initial=0.0)))
    close = np.abs(b + d) < _PLANE_TOL * scale
    return np.asarray(close & (np.abs(A + C).max(axis=-1) < _NORMAL_TOL))
