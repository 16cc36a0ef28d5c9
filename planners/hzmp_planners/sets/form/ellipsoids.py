"""Closed forms for ellipsoids, {c + G xi : |xi|_2 <= 1}."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from hzmp_planners._arrays import Floats
from hzmp_planners.constants import SET_TOL
from hzmp_planners.sets.form.form import GeneratorForm


def ellipsoid_volume(form: GeneratorForm) -> float:
    """Volume of the unit ball of R^n times the product of the n half-axes."""
    n, ng = form.G.shape
    if ng < n:
        return 0.0
    axes = np.linalg.svd(form.G, compute_uv=False)
    return float(math.pi ** (n / 2.0) / math.gamma(n / 2.0 + 1.0) * np.prod(axes))


def sample_ellipsoid(form: GeneratorForm, count: int, rng: np.random.Generator) -> Floats:
    """Uniform points of an ellipsoid (in its affine hull when it is flat), shape (count, n)."""
    directions, axes, _ = np.linalg.svd(form.G, full_matrices=False)
    thick = axes > SET_TOL * axes.max(initial=0.0)
    half = directions[:, thick] * axes[thick]
    m = half.shape[1]
    points = rng.standard_normal((count, m))
    points /= np.maximum(np.linalg.norm(points, axis=1, keepdims=True), 1e-300)
    radius = rng.random((count, 1)) ** (1.0 / max(m, 1))
    return np.asarray(form.c + (radius * points) @ half.T)


def ellipsoid_reach(outer: GeneratorForm, inner: GeneratorForm) -> float:
    """The least scale about its centre at which the outer ellipsoid contains the inner one.

    In the outer one's own coordinates this is max |u + B xi| over |xi| <= 1, a trust-region
    problem: convex maximisation over a ball, solved by its secular equation (Conn, Gould and Toint
    2000, section 7.3). inf when the inner one leaves the affine hull of a flat outer one.
    """
    directions, axes, _ = np.linalg.svd(outer.G, full_matrices=False)
    thick = axes > SET_TOL * axes.max(initial=0.0)
    frame = directions[:, thick]
    offset = inner.c - outer.c
    size = max(outer.size, inner.size)
    off_frame = np.abs(inner.G - frame @ (frame.T @ inner.G)).max(initial=0.0)
    off_frame = max(off_frame, np.abs(offset - frame @ (frame.T @ offset)).max(initial=0.0))
    if off_frame > 10.0 * SET_TOL * size:
        return math.inf
    if not thick.any():  # two single points
        return 0.0
    B = (frame / axes[thick]).T @ inner.G
    u = (frame / axes[thick]).T @ offset
    return math.sqrt(_largest_square(B, u))


def _largest_square(B: Floats, u: Floats) -> float:
    """Max |u + B xi|^2 over |xi| <= 1.

    At the maximum (mu I - B'B) xi = B'u with mu at least the largest eigenvalue of B'B and
    |xi| = 1; the value is |u|^2 + mu + sum_i w_i^2 / (mu - e_i) in the eigenbasis, its minimum over
    mu (the Lagrange dual, which is tight).
    """
    eigenvalues, vectors = np.linalg.eigh(B.T @ B)
    w = vectors.T @ (B.T @ u)
    top = float(eigenvalues.max(initial=0.0))
    used = np.abs(w) > 1e-14 * max(float(np.abs(w).max(initial=0.0)), 1e-300)
    w, eigenvalues = w[used], eigenvalues[used]

    def slope(mu: float) -> float:
        return 1.0 - float(((w / (mu - eigenvalues)) ** 2).sum())

    def value(mu: float) -> float:
        return float(u @ u) + mu + float((w * w / (mu - eigenvalues)).sum())

    if not w.size:
        return float(u @ u) + top
    low = top + 1e-14 * max(top, 1.0) + float(np.abs(w).max()) * 1e-12
    high = top + float(np.linalg.norm(w)) + 1e-12
    if slope(low) >= 0.0:  # the hard case: the dual's minimum is at the largest eigenvalue
        return value(low)
    return value(brentq(slope, low, max(high, low * (1.0 + 1e-12)), xtol=1e-15 * max(high, 1.0)))
