"""The one algebraic form behind all convex set types: generators, constraints and norm balls.

    {c + G xi : A xi = b, xi in B},   B a product of unit balls of the norms p over blocks of xi

These are the constrained convex generators of Silvestre (2022). Boxes alone give (constrained)
zonotopes, one norm for all blocks gives ellipsotopes (Kousik, Dai and Gao 2023).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ball_program import Block, conjugate


class Ball(NamedTuple):
    """Unit ball of the p-norm over `size` consecutive factors; p = inf is a box."""

    size: int
    p: float


@dataclass(frozen=True, eq=False)
class GeneratorForm:
    """Matrices that a set type has checked; nothing is checked again here."""

    G: Floats
    """Shape (n, ng)."""
    c: Floats
    """Shape (n,)."""
    A: Floats
    """Shape (nc, ng)."""
    b: Floats
    """Shape (nc,)."""
    balls: tuple[Ball, ...]
    """Sizes add up to ng."""

    @classmethod
    def of_points(cls, V: Floats) -> GeneratorForm:
        """Convex hull of the rows of V (k, n): k generators, one constraint, one box.

        x = V' lam, 1'lam = 1, 0 <= lam <= 1, in factors xi = 2 lam - 1: < V'/2, V'1/2, 1', 2-k >.
        """
        k = len(V)
        half = V.T / 2.0
        balls = (Ball(k, math.inf),)
        return cls(half, half.sum(axis=1), np.ones((1, k)), np.array([2.0 - k]), balls)

    @property
    def is_polytopal(self) -> bool:
        """Only boxes: the set is a polytope."""
        return all(ball.p == math.inf for ball in self.balls)

    @property
    def is_ellipsoid(self) -> bool:
        """One Euclidean ball without constraints, mapped by G; perhaps flat."""
        return len(self.balls) == 1 and self.balls[0].p == 2.0 and not self.b.size

    @cached_property
    def size(self) -> float:
        """Unit of length for this set [m]: its reach, at least 1e-6 of its distance from 0."""
        away = 1e-6 * float(np.abs(self.c).max(initial=0.0))
        return max(float(self.reaches(np.eye(self.c.size)).max(initial=0.0)), away) or 1.0

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The balls, as the variables of a program."""
        return tuple(Block(ball.size, ball.p) for ball in self.balls)

    @cached_property
    def equations(self) -> tuple[Floats, Floats]:
        """A and b with rows scaled to unit size; rows that are only round-off are not blown up."""
        rows = np.abs(self.A).max(axis=1, initial=0.0)
        scale = np.maximum(rows, 1e-7 * rows.max(initial=0.0))
        scale[scale == 0.0] = 1.0
        return self.A / scale[:, None], self.b / scale

    def parts(self, rows: Floats) -> list[tuple[Ball, Floats]]:
        """Columns of `rows` (..., ng) ball by ball."""
        stops = np.cumsum([ball.size for ball in self.balls]).tolist()
        return [
            (ball, rows[..., stop - ball.size : stop])
            for ball, stop in zip(self.balls, stops, strict=True)
        ]

    def reaches(self, D: Floats) -> Floats:
        """Half extents of c + G B, without the constraints, along the rows of D (k, n); (k,)."""
        total = np.zeros(len(D))
        for ball, part in self.parts(D @ self.G):
            total += np.linalg.norm(part, conjugate(ball.p), axis=1)
        return total

    def point(self, factors: Floats) -> Floats:
        """C + G xi."""
        return self.c + self.G @ factors

    def mapped(self, R: Floats) -> GeneratorForm:
        """R times the set."""
        return GeneratorForm(R @ self.G, R @ self.c, self.A, self.b, self.balls)

    def shifted(self, v: Floats) -> GeneratorForm:
        """The set moved by v."""
        return GeneratorForm(self.G, self.c + v, self.A, self.b, self.balls)

    def plus(self, other: GeneratorForm) -> GeneratorForm:
        """Minkowski sum."""
        return self._joined(other, np.hstack([self.G, other.G]), self.c + other.c)

    def times(self, other: GeneratorForm) -> GeneratorForm:
        """Cartesian product."""
        return self._joined(other, diagonal(self.G, other.G), np.concatenate([self.c, other.c]))

    def meet(self, other: GeneratorForm, R: Floats | None = None) -> GeneratorForm:
        """Points z of this set with R z in the other one (Scott et al. 2016, eq. 13)."""
        RG, Rc = (self.G, self.c) if R is None else (R @ self.G, R @ self.c)
        both = self._joined(other, np.hstack([self.G, np.zeros((self.c.size, other.G.shape[1]))]))
        A = np.vstack([both.A, np.hstack([RG, -other.G])])
        b = np.concatenate([both.b, other.c - Rc])
        return GeneratorForm(both.G, self.c, A, b, both.balls)

    def cut(self, H: Floats, f: Floats) -> GeneratorForm:
        """Points x of this set with H x <= f, H of shape (m, n): a factor and a row a half-space.

        h.x <= f becomes h'G xi + (d/2) s = f - h.c - d/2 with a slack s in [-1, 1], where d is the
        largest value that f - h.x takes (Bird et al. 2023). Half-spaces that hold the whole set
        add nothing; opposite ones that leave a plane add an equation without slack.
        """
        rows, columns, offsets = halfspace_rows(H, f, f - H @ self.c, self.reaches(H))
        ng, extra = self.G.shape[1], columns.shape[1]
        A = np.zeros((self.b.size + len(rows), ng + extra))
        A[: self.b.size, :ng] = self.A
        A[self.b.size :, :ng] = H[rows] @ self.G
        A[self.b.size :, ng:] = columns
        G = np.hstack([self.G, np.zeros((self.c.size, extra))])
        balls = join_balls(self.balls, (Ball(extra, math.inf),))
        return GeneratorForm(G, self.c, A, np.concatenate([self.b, offsets]), balls)

    def _joined(self, other: GeneratorForm, G: Floats, c: Floats | None = None) -> GeneratorForm:
        A = diagonal(self.A, other.A)
        b = np.concatenate([self.b, other.b])
        return GeneratorForm(
            G, self.c if c is None else c, A, b, join_balls(self.balls, other.balls)
        )


