"""The leaves of a hybrid zonotope: their binaries, their sets, and what is looked up in bulk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from hzmp_planners._arrays import Floats, Ints, frozen
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope


@dataclass(frozen=True, eq=False)
class StackedPoints:
    """Points of all leaves, one leaf after the other."""

    points: Floats
    """Shape (K, n) [m]."""
    starts: Ints
    """Where each leaf's points begin, shape (N,); no leaf is without points."""

    @cached_property
    def boxes(self) -> tuple[Floats, Floats]:
        """Smallest axis-aligned box of each leaf: (lo, hi), each (N, n)."""
        if not len(self.starts):
            return self.points[:0], self.points[:0]
        lo = np.minimum.reduceat(self.points, self.starts, axis=0)
        return frozen(lo), frozen(np.maximum.reduceat(self.points, self.starts, axis=0))

    @cached_property
    def owners(self) -> Ints:
        """Leaf of each point, shape (K,)."""
        counts = np.diff(np.append(self.starts, len(self.points)))
        return frozen(np.repeat(np.arange(len(self.starts)), counts))


class LeafTable:
    """Leaves in the order of their index.

    Sets are made when they are first asked for: a union of ten thousand cells can be classified
    and looked up by its stacked vertices alone.
    """

    def __init__(
        self,
        choices: csr_array[np.bool_],
        make: Callable[[int], ConstrainedZonotope],
        stack: StackedPoints | None = None,
        *,
        may_be_empty: bool,
    ) -> None:
        self.choices = choices
        """Row i marks the binaries that are +1 in leaf i, shape (N, nb)."""
        self.may_be_empty = may_be_empty
        """Whether these are candidates, of which some may be empty."""
        self._make = make
        self.known_stack = stack
        """Points of the leaves if they are known without making the leaves."""
        self._made: dict[int, ConstrainedZonotope] = {}

    def __len__(self) -> int:
        return int(self.choices.shape[0])

    @property
    def is_empty(self) -> bool:
        """Whether no leaf has a point."""
        if not self.may_be_empty:
            return len(self) == 0
        return all(self.part(i).is_empty() for i in range(len(self)))

    def without_empty(self) -> LeafTable:
        """The leaves that have a point."""
        if not self.may_be_empty:
            return self
        kept = [i for i in range(len(self)) if not self.part(i).is_empty()]
        choices = csr_array(self.choices[kept])
        return LeafTable(choices, [self.part(i) for i in kept].__getitem__, may_be_empty=False)

    @cached_property
    def parts(self) -> tuple[ConstrainedZonotope, ...]:
        """The leaves as compact constrained zonotopes."""
        return tuple(self.part(i) for i in range(len(self)))

    def part(self, i: int) -> ConstrainedZonotope:
        """Leaf i as a compact constrained zonotope."""
        if i not in self._made:
            self._made[i] = self._make(i)
        return self._made[i]

    @cached_property
    def stack(self) -> StackedPoints:
        """Points whose hulls the leaves are."""
        if self.known_stack is not None:
            return self.known_stack
        points = [part.hull_points() for part in self.parts]
        n = self.parts[0].n if points else 0
        starts = np.cumsum([0, *map(len, points)])[:-1].astype(np.int64)
        return StackedPoints(frozen(np.concatenate([np.zeros((0, n)), *points])), frozen(starts))
