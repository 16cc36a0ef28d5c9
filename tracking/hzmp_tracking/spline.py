"""Cubic B-splines with free knot steps: derivatives, Bezier points and all their Jacobians.

Control points c_0 .. c_m+2 and steps d_0 .. d_m-1 between knots, clamped ends. With steps outside
0 .. m-1 counted as zero (Piegl and Tiller, The NURBS Book, chapters 2 and 3)

    V_i = 3 (c_i+1 - c_i) / (d_i-2 + d_i-1 + d_i)     control points of the velocity
    A_i = 2 (V_i+1 - V_i) / (d_i-1 + d_i)             acceleration at knot i
    J_i = (A_i+1 - A_i) / d_i                         jerk of piece i

and piece i has the Bezier points (P_i the position at knot i)

    P_i,  B1_i = c_i+1 + V_i+1 d_i-1 / 3,  B2_i = c_i+1 + V_i+1 (d_i-1 + d_i) / 3,  P_i+1.

Entry i of any of these depends on c_i .. c_i+3 and d_i-2 .. d_i+2 only: Jacobians are stored as
these windows (`Windowed`), which keeps the linear programs sparse and quick to build.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hzmp_planners._arrays import Floats

C_WINDOW, D_WINDOW = 4, 5


class Windowed(NamedTuple):
    """Values at window positions 0 .. r-1 and their derivatives."""

    value: Floats
    """Shape (r, n)."""
    by_c: Floats
    """Derivative by c_i .. c_i+3, the same for each axis, shape (r, 4)."""
    by_d: Floats
    """Derivative by d_i-2 .. d_i+2, shape (r, 5, n)."""

    def rows(self, start: int, stop: int) -> Windowed:
        """Entries start .. stop - 1, their windows unchanged."""
        return Windowed(*(array[start:stop] for array in self))

    def ahead(self) -> Windowed:
        """Entry i + 1 seen from window i (its last columns are zero for what is used here)."""
        by_c, by_d = np.zeros_like(self.by_c[1:]), np.zeros_like(self.by_d[1:])
        by_c[:, 1:], by_d[:, 1:] = self.by_c[1:, :-1], self.by_d[1:, :-1]
        return Windowed(self.value[1:], by_c, by_d)

    def plus(self, factor: Floats, other: Windowed) -> Windowed:
        """Self + factor * other, factor of shape (r,) taken as constant."""
        f = factor[:, None]
        return Windowed(
            self.value + f * other.value,
            self.by_c + f * other.by_c,
            self.by_d + f[:, None] * other.by_d,
        )

    def difference(self, factor: float) -> Windowed:
        """Factor * (entry i + 1 - entry i), one row less."""
        here, following = self.rows(0, len(self.value) - 1), self.ahead()
        return Windowed(*(factor * (b - a) for a, b in zip(here, following, strict=True)))

    def over(self, steps: Floats, positions: slice) -> Windowed:
        """Self / s, where s of shape (r,) sums the steps at `positions` of the window."""
        value = self.value / steps[:, None]
        by_d = self.by_d / steps[:, None, None]
        by_d[:, positions] -= (value / steps[:, None])[:, None]
        return Windowed(value, self.by_c / steps[:, None], by_d)


class Spline:
    """The curve with control points `c` of shape (m + 3, n) [m] and steps `d` of shape (m,) [s].

    `change_1`, `change_2`, `change_3` are the numerators of V, A, J and `steps_1`, `steps_2`,
    `steps_3` their denominators, so that |change| <= limit * steps is the bound on the derivative;
    `left`, `right`, `knots` are B1 (m,), B2 (m,) and P_1 .. P_m-1.
    """

    def __init__(self, c: Floats, d: Floats) -> None:
        m, n = d.size, c.shape[1]
        self.c, self.d, self.m, self.n = c, d, m, n
        padded = np.concatenate([[0.0, 0.0], d, [0.0, 0.0]])
        self.steps_1 = padded[:-2] + padded[1:-1] + padded[2:]
        self.steps_2 = padded[1:-2] + padded[2:-1]
        self.steps_3 = d
        point = Windowed(c, np.tile([1.0, 0.0, 0.0, 0.0], (m + 3, 1)), np.zeros((m + 3, 5, n)))
        self.change_1 = point.difference(3.0)
        self.V = self.change_1.over(self.steps_1, slice(0, 3))
        self.change_2 = self.V.difference(2.0)
        self.A = self.change_2.over(self.steps_2, slice(1, 3))
        self.change_3 = self.A.difference(1.0)

        before = padded[1 : m + 1]
        base, rate = point.ahead().rows(0, m), self.V.ahead().rows(0, m)
        self.left = base.plus(before / 3.0, rate)
        self.left.by_d[:, 1] += rate.value / 3.0
        self.right = base.plus((before + d) / 3.0, rate)
        self.right.by_d[:, 1:3] += (rate.value / 3.0)[:, None]
        # P is where the line from B2 to the next B1 is divided in the ratio of the steps.
        total = d[:-1] + d[1:]
        share = d[:-1] / total
        end, begin = self.right.rows(0, m - 1), self.left.ahead()
        gap = (begin.value - end.value) / total[:, None]
        self.knots = end.plus(-share, end).plus(share, begin)
        self.knots.by_d[:, 2] += (1.0 - share)[:, None] * gap
        self.knots.by_d[:, 3] -= share[:, None] * gap

    def coefficients(self) -> Floats:
        """Ascending powers of local time of each piece, shape (m, 4, n)."""
        starts = np.concatenate([self.c[:1], self.knots.value])
        velocity = 3.0 * (self.left.value - starts) / self.d[:, None]
        jerk = self.change_3.value / self.d[:, None]
        return np.stack([starts, velocity, self.A.value[:-1] / 2.0, jerk / 6.0], axis=1)
