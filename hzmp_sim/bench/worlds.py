"""Worlds to measure: random obstacles at a constant density, grids of squares, scene files.

One seed gives one world on every machine. A random world has one obstacle per unit of volume (area
in 2-D), so that more obstacles make it larger and not denser. Obstacles stick out of the workspace
and overlap one another; how much, their sizes say.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import SceneError
from hzmp_planners.sets import Polytope

Maker = Callable[[int, np.random.Generator], list[Polytope]]
"""Makes so many obstacles in the cube from 0 to `side_of` their count."""


@dataclass(frozen=True)
class World:
    """A workspace box and convex obstacles."""

    name: str
    lo: Floats
    """Lower corner of the workspace, shape (n,) [m]."""
    hi: Floats
    """Upper corner of the workspace, shape (n,) [m]."""
    obstacles: tuple[Polytope, ...]

    @property
    def n(self) -> int:
        """Dimension, 2 or 3."""
        return int(self.lo.size)

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Corners of the workspace, each (n,) [m]."""
        return self.lo, self.hi


@dataclass(frozen=True)
class WorldSpec:
    """Which world: what makes it again in another process."""

    family: str
    """One of `FAMILIES`, "squares" or "scene"."""
    count: int
    """Number of obstacles; a square number for "squares"."""
    seed: int = 0
    path: str = ""
    """The file of a scene."""

    def make(self) -> World:
        """The world.

        Raises:
            SceneError: a scene file that cannot be read.
        """
        if self.family == "scene":
            return read_scene(Path(self.path))
        if self.family == "squares":
            return squares(round(self.count**0.5))
        return random_world(self.family, self.count, self.seed)


@dataclass(frozen=True)
class Family:
    """A kind of random world, of any number of obstacles."""

    title: str
    n: int
    make: Maker


def side_of(count: int, n: int) -> float:
    """Side of a workspace with one obstacle per unit of volume [m]."""
    return float(count ** (1.0 / n))


def boxes(n: int, sides: tuple[float, float]) -> Maker:
    """Axis-aligned boxes, their sides (least, most) [m] and their centres drawn uniformly."""

    def make(count: int, rng: np.random.Generator) -> list[Polytope]:
        centres = rng.uniform(0.0, side_of(count, n), (count, n))
        reach = rng.uniform(0.5 * sides[0], 0.5 * sides[1], (count, n))
        return [Polytope.from_box(c - r, c + r) for c, r in zip(centres, reach, strict=True)]

    return make


def turned(sides: tuple[float, float]) -> Maker:
    """Boxes, and hulls of 8 to 16 random points of such boxes, by turns; all turned at random."""

    def make(count: int, rng: np.random.Generator) -> list[Polytope]:
        corners = np.array(list(product((-1.0, 1.0), repeat=3)))
        obstacles = []
        for number in range(count):
            centre = rng.uniform(0.0, side_of(count, 3), 3)
            reach = rng.uniform(0.5 * sides[0], 0.5 * sides[1], 3)
            inner = rng.uniform(-1.0, 1.0, (int(rng.integers(8, 17)), 3))
            points = inner if number % 2 else corners
            obstacles.append(Polytope.from_vertices(centre + (points * reach) @ rotation(rng).T))
        return obstacles

    return make


def rotation(rng: np.random.Generator) -> Floats:
    """An orthogonal matrix, shape (3, 3), uniform among all."""
    Q, R = np.linalg.qr(rng.standard_normal((3, 3)))
    return np.asarray(Q * np.sign(np.diagonal(R)))


def _sides(count: int, n: int) -> tuple[float, float]:
    """Sides as of `count` boxes of 0.1 to 0.2 in a unit cube, in units of our workspaces."""
    return 0.1 * side_of(count, n), 0.2 * side_of(count, n)


SPARSE = _sides(35, 3)
"""The boxes' volumes add up to 12 % of the workspace."""
DENSE = _sides(233, 3)
"""They add up to 79 %."""
FLAT = _sides(35, 2)
"""Their areas add up to 79 %."""

FAMILIES: Mapping[str, Family] = {
    "turned": Family("turned boxes and hulls, 3-D", 3, turned(SPARSE)),
    "boxes": Family("boxes, 3-D", 3, boxes(3, SPARSE)),
    "dense": Family("dense boxes, 3-D", 3, boxes(3, DENSE)),
    "flat": Family("boxes, 2-D", 2, boxes(2, FLAT)),
}


def random_world(family: str, count: int, seed: int) -> World:
    """A world of a family; one seed gives unrelated worlds for different counts and families."""
    kind = FAMILIES[family]
    rng = np.random.default_rng([seed, count, list(FAMILIES).index(family)])
    hi = np.full(kind.n, side_of(count, kind.n))
    return World(kind.title, np.zeros(kind.n), hi, tuple(kind.make(count, rng)))


def squares(per_side: int, width: float = 0.01) -> World:
    """A grid of equal squares in a unit square: the world "repeating rectangles".

    Args:
        per_side: how many squares there are along each axis; they make an even grid.
        width: side of each square [m].
    """
    centres = -0.5 + np.arange(1, per_side + 1) / (per_side + 1)
    obstacles = [
        Polytope.from_box(np.array(centre) - width / 2.0, np.array(centre) + width / 2.0)
        for centre in product(centres.tolist(), repeat=2)
    ]
    return World("squares on a grid, 2-D", np.full(2, -0.5), np.full(2, 0.5), tuple(obstacles))


def read_scene(path: Path) -> World:
    """A world from a scene file (JSON): "bounds" and "obstacles", each with "lo" and "hi" [m].

    Raises:
        SceneError: the file cannot be read, or is none of these.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        lo, hi = (np.array(data["bounds"][end], dtype=np.float64) for end in ("lo", "hi"))
        obstacles = [Polytope.from_box(box["lo"], box["hi"]) for box in data["obstacles"]]
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise SceneError(
            f"scene file {path} cannot be used ({error}); it must be a JSON object with the boxes "
            '"bounds" and "obstacles": {"lo": [x, y], "hi": [x, y]}'
        ) from error
    return World(path.stem, lo, hi, tuple(obstacles))
