"""Exact extrema of cubic pieces: the proof that a trajectory stays in its cells at every instant.

A piece is x(s) = c0 + c1 s + c2 s^2 + c3 s^3, 0 <= s <= h. Against a facet (a, b) it is the scalar
cubic a.x(s) - b, whose maximum lies at an end or at a root of its quadratic derivative: both roots
come in closed form, so the maximum is over all instants and not over samples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ragged import reduced, starts_of
from hzmp_planners.sets import Polytope
from hzmp_tracking.constants import ROUND_OFF
from hzmp_tracking.facets import Facets


def cubic_maxima(coefficients: Floats, durations: Floats) -> Floats:
    """Largest value of each cubic on [0, h].

    The roots of the derivative use the form without cancellation (q = -(k2 + sign(k2) sqrt(D)),
    roots q / 3 k3 and k1 / q), which stays accurate when the cubic coefficient vanishes. A root
    outside the interval is clipped to it: every value compared is taken inside [0, h].

    Args:
        coefficients: ascending powers along the last axis, shape (..., 4).
        durations: h >= 0 [s], broadcast against the leading axes.

    Returns:
        Shape (...).
    """
    h = np.asarray(durations)
    k0, k1 = coefficients[..., 0], coefficients[..., 1] * h
    k2, k3 = coefficients[..., 2] * h**2, coefficients[..., 3] * h**3
    root = np.sqrt(np.maximum(k2 * k2 - 3.0 * k3 * k1, 0.0))
    q = -(k2 + np.copysign(root, k2))
    best = np.maximum(k0, k0 + k1 + k2 + k3)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for s in (q / (3.0 * k3), k1 / q):
            # nan: 0 / 0, the derivative is constant or has its double root at s = 0; fmax drops it.
            s = np.fmin(np.fmax(s, 0.0), 1.0)
            best = np.maximum(best, k0 + s * (k1 + s * (k2 + s * k3)))
    return np.asarray(best)


def worst_values(
    coefficients: Floats, durations: Floats, owners: Ints, cells: Sequence[Polytope]
) -> Floats:
    """Maximum over each piece, at every instant, of a.x - b over the facets of a cell; (m,) [m].

    Args:
        coefficients: pieces, shape (m, 4, n).
        durations: shape (m,) [s].
        owners: the cell that each piece is compared with, shape (m,).
        cells: polytopes with unit normals.
    """
    facets = Facets.of(cells)
    facing, counts = facets.facing(owners)
    scalar = (coefficients.repeat(counts, axis=0) @ facets.A[facing, :, None])[..., 0]
    scalar[:, 0] -= facets.b[facing]
    return reduced(np.maximum, cubic_maxima(scalar, durations.repeat(counts)), starts_of(counts))


def violations(
    coefficients: Floats, durations: Floats, piece_cells: Ints, cells: Sequence[Polytope]
) -> Floats:
    """Largest a.x - b of each piece over its own cell, at every instant; shape (m,) [m].

    A value within `round_off` of zero is returned as 0.0: the computation cannot tell it from
    contact. Larger values are returned as they are.
    """
    worst = worst_values(coefficients, durations, piece_cells, cells)
    worst[np.abs(worst) <= round_off(coefficients, cells)] = 0.0
    return worst


def round_off(coefficients: Floats, cells: Sequence[Polytope]) -> float:
    """Bound [m] on the error of a facet value: `ROUND_OFF` times the size of the coordinates."""
    offsets = max((float(np.abs(cell.b).max(initial=0.0)) for cell in cells), default=0.0)
    positions = float(np.abs(coefficients[:, 0, :]).max(initial=0.0))
    return ROUND_OFF * max(1.0, offsets, positions)


def derivative_maxima(coefficients: Floats, durations: Floats) -> tuple[Floats, Floats, Floats]:
    """Exact maxima of |velocity|, |acceleration| and |jerk| over all instants, each (n,)."""
    c = coefficients.transpose(0, 2, 1)  # (m, n, 4)
    zero = np.zeros(c.shape[:2])
    h = durations[:, None]
    velocity = np.stack([c[..., 1], 2.0 * c[..., 2], 3.0 * c[..., 3], zero], axis=-1)
    speed = np.maximum(cubic_maxima(velocity, h), cubic_maxima(-velocity, h))
    start = np.abs(2.0 * c[..., 2])
    end = np.abs(2.0 * c[..., 2] + 6.0 * c[..., 3] * h)
    jerk = np.abs(6.0 * c[..., 3])
    return speed.max(axis=0), np.maximum(start, end).max(axis=0), jerk.max(axis=0)
