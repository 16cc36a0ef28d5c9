"""The directions in which a moving geom is bounded: few for cutting, more for looking closely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Bools, Floats
from hzmp_sim.scene.constants import MIN_GROWTH, TOUCH_TOL
from hzmp_sim.scene.directions import polygon_normals, round_normals
from hzmp_sim.scene.grown import least_over_box
from hzmp_sim.scene.moving import MovingGeom
from hzmp_sim.scene.scene import Scene

_ALIKE = 1.0 - 1e-6  # cosine of directions that count as one
_MOST_SIDES = 12  # of a geom, that are directions of their own
_SLOPES = np.array([0.0, -0.25, 0.25, -1.0, 1.0, -4.0, 4.0])
"""Of the planes that bound a slice, by which a planar body sees what leans."""


@dataclass(frozen=True, eq=False)
class Template:
    """Unit normals for the m moving geoms of a scene, F for each, and what goes with them.

    The first 2n are those of a box, in the order +, - of each axis. For a planar body two planes
    follow that are no normals: the highest and the lowest point of the geom.
    """

    normals: Floats
    """In the space of the body's centre, shape (m, F, n)."""
    own: Bools
    """Which are the box's or those of a side of the geom; the others are directions all around, for
    what turns, (m, F)."""
    lifted: Floats
    """Directions in the world, shape (m, T, P, 3), P = F in 3-D and F + 2 for a planar body: the
    least of the T bounds from its directions counts for a plane, T = 1 in 3-D."""
    offsets: Floats
    """What each of these bounds is farther out than the geom's points, (m, T, P) [m]."""
    growth: Floats
    """How much farther out the body puts each plane, shape (m, P) [m]."""
    least: Floats
    """A geom none of whose planes is farther out than this is of no concern, (m, P) [m]: it stays
    out of the bounds of the centre, or of a planar body's heights."""

    @classmethod
    def of_scene(cls, scene: Scene, axes: Floats) -> Template:
        """Directions that suit the geoms as they stand with `axes` (m, 3, 3) as columns."""
        n = scene.n
        found = [_directions(item, turn, n) for item, turn in zip(scene.moving, axes, strict=True)]
        most = max((len(normals) for normals, _ in found), default=2 * n)
        # Geoms of fewer directions repeat one: arrays of one shape are what makes this fast.
        padded = [np.vstack([d, np.repeat(d[:1], most - len(d), axis=0)]) for d, _ in found]
        normals = np.array(padded).reshape(len(found), most, n)
        sides = np.array([count for _, count in found])
        own = np.arange(most) < sides[:, None]
        lifted, offsets = _lifted(normals, scene)
        grow, least = growth(scene, normals), least_over_box(normals, *scene.bounds)
        if scene.heights is not None:
            low, high = scene.heights
            ends = np.array([low + TOUCH_TOL, TOUCH_TOL - high])
            margins = np.array([item.margin for item in scene.moving])[:, None]
            grow = np.hstack([grow, np.repeat(margins, 2, axis=1)])
            least = np.hstack([least, np.broadcast_to(ends, (len(found), 2))])
        return cls(normals, own, lifted, offsets, grow, least)


def of_no_concern(bounds: Floats, least: Floats) -> Bools:
    """Whether geoms with grown bounds (..., m, P) stay below the least (m, P) of some plane [m].

    Shape (..., m): they are out of the bounds of the centre, or of a planar body's heights.
    """
    return np.asarray((bounds <= least + 1e-9).any(axis=-1))


def growth(scene: Scene, normals: Floats) -> Floats:
    """How much farther out the grown body puts planes with these normals (m, F, n); (m, F) [m].

    As for static obstacles (Minkowski sum with the mirrored body), one row for each moving geom,
    without the geom's own rounding.
    """
    m, count, n = normals.shape
    core = scene.shape.core.support(-normals.reshape(-1, n)).reshape(m, count)
    margins = np.array([item.margin for item in scene.moving])
    ball = np.maximum(scene.shape.radius + scene.clearance + margins, MIN_GROWTH)
    return np.asarray(core + ball[:, None])


def _directions(item: MovingGeom, axes: Floats, n: int) -> tuple[Floats, int]:
    """Normals (F, n): a box's and those of the geom's own sides, how many these are, and others.

    The others are directions all around.
    """
    sides = item.normals @ axes.T
    if n == 2:
        flat = sides[np.linalg.norm(sides[:, :2], axis=1) > 0.5, :2]
        sides = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    if len(sides) > _MOST_SIDES:
        sides = np.zeros((0, n))
    frame = _frame(sides, n)
    around = polygon_normals(np.eye(2), 1.0, 0.08) if n == 2 else round_normals(3)
    box = np.stack([frame, -frame], axis=1).reshape(2 * n, n)
    normals = np.vstack([box, sides, around @ frame])
    alike = np.tril(normals @ normals.T, -1) > _ALIKE
    new = np.asarray(~alike.any(axis=1))
    return normals[new], int(new[: 2 * n + len(sides)].sum())


def _frame(sides: Floats, n: int) -> Floats:
    """Orthonormal rows (n, n), the first along a side of the geom; the world's axes without."""
    if not len(sides):
        return np.eye(n)
    first = sides[0]
    if n == 2:
        return np.vstack([first, [-first[1], first[0]]])
    across = sides[np.abs(sides @ first).argmin()]
    second = across - (across @ first) * first
    if np.linalg.norm(second) < 0.5:
        second = np.eye(3)[np.abs(first).argmin()]
        second = second - (second @ first) * first
    second = second / np.linalg.norm(second)
    return np.vstack([first, second, np.cross(first, second)])


def _lifted(normals: Floats, scene: Scene) -> tuple[Floats, Floats]:
    """The planes in the world, and their offsets, that bound what the body sees of a geom.

    By duality as in `scene/planar.py`: for every slope t, d.x + t z <= h(d, t) for all points of
    the geom, so d.x <= h(d, t) + max(-t low, -t high) for those at the body's heights.
    """
    m, count, _ = normals.shape
    radii = np.array([item.radius for item in scene.moving]).reshape(m, 1, 1)
    if scene.heights is None:
        return normals[:, None], np.broadcast_to(radii, (m, 1, count)).copy()
    # Clearance is kept upwards and downwards, too.
    low, high = scene.heights[0] - scene.clearance, scene.heights[1] + scene.clearance
    lifted = np.zeros((m, len(_SLOPES), count + 2, 3))
    lifted[:, :, :count, :2] = normals[:, None]
    lifted[:, :, :count, 2] = _SLOPES[:, None]
    lifted[:, :, count, 2], lifted[:, :, count + 1, 2] = 1.0, -1.0
    # A ball reaches farther in a longer direction.
    offsets = radii * np.linalg.norm(lifted, axis=3)
    offsets[:, :, :count] += np.maximum(-_SLOPES * low, -_SLOPES * high)[:, None]
    return lifted, offsets
