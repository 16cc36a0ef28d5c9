"""Where cubics change sign, and the largest norms of the derivatives of cubic pieces.

The square of the speed is a quartic in time with the derivative 2 v.a, a cubic: its maximum lies at
an end of the piece or at a sign change of that cubic. The square of the acceleration is a convex
quadratic, with its maximum at an end, and the jerk is constant. All three are exact.
"""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats

_HALVINGS = 30  # a maximum that is off by 1e-9 of the piece is right to 1e-18: it is flat there
_CLOSE = 1e-13  # of the interval: a step that does not matter


def sign_changes(scalar: Floats, h: Floats | float, halvings: int) -> tuple[Floats, Bools]:
    """All sign changes of cubics in (0, h), each between two extrema, where there is but one.

    Newton's steps, and a bisection where one would leave the interval that is left.

    Args:
        scalar: ascending powers, shape (r, 4).
        h: ends of the intervals, a number or shape (r,).
        halvings: steps at most; 60 bisections halve an interval down to one rounding.

    Returns:
        Times (r, 3), ascending, and whether there is a change (r, 3); other times mean nothing.
    """
    c0, c1, c2, c3 = (column[:, None] for column in scalar.T)
    end = np.broadcast_to(np.asarray(h), (len(scalar),))[:, None]
    root = np.sqrt(np.maximum(c2 * c2 - 3.0 * c3 * c1, 0.0))
    q = -(c2 + np.copysign(root, c2))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        extrema = np.hstack([q / (3.0 * c3), c1 / q])
    extrema = np.sort(np.fmin(np.fmax(extrema, 0.0), end), axis=1)
    knots = np.hstack([np.zeros_like(end), extrema, end])
    positive = c0 + knots * (c1 + knots * (c2 + knots * c3)) > 0.0
    changes = positive[:, :-1] != positive[:, 1:]
    times = knots[:, :-1].copy()
    row, column = np.nonzero(changes)
    if not row.size:
        return times, changes
    low, high, sign = knots[row, column], knots[row, column + 1], positive[row, column]
    c0, c1, c2, c3 = scalar[row].T
    width = high - low
    at = 0.5 * (low + high)
    for _ in range(halvings):
        value = c0 + at * (c1 + at * (c2 + at * c3))
        left = (value > 0.0) == sign
        low, high = np.where(left, at, low), np.where(left, high, at)
        slope = c1 + at * (2.0 * c2 + 3.0 * at * c3)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            step = value / slope
        done = np.abs(step) <= _CLOSE * width
        following = at - step
        inside = (following > low) & (following < high)
        at = np.where(done, at, np.where(inside, following, 0.5 * (low + high)))
        if done.all():
            break
    times[row, column] = at
    return times, changes


def norm_maxima(coefficients: Floats, durations: Floats) -> Floats:
    """Exact maxima of the norms of velocity, acceleration and jerk over all instants, shape (3,).

    Args:
        coefficients: pieces in ascending powers of local time, shape (m, 4, n).
        durations: shape (m,) [s].
    """
    # In units of each piece's duration, so that powers of short times do not vanish.
    h = durations[:, None]
    speed = np.stack([coefficients[:, 1] * h, 2.0 * coefficients[:, 2] * h**2,
                      3.0 * coefficients[:, 3] * h**3], axis=1)  # fmt: skip
    v0, v1, v2 = speed[:, 0], speed[:, 1], speed[:, 2]
    dot = [(a * b).sum(axis=1) for a, b in (
        (v0, v1), (v1, v1), (v0, v2), (v1, v2), (v2, v2))]  # fmt: skip
    slope = np.stack([dot[0], dot[1] + 2.0 * dot[2], 3.0 * dot[3], 2.0 * dot[4]], axis=1)
    turns, _ = sign_changes(slope, 1.0, _HALVINGS)  # every time in [0, 1] may be tried
    s = np.hstack([turns, np.zeros((len(h), 1)), np.ones((len(h), 1))])[:, :, None]
    moved = coefficients[:, None, 1] + s * h[:, None] * (
        2.0 * coefficients[:, None, 2] + 3.0 * s * h[:, None] * coefficients[:, None, 3]
    )
    start = 2.0 * coefficients[:, 2]
    jerk = 6.0 * coefficients[:, 3]
    largest = (moved, np.stack([start, start + jerk * h]), jerk)
    return np.array([float(np.linalg.norm(part, axis=-1).max()) for part in largest])