def diagonal(*blocks: Floats) -> Floats:
    """Matrices along the diagonal of one; blocks without rows or columns keep their width."""
    made = np.zeros((sum(len(block) for block in blocks), sum(block.shape[1] for block in blocks)))
    row = column = 0
    for block in blocks:
        made[row : row + len(block), column : column + block.shape[1]] = block
        row, column = row + len(block), column + block.shape[1]
    return made


def halfspace_rows(
    H: Floats, f: Floats, offsets: Floats, reach: Floats
) -> tuple[Ints, Floats, Floats]:
    """Which half-spaces H x <= f cut a set, and the slack columns and offsets of their rows.

    Args:
        H: shape (m, n).
        f: shape (m,).
        offsets: f - H c of the set's centre, shape (m,).
        reach: half extent of the set about its centre along each row, shape (m,).

    Returns:
        Indices (k,) of the rows that become constraints, slack columns (k, j), offsets (k,).
    """
    partner = _opposite(H, f, 1e-12 * (1.0 + np.abs(f)))
    rows = [
        i for i in range(len(f)) if partner[i] > i or (partner[i] < 0 and offsets[i] < reach[i])
    ]
    slacks = [k for k, i in enumerate(rows) if partner[i] < 0]
    depth = np.maximum((offsets + reach)[rows], 0.0)  # below 0 it misses the whole set
    columns = np.zeros((len(rows), len(slacks)))
    columns[slacks, np.arange(len(slacks))] = depth[slacks] / 2.0
    return np.array(rows, dtype=np.int64), columns, offsets[rows] - columns.sum(axis=1)


def join_balls(one: Sequence[Ball], two: Sequence[Ball]) -> tuple[Ball, ...]:
    """All balls in order, without empty ones; neighbouring boxes become one."""
    joined: list[Ball] = []
    for ball in (*one, *two):
        if not ball.size:
            continue
        p = math.inf if ball.size == 1 else ball.p  # every norm of one factor is its magnitude
        if joined and joined[-1].p == p == math.inf:
            joined[-1] = Ball(joined[-1].size + ball.size, math.inf)
        else:
            joined.append(Ball(ball.size, p))
    return tuple(joined)


def _opposite(H: Floats, f: Floats, tol: Floats) -> list[int]:
    """For each half-space the index of the one that leaves just its boundary plane, or -1."""
    partner = [-1] * len(f)
    cosines = H @ H.T
    lengths = np.sqrt(np.diag(cosines))
    scaled = f / np.where(lengths > 0.0, lengths, 1.0)
    pairs = (cosines <= -(1.0 - 1e-12) * np.outer(lengths, lengths)) & (lengths > 0.0)
    pairs &= np.abs(scaled[:, None] + scaled[None]) <= tol[:, None]
    for i, j in np.argwhere(np.triu(pairs, 1)).tolist():
        if partner[i] < 0 and partner[j] < 0:
            partner[i], partner[j] = j, i
    return partner
