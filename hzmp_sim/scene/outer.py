"""Few half-spaces around a convex shape grown by a ball, with the error known.

Cutting planes: start from a few supporting half-spaces; while a corner of the polytope is farther
than `grow + tolerance` from the shape, add the half-space that supports the grown shape in the
direction from the corner's nearest point to the corner. Every half-space supports the grown shape,
so the polytope always contains it. The distance to a convex set is a convex function, so its
maximum over the polytope is at a corner: the reported error is exact, not sampled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import HalfspaceIntersection, QhullError

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_planners.sets import Polytope
from hzmp_sim.scene.constants import CUT_SPREAD, MAX_PROJECTIONS, MAX_ROUNDS
from hzmp_sim.scene.shapes import Shape


@dataclass(frozen=True, eq=False)
class Outer:
    """A polytope around a grown shape."""

    polytope: Polytope
    vertices: Floats
    """Corners of the polytope [m], shape (k, n)."""
    error: float
    """Largest distance of a point of the polytope to the grown shape [m]."""


def outer_polytope(
    shape: Shape, grow: float, tolerance: float, within: tuple[Floats, Floats] | None = None
) -> Outer:
    """Polytope around {x : distance to shape <= grow}, at most `tolerance` too large.

    With `within` = (lo, hi) it is only the part in that box, cut off by the sides of the box.

    Args:
        shape: convex shape in 2-D or 3-D.
        grow: radius of the ball it is grown by [m], >= 0; > 0 with `within`.
        tolerance: largest distance of a point of the result to the grown shape [m], > 0.
        within: box (lo, hi), each (n,) [m], that the grown shape must reach into.

    Raises:
        SceneError: the shape is too large or too thin for double precision.
    """
    normals, inside = shape.normals(grow, tolerance), shape.centre
    sides, ends = np.zeros((0, inside.size)), np.zeros(0)
    if within is not None:
        sides = np.vstack([np.eye(inside.size), -np.eye(inside.size)])
        ends = np.concatenate([within[1], -within[0]])
        inside = _common_point(shape, grow, within)
    for _ in range(MAX_ROUNDS):
        planes = np.vstack([sides, normals])
        offsets = np.concatenate([ends, shape.support(normals) + grow])
        corners, facet_corners = _corners(planes, offsets, inside)
        away = corners - shape.project(corners)
        distance = np.linalg.norm(away, axis=1)
        beyond = distance - grow
        if beyond.max() <= tolerance:
            kept = facet_corners >= inside.size  # fewer corners: the plane is redundant
            polytope = Polytope.from_both_forms(planes[kept], offsets[kept], corners)
            return Outer(polytope, corners, max(0.0, float(beyond.max())))
        far = np.flatnonzero(beyond > tolerance)
        far = far[np.argsort(-beyond[far], kind="stable")]
        normals = np.vstack([normals, _spread(away[far] / distance[far, None])])
    raise SceneError(
        f"no polytope within {tolerance:g} m of the shape at {np.round(shape.centre, 3).tolist()} "
        f"after {MAX_ROUNDS} rounds: choose a larger tolerance"
    )


def _common_point(shape: Shape, grow: float, within: tuple[Floats, Floats]) -> Floats:
    """A point well inside both the grown shape and the box, by alternating projections.

    Raises:
        SceneError: there is none.
    """
    low, high = within
    point = 0.5 * (low + high)
    for _ in range(MAX_PROJECTIONS):
        nearest = shape.project(point[None, :])[0]
        clipped = np.clip(nearest, low, high)
        if float(np.linalg.norm(clipped - nearest)) < 0.5 * grow:
            inner = 0.25 * grow  # stay off the walls of the box, still inside the grown shape
            return np.asarray(np.clip(clipped, low + inner, high - inner))
        point = clipped
    raise SceneError("a shape only grazes the free space, too far out to be approximated")


def _spread(directions: Floats) -> Floats:
    """The first of each bunch of nearly equal directions."""
    chosen: list[Floats] = []
    for direction in directions:
        if all(float(direction @ other) < CUT_SPREAD for other in chosen):
            chosen.append(direction)
    return np.array(chosen)


def _corners(normals: Floats, offsets: Floats, inside: Floats) -> tuple[Floats, Floats]:
    """Corners (k, n) of {x : normals x <= offsets}, and how many lie on each plane (m,).

    `inside` is a point strictly inside.
    """
    slack = offsets - normals @ inside
    size = float(slack.max())
    wrong = f"a shape at {np.round(inside, 3).tolist()} of size {size:g} m has no usable corners"
    try:
        with np.errstate(divide="ignore", invalid="ignore"):
            dual = HalfspaceIntersection(
                np.column_stack([normals, -slack / size]), np.zeros(normals.shape[1])
            )
    except QhullError as error:
        raise SceneError(f"{wrong}: {str(error).splitlines()[0]}") from error
    if not np.isfinite(dual.intersections).all():
        raise SceneError(f"{wrong}: its facets meet at no finite points")
    keys = np.round(dual.intersections, 9) + 0.0
    _, first = np.unique(keys, axis=0, return_index=True)
    corners = dual.intersections[np.sort(first)]
    on_plane = np.abs(corners @ normals.T - slack / size) <= 1e-8
    return np.asarray(corners * size + inside), on_plane.sum(axis=0).astype(np.float64)
