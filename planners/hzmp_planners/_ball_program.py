"""A convex program over balls, and the lower bound that any multipliers give it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array

from hzmp_planners._arrays import Floats

Matrix = csc_array[np.float64]


class Block(NamedTuple):
    """Consecutive variables that share one bounded convex set."""

    size: int
    p: float
    r"""The norm: inf for a box, 2 for a ball, any p >= 1."""
    radius: float = 1.0
    """:math:`\\|v\\|_p \\le` radius; of an epigraph, the largest value of its first variable."""
    epigraph: bool = False
    r"""If True the block is (t, w) with :math:`\\|w\\|_p \\le t \\le` radius."""


@dataclass(frozen=True, eq=False)
class ConvexProgram:
    """Minimise q.v subject to E v = e and v in the product of the blocks.

    The caller scales lengths so that the numbers are of order one: tolerances are absolute here.
    """

    q: Floats
    """Shape (nx,)."""
    E: Floats | Matrix
    """Shape (m, nx)."""
    e: Floats
    """Shape (m,)."""
    blocks: tuple[Block, ...]

    @property
    def is_linear(self) -> bool:
        return all(block.p == math.inf or block.size == 1 for block in self.blocks)

    def clip(self, v: Floats) -> Floats:
        """Nearest point of K along rays (componentwise in boxes), shape (nx,)."""
        clipped = v.copy()
        for block, part in _parts(self.blocks, clipped):
            if block.epigraph:
                part[0] = min(max(float(part[0]), norm(part[1:], block.p)), block.radius)
                reach, inner = float(part[0]), part[1:]
            else:
                reach, inner = block.radius, part
            if block.p == math.inf:
                np.clip(inner, -reach, reach, out=inner)
            elif (length := norm(inner, block.p)) > reach:
                inner *= reach / length
        return clipped

    def lower_bound(self, y: Floats) -> float:
        """L(y), a lower bound of the optimum for every y of shape (m,)."""
        reduced = self.q - self.E.T @ y
        total = float(self.e @ y)
        for block, part in _parts(self.blocks, reduced):
            if block.epigraph:
                slope = float(part[0]) - norm(part[1:], conjugate(block.p))
                total += min(0.0, slope) * block.radius
            else:
                total -= norm(part, conjugate(block.p)) * block.radius
        return total

    def residual(self, v: Floats) -> float:
        """Largest violation of E v = e, relative to e where that is above 1."""
        size = max(1.0, float(np.abs(self.e).max(initial=0.0)))
        return float(np.abs(self.E @ v - self.e).max(initial=0.0)) / size


def norm(x: Floats, p: float) -> float:
    """The p-norm; 0 for no entries."""
    if not x.size:
        return 0.0
    return float(np.abs(x).max()) if p == math.inf else float(np.linalg.norm(x, p))


def conjugate(p: float) -> float:
    """The q with 1/p + 1/q = 1."""
    if p == math.inf:
        return 1.0
    return math.inf if p == 1.0 else p / (p - 1.0)


def _parts(blocks: tuple[Block, ...], v: Floats) -> list[tuple[Block, Floats]]:
    found, start = [], 0
    for block in blocks:
        found.append((block, v[start : start + block.size]))
        start += block.size
    return found
