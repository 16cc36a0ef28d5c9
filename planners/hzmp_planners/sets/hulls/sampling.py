"""Uniform samples of convex sets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull

from hzmp_planners._arrays import Floats

if TYPE_CHECKING:
    from hzmp_planners.sets.base import AffineHull
    from hzmp_planners.sets.convex_set import ConvexSet


def sample_hull(points: Floats, hull: AffineHull, count: int, rng: np.random.Generator) -> Floats:
    """Uniform points of a convex hull, perhaps a flat one, shape (count, n).

    The hull is the fan of simplices from an inner point to its (triangulated) facets: a simplex is
    drawn by its volume, and a point in it with Dirichlet(1) weights. Uniform weights of all
    vertices, or uniform factors, would not be uniform points.
    """
    dimension = len(hull.basis)
    if dimension == 0:
        return np.repeat(points[:1], count, axis=0)
    if dimension == 1:
        along = points @ hull.basis[0]
        corners = points[[[int(along.argmin()), int(along.argmax())]]]
        volumes = np.ones(1)
    else:
        flat = (points - hull.point) @ hull.basis.T
        flat /= np.ptp(flat, axis=0)  # ratios of volumes are the same in any units
        facets = ConvexHull(flat, qhull_options="Qt").simplices
        inner = np.broadcast_to(flat.mean(axis=0), (len(facets), 1, dimension))
        volumes = np.abs(np.linalg.det(flat[facets] - inner))
        middle = np.broadcast_to(points.mean(axis=0), (len(facets), 1, points.shape[1]))
        corners = np.concatenate([points[facets], middle], axis=1)
    chosen = rng.choice(len(volumes), size=count, p=volumes / volumes.sum())
    weights = rng.dirichlet(np.ones(corners.shape[1]), size=count)
    return np.asarray(np.einsum("kj,kjn->kn", weights, corners[chosen]))


def sample_by_rejection(body: ConvexSet, count: int, rng: np.random.Generator) -> Floats:
    """Uniform points of any convex set: those of an enclosing polytope that it contains.

    The polytope is cut from the set's interval hull (in the set's own affine hull) by its
    supporting half-spaces in a few dozen directions, so that few points are rejected.
    """
    from hzmp_planners.sets.polytope import Polytope

    hull = body.affine_hull()
    dimension = len(hull.basis)
    if dimension == 0:
        return np.repeat(hull.point[None], count, axis=0)
    turned = np.vstack([np.eye(dimension), -np.eye(dimension), spread_directions(dimension, 32)])
    reach = np.array([body.support(d @ hull.basis) - d @ hull.basis @ hull.point for d in turned])
    outer = Polytope.from_halfspaces(turned, reach)
    kept = [np.zeros((0, body.n))]
    found = 0
    while found < count:
        flat = outer.sample(count - found + 8, rng)
        points = hull.point + flat @ hull.basis
        inside = points[body.contains(points)]
        kept.append(inside)
        found += len(inside)
    return np.concatenate(kept)[:count]


def spread_directions(dimension: int, count: int) -> Floats:
    """Unit vectors spread over the sphere, the same each time, shape (count, dimension).

    Evenly on the circle, by the golden angle on the sphere, else pseudo-random.
    """
    if dimension == 1:
        return np.array([[1.0], [-1.0]])
    if dimension == 2:
        angle = 2.0 * np.pi * (np.arange(count) + 0.5) / count
        return np.column_stack([np.cos(angle), np.sin(angle)])
    if dimension == 3:
        z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
        angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
        ring = np.sqrt(1.0 - z * z)
        return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
    points = np.random.default_rng(dimension).standard_normal((count, dimension))
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))
