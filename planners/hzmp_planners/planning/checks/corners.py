"""Checking the potentials of a planar bound: who sees whom is found anew from leaves and faces."""

from __future__ import annotations

import math

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._links import component_labels
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.planning.planar.certificate import CornerCertificate
from hzmp_planners.planning.result import Plan

_SAFE = 1.0 - 1e-9
"""Corners and pairs count up to a bound this much lower: round-off must not decide."""
_NEAR = 1e-7
"""A corner of the certificate is at an obstacle's vertex within this [m at S = 1]."""
_TOUCH = 1e-9
"""A line of sight as near to a face or leaf as this [m at S = 1] passes it."""


def corner_bound(plan: Plan, certificate: CornerCertificate) -> float:
    """The lower bound that potentials at corners support [m]; -inf when they are incomplete."""
    space, limit = plan.space, certificate.bound * _SAFE
    if not (np.isfinite(certificate.potentials).all() and math.isfinite(certificate.bound)):
        return -math.inf
    nodes = [(plan.start, space.leaves_at(plan.start), 0.0)]
    nodes.append((plan.goal, space.leaves_at(plan.goal), certificate.bound))
    for vertex in _vertices(space):
        if math.dist(vertex, plan.start) + math.dist(vertex, plan.goal) >= limit:
            continue
        bend = _bending_side(space, vertex)
        if not len(bend):
            continue
        away = np.linalg.norm(certificate.corners - vertex, axis=1)
        near = away <= _NEAR * space.scale
        # Any number may stand for a node; that of its own side is the one that may prove something.
        same_side = near & np.isin(certificate.leaves, bend)
        match = np.flatnonzero(same_side if same_side.any() else near)
        if not len(match):
            return -math.inf
        nearest = match[away[match].argmin()]
        nodes.append((vertex, bend, float(certificate.potentials[nearest])))
    points = np.array([node[0] for node in nodes])
    phi = np.array([node[2] for node in nodes])
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    legs = apart[0][:, None] + apart + apart[1]
    excess = phi - phi[:, None] - apart
    worst = 0.0
    for i, j in np.argwhere((excess > 0.0) & (legs < limit)).tolist():
        if excess[i, j] > worst and _may_see(space, nodes[i][:2], nodes[j][:2]):
            worst = float(excess[i, j])
    return limit - worst * len(nodes)


def _vertices(space: FreeSpace) -> list[Floats]:
    """Vertices of obstacles that are not inside another obstacle."""
    if not space.obstacles:
        return []
    points = np.concatenate([block.vertices() for block in space.obstacles])
    deepest = np.min([block.violation(points) for block in space.obstacles], axis=0)
    lo, hi = space.bounds
    inside = ((points >= lo) & (points <= hi)).all(axis=1)
    return list(points[inside & (deepest > -_TOUCH * space.scale)])


def _bending_side(space: FreeSpace, vertex: Floats) -> Ints:
    """The connected leaves around a vertex that have more than half a turn together; else none."""
    leaves, graph = space.leaves_at(vertex), space.graph
    doors = np.flatnonzero(np.isin(graph.ends, leaves).all(axis=1))
    # To the face and back: the least detour of a point to itself.
    away = least_detour(graph.corners[doors], vertex, vertex)[0] / 2.0
    doors = doors[away <= _TOUCH * space.scale]
    labels = component_labels(np.searchsorted(leaves, graph.ends[doors]), len(leaves))
    angles = np.array([_angle(space.leaf(leaf).vertices(), vertex) for leaf in leaves.tolist()])
    for label in np.unique(labels):
        if angles[labels == label].sum() > math.pi + 1e-9:
            return np.asarray(leaves[labels == label])
    return np.asarray(leaves[:0])


def _angle(corners: Floats, vertex: Floats) -> float:
    """The angle in which a convex polygon is seen from a point of its boundary [rad]."""
    offset = corners - vertex
    offset = offset[np.linalg.norm(offset, axis=1) > 1e-6 * np.abs(offset).max()]
    around = np.sort(np.arctan2(offset[:, 1], offset[:, 0]))
    gaps = np.diff(np.append(around, around[0] + 2.0 * math.pi))
    return float(2.0 * math.pi - gaps.max())


def _may_see(space: FreeSpace, one: tuple[Floats, Ints], two: tuple[Floats, Ints]) -> bool:
    """Whether faces that the segment between two points meets connect leaves at its ends.

    A segment in the free space goes from leaf to leaf through faces that it meets, so False is
    certain; True is not.
    """
    graph = space.graph
    (p, here), (q, there) = one, two
    met = np.flatnonzero(_meets(graph.corners, p, q, _TOUCH * space.scale))
    labels = component_labels(graph.ends[met], graph.leaf_count)
    return bool(np.isin(labels[here], labels[there]).any())


def _meets(segments: Floats, p: Floats, q: Floats, tol: float) -> Bools:
    """Whether segments (F, 2, 2) come nearer than the tolerance to the segment from p to q."""
    along = (q - p) / max(float(np.linalg.norm(q - p)), 1e-300)
    across = np.array([-along[1], along[0]])
    offset = segments - p
    height, reach = offset @ across, offset @ along
    straddle = (height.min(axis=1) <= tol) & (height.max(axis=1) >= -tol)
    drop = height[:, 0] - height[:, 1]
    share = np.where(np.abs(drop) > tol, height[:, 0] / np.where(drop == 0.0, 1.0, drop), 0.5)
    share = np.clip(share, 0.0, 1.0)
    at = reach[:, 0] + share * (reach[:, 1] - reach[:, 0])
    flat = np.abs(drop) <= 4.0 * tol  # along the line of sight: anywhere on it
    low = np.where(flat, reach.min(axis=1), at) - tol
    high = np.where(flat, reach.max(axis=1), at) + tol
    return np.asarray(straddle & (high >= 0.0) & (low <= float(np.linalg.norm(q - p))))
