"""Nearest points of two convex hulls, exact to round-off (Wolfe 1976)."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats

_MOST_STEPS = 200  # a handful suffices in 2-D and 3-D
_SLACK = 1e-13  # in units of the coordinates: distance and its lower bound agree to this


def nearest_of_hulls(first: Floats, second: Floats) -> tuple[Floats, Floats] | None:
    """A pair of points, one of each hull, at the least distance; None when it is not proved.

    The least-norm point x of the hull of all differences v - w: a set of affinely independent
    differences (the corral) is kept, whose least-norm point is inside it. A difference with a
    smaller inner product with x joins; members whose weight vanishes leave. The norm of x falls
    with each step, and min x.(v - w) / |x|, a lower bound of the distance, meets it at the end.

    Args:
        first: points, shape (k, n).
        second: points, shape (l, n).
    """
    origin = (first.mean(axis=0) + second.mean(axis=0)) / 2.0
    unit = max(float(np.abs(first - origin).max()), float(np.abs(second - origin).max())) or 1.0
    V, W = (first - origin) / unit, (second - origin) / unit
    x = V.mean(axis=0) - W.mean(axis=0)
    corral = [_lowest(V, W, x)]
    weights = np.ones(1)
    for _ in range(_MOST_STEPS):
        rows = np.array(corral)
        x = _across(V[rows[:, 0]] - W[rows[:, 1]])
        lowest = _lowest(V, W, x)
        gain = x @ x - x @ (V[lowest[0]] - W[lowest[1]])
        if gain <= _SLACK * float(np.linalg.norm(x)) or x @ x <= _SLACK**2:
            points = weights @ V[rows[:, 0]], weights @ W[rows[:, 1]]
            return origin + unit * points[0], origin + unit * points[1]
        if lowest in corral:
            return None
        corral.append(lowest)
        weights = np.append(weights, 0.0)
        while True:
            rows = np.array(corral)
            target = _affine_weights(V[rows[:, 0]] - W[rows[:, 1]])
            if target.min() > 0.0:
                weights = target
                break
            falling = target <= 0.0
            ratios = weights[falling] / np.maximum(weights[falling] - target[falling], 1e-300)
            weights = weights + min(1.0, float(ratios.min())) * (target - weights)
            kept = weights > 1e-15
            if kept.all():  # round-off left the vanishing weight above zero
                kept[int(np.where(falling, weights, np.inf).argmin())] = False
            corral = [member for member, keep in zip(corral, kept.tolist(), strict=True) if keep]
            weights = weights[kept] / weights[kept].sum()
    return None


def _lowest(V: Floats, W: Floats, x: Floats) -> tuple[int, int]:
    """Indices of the difference with the least inner product with x."""
    return int((V @ x).argmin()), int((W @ x).argmax())


def _across(points: Floats) -> Floats:
    """The point of the affine hull nearest to 0, exactly orthogonal to it however short it is.

    Summed with weights it would be off by the coordinates' round-off: a tilt, where sets are near.
    Edges that depend on others but for round-off have no direction of their own.
    """
    directions, lengths, _ = np.linalg.svd((points[1:] - points[0]).T, full_matrices=False)
    frame = directions[:, lengths > 1e-9]
    x = points[0] - frame @ (frame.T @ points[0])
    return np.asarray(x - frame @ (frame.T @ x))


def _affine_weights(points: Floats) -> Floats:
    """Weights, with sum 1, of the point of the affine hull nearest to 0."""
    edges = points[1:] - points[0]
    free = np.linalg.lstsq(edges.T, -points[0])[0]
    return np.concatenate([[1.0 - free.sum()], free])
