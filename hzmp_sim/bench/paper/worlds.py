"""Worlds of the kind that sections 4.1 to 4.3 and the figures of the paper show.

The paper gives workspaces, starts, goals and some sizes, but not the obstacles. What it gives is
kept here, the rest is made up; `made_up` says what. Non-convex obstacles are unions of convex ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope

Box = tuple[Sequence[float], Sequence[float]]


@dataclass(frozen=True, eq=False)
class PaperWorld:
    """A workspace with obstacles, and what to plan in it."""

    name: str
    section: str
    """Of the paper."""
    unit: str
    """Of all lengths."""
    lo: Floats
    """Lower corner of the workspace, shape (n,)."""
    hi: Floats
    """Upper corner of the workspace, shape (n,)."""
    obstacles: tuple[Polytope, ...]
    start: Floats
    """Shape (n,)."""
    goal: Floats
    """Shape (n,)."""
    made_up: str
    """What the paper does not say."""

    def free_space(self) -> FreeSpace:
        """Its decomposition."""
        return FreeSpace.decompose((self.lo, self.hi), self.obstacles)


def maze() -> PaperWorld:
    """Section 4.1, figure 5: 13 obstacles around a start that is nearly enclosed."""
    u_shape = [((310, 180), (330, 330)), ((330, 310), (480, 330)), ((480, 180), (500, 330))]
    barriers = [
        ((120, 375), (560, 400)),
        ((620, 375), (800, 400)),
        ((150, 60), (660, 80)),
        ((560, 140), (580, 375)),
        ((200, 480), (330, 500)),
        ((440, 460), (460, 600)),
        ((-100, 200), (60, 225)),
    ]
    circles = [((220, 150), 45), ((690, 240), 60), ((20, 450), 55)]
    stars = [((90, 0), 60), ((640, 510), 55)]
    obstacles = [*_boxes([*u_shape, *barriers])]
    obstacles += [_disc(centre, radius, 16) for centre, radius in circles]
    for centre, radius in stars:
        obstacles += _star(centre, radius)
    return _world(
        "maze", "4.1", "cm", ((-100, -100), (800, 600)), obstacles, (400, 250), (385, 470),
        "where the 13 obstacles are and how large; the passage 60 cm wide is kept",
    )  # fmt: skip


def passage() -> PaperWorld:
    """Section 4.2, figure 7: over a wall, under the ceiling, and through two doors in line."""
    wall = 0.15
    boxes: list[Box] = [((-wall, 0, 0), (wall, 13, 4)), ((-wall, 13, 0), (wall, 15, 5))]
    for x in (-7.0, 7.0):  # walls with a door each: y from 5 to 8, z from 1.5 to 3.5
        low, high = x - wall, x + wall
        boxes += [
            ((low, 0, 0), (high, 5, 5)),
            ((low, 8, 0), (high, 15, 5)),
            ((low, 5, 0), (high, 8, 1.5)),
            ((low, 5, 3.5), (high, 8, 5)),
        ]
    return _world(
        "passage", "4.2", "m", ((-15, 0, 0), (15, 15, 5)), list(_boxes(boxes)), (-13, 10, 3),
        (13, 3, 2),
        "the doors that the central opening is in line with; the central wall, its thickness and "
        "the opening 1 m high at z = 4.5 m are kept",
    )  # fmt: skip


def enclosure() -> PaperWorld:
    """Section 4.3, figure 8: into a room with one narrow opening."""
    boxes: list[Box] = [
        ((1.7, 1.7), (8.3, 2.0)),
        ((1.7, 6.0), (8.3, 6.3)),
        ((8.0, 2.0), (8.3, 6.0)),
        ((1.7, 2.0), (2.0, 3.6)),
        ((1.7, 4.4), (2.0, 6.0)),
    ]
    return _world(
        "enclosure", "4.3", "m", ((0, 0), (10, 10)), list(_boxes(boxes)), (1.0, 3.0), (7.0, 5.0),
        "the start: the paper's (3, 3) is outside of the enclosure in its text, but inside by its "
        "coordinates, so it is moved to (1, 3)",
    )  # fmt: skip


def overview() -> PaperWorld:
    """Figures 1 and 4: three ways around four obstacles."""
    boxes: list[Box] = [
        ((2.2, 0.0), (3.0, 2.3)),
        ((4.6, 1.5), (5.4, 3.2)),
        ((7.0, 2.6), (7.8, 5.0)),
    ]
    slanted = Polytope.from_vertices([(2.0, 3.2), (3.2, 3.0), (3.0, 4.3), (2.3, 4.2)])
    return _world(
        "overview", "3", "m", ((0, 0), (10, 5)), [*_boxes(boxes), slanted], (1.0, 1.2), (9.0, 3.8),
        "everything",
    )  # fmt: skip


def one_obstacle() -> PaperWorld:
    """Figure 2: a map with one obstacle in the middle."""
    block = Polytope.from_vertices([(3.0, 2.2), (6.0, 1.6), (7.2, 3.4), (4.2, 4.4)])
    return _world(
        "one obstacle", "2.2", "m", ((0, 0), (10, 6)), [block], (1.0, 1.0), (9.0, 5.0), "everything"
    )


def chain() -> PaperWorld:
    """Figure 3: four leaves in space, each with a face in common with the next."""
    boxes: list[Box] = [
        ((0, 0, 1), (1, 2, 2)),
        ((1, 1, 0), (2, 2, 2)),
        ((2, 0, 0), (3, 2, 1)),
        ((3, 0, 0), (4, 1, 2)),
    ]
    return _world(
        "chain", "3", "m", ((0, 0, 0), (4, 2, 2)), list(_boxes(boxes)), (0.25, 1.6, 0.4),
        (3.75, 1.6, 0.4), "everything",
    )  # fmt: skip


WORLDS = {"maze": maze, "passage": passage, "enclosure": enclosure}
"""Those of sections 4.1 to 4.3."""


def _world(
    name: str, section: str, unit: str, bounds: tuple[Any, Any], obstacles: list[Polytope],
    start: Any, goal: Any, made_up: str,
) -> PaperWorld:  # fmt: skip
    points = (np.array(point, dtype=np.float64) for point in (*bounds, start, goal))
    lo, hi, s, g = points
    return PaperWorld(name, section, unit, lo, hi, tuple(obstacles), s, g, made_up)


def _boxes(boxes: Sequence[Box]) -> Sequence[Polytope]:
    return [Polytope.from_box(lo, hi) for lo, hi in boxes]


def _disc(centre: tuple[float, float], radius: float, corners: int) -> Polytope:
    angle = np.arange(corners) * (2.0 * math.pi / corners)
    return Polytope.from_vertices(
        np.array(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    )


def _star(centre: tuple[float, float], radius: float) -> list[Polytope]:
    """A five-pointed star as five overlapping kites from its middle to its tips."""
    angle = math.pi / 2.0 + np.arange(10) * (math.pi / 5.0)
    reach = np.where(np.arange(10) % 2 == 0, radius, 0.45 * radius)
    rim = np.array(centre) + reach[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return [
        Polytope.from_vertices([centre, rim[k - 1], rim[k], rim[(k + 1) % 10]])
        for k in range(0, 10, 2)
    ]
