"""Exact removal of redundant generators and constraints."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import qr

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.constants import RESIDUAL_TOL
from hzmp_planners.sets.form.form import Ball, GeneratorForm
from hzmp_planners.sets.form.intervals import propagate


def without_redundancy(form: GeneratorForm) -> GeneratorForm:
    """The same set with fewer generators and constraints.

    1. Constraints that others imply are dropped.
    2. The constraints bound each box factor (interval arithmetic); factors are rescaled to those
       bounds, and fixed ones become part of the centre (Scott et al. 2016, proposition 4).
    3. A box factor whose bounds follow from one constraint is solved for (Scott et al. 2016,
       section 4.3): slack variables vanish, and with them their constraints.
    4. Box generators that are parallel, constraints included, are added up; zero ones dropped.

    What the interval arithmetic cannot see stays; an inconsistent set stays as it is.
    """
    box = np.concatenate(
        [np.zeros(0, np.bool_), *(np.full(ball.size, ball.p == math.inf) for ball in form.balls)]
    )
    G, c, (A, b) = form.G, form.c, form.equations
    kept = _independent_rows(A, b)
    if kept is None:
        return form
    A, b = A[kept], b[kept]
    bounds = propagate(A, b, -np.ones(len(box)), np.ones(len(box)))
    if bounds is None:
        return form
    lo, hi = np.where(box, bounds[0], -1.0), np.where(box, bounds[1], 1.0)
    middle, radius = (lo + hi) / 2.0, (hi - lo) / 2.0
    free = radius > RESIDUAL_TOL
    c, b = c + G @ middle, b - A @ middle
    G, A, box = (G * radius)[:, free], (A * radius)[:, free], box[free]
    sizes = [int(free[part].sum()) for part in _slices(form.balls)]
    labels: Ints = np.repeat(np.arange(len(sizes)), sizes)
    live = np.abs(A).max(axis=1, initial=0.0) > RESIDUAL_TOL
    A, b = A[live], b[live]
    while (pivot := _implied_factor(A, b, box)) is not None:
        i, j = pivot
        row, offset = A[i] / A[i, j], b[i] / A[i, j]
        G, c = G - G[:, j, None] * row, c + G[:, j] * offset
        A, b = A - A[:, j, None] * row, b - A[:, j] * offset
        stay, columns = np.arange(len(b)) != i, np.arange(len(box)) != j
        G, A, b = G[:, columns], A[stay][:, columns], b[stay]
        box, labels = box[columns], labels[columns]
    G, A, box, labels = _merged_columns(G, A, box, labels)
    balls = tuple(
        Ball(int((labels == k).sum()), ball.p)
        for k, ball in enumerate(form.balls)
        if (labels == k).any()
    )
    return GeneratorForm(G, c, A, b, balls)


def _slices(balls: tuple[Ball, ...]) -> list[slice]:
    stops = np.cumsum([ball.size for ball in balls]).tolist()
    return [slice(stop - ball.size, stop) for ball, stop in zip(balls, stops, strict=True)]


def _independent_rows(A: Floats, b: Floats) -> Ints | None:
    """Indices of rows that imply the others; None when the rows contradict each other."""
    if not b.size:
        return np.zeros(0, dtype=np.int64)
    _, triangle, order = qr(A.T, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    rank = int((diagonal > RESIDUAL_TOL * max(diagonal.max(initial=0.0), 1.0)).sum())
    kept = np.sort(order[:rank]).astype(np.int64)
    solution = np.linalg.lstsq(A, b)[0]
    if np.abs(A @ solution - b).max(initial=0.0) > RESIDUAL_TOL:
        return None
    return kept


def _implied_factor(A: Floats, b: Floats, box: Bools) -> tuple[int, int] | None:
    """A constraint i and a box factor j that it keeps within [-1, 1] by itself.

    |b_i - sum over k != j of a_ik xi_k| <= |a_ij| for all factors: then xi_j can be solved for
    without its bounds. Of several the one with the largest share of its row: best conditioned.
    """
    if not b.size:
        return None
    magnitude = np.abs(A)
    total = magnitude.sum(axis=1, keepdims=True)
    implied = (np.abs(b)[:, None] + total - magnitude <= magnitude * (1.0 + 1e-12)) & box
    implied &= magnitude > 1e-6 * magnitude.max(axis=1, initial=0.0, keepdims=True)
    if not implied.any():
        return None
    share = np.where(implied, magnitude / total, -1.0)
    i, j = np.unravel_index(int(share.argmax()), share.shape)
    return int(i), int(j)


def _merged_columns(
    G: Floats, A: Floats, box: Bools, labels: Ints
) -> tuple[Floats, Floats, Bools, Ints]:
    """Parallel box columns of [G; A] added up (signs aligned), zero ones dropped."""
    lifted = np.vstack([G, A])
    length = np.linalg.norm(lifted, axis=0)
    tiny = 1e-14 * length.max(initial=0.0)
    keep = ~box | (length > tiny)
    representatives: dict[tuple[float, ...], int] = {}
    for j in np.flatnonzero(box & keep).tolist():
        direction = lifted[:, j] / length[j]
        lead = direction[int(np.abs(direction).argmax())]
        key = tuple(np.round(direction * math.copysign(1.0, lead), 12) + 0.0)
        first = representatives.setdefault(key, j)
        if first != j:
            sign = math.copysign(1.0, float(lifted[:, first] @ lifted[:, j]))
            lifted[:, first] += sign * lifted[:, j]
            keep[j] = False
    n = G.shape[0]
    return lifted[:n, keep], lifted[n:, keep], box[keep], labels[keep]
