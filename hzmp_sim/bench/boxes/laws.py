"""The scenes that come with the benchmark, made by law.

The random ones and the set pieces follow the laws of the Planner Developer Tools (PDT), the
benchmark of several of the peers: a unit cube around the origin, in it boxes of sides 0.1 to 0.2,
or one obstacle that is hard in a way of its own. PDT's own draws cannot be had again without its
generator: these are other draws by the same law. Mazes are in it because planners on graphs of
convex sets are at their best there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.bench.boxes.scene import BoxScene

Boxes = list[tuple[list[float], list[float]]]
"""Lower and upper corner of each."""

HALF = 0.5
"""Half a side of the unit cube [m]."""
FLAT, SPARSE, DENSE = 35, 35, 233
"""Random boxes in 2-D, in 3-D, and in 3-D with as much of the volume filled as in 2-D (79 %)."""
_WALL = 0.1  # thickness of a maze's walls; its rooms are 1 wide
_OPENED = 0.05  # part of a maze's walls that is taken away again, for several routes


def random_boxes(n: int, count: int, seed: int) -> BoxScene:
    """Boxes of uniform centres and of sides U(0.1, 0.2) that leave start and goal free."""
    rng = np.random.default_rng([seed, count, n])
    start, goal = np.full(n, -0.1), np.full(n, 0.4)
    low, high = np.zeros((2, count, n))
    number = 0
    while number < count:
        centre, sides = rng.uniform(-HALF, HALF, n), rng.uniform(0.1, 0.2, n)
        low[number], high[number] = centre - sides / 2.0, centre + sides / 2.0
        # A box over start or goal is drawn again.
        if not any(((p >= low[number]) & (p <= high[number])).all() for p in (start, goal)):
            number += 1
    dense = "dense " if n == 3 and count == DENSE else ""
    return BoxScene(
        f"random_{n}d_{count}_s{seed}", f"{dense}random boxes, {n}-D",
        np.full(n, -HALF), np.full(n, HALF), low, high, start, goal,
    )  # fmt: skip


def solvable(scene: BoxScene) -> bool:
    """Whether start and goal are in connected leaves of our decomposition, which is exact."""
    space = scene.free_space()
    parts = space.graph.components
    mine, wanted = (parts[space.leaves_at(end)] for end in (scene.start, scene.goal))
    return bool(np.isin(mine, wanted).any())


def solvable_draws(n: int, count: int, seed: int, wanted: int) -> tuple[dict[int, BoxScene], int]:
    """The first solvable scenes from a seed on by their seeds, and how many draws were not."""
    scenes: dict[int, BoxScene] = {}
    number = seed
    while len(scenes) < wanted:
        scene = random_boxes(n, count, number)
        if solvable(scene):
            scenes[number] = scene
        number += 1
    return scenes, number - seed - wanted


# --- set pieces: obstacles by their extents in x and y; in 3-D they go all the way along z --------


def _wall(x: tuple[float, float], *stretches: tuple[float, float]) -> Boxes:
    return [([x[0], y0], [x[1], y1]) for y0, y1 in stretches]


def _center_square(n: int) -> Boxes:
    half = 0.2 if n == 2 else 0.1
    return [([-half] * n, [half] * n)]


def _dividing_walls(n: int) -> Boxes:
    gaps = [
        (-0.5 + k / 7.0, width)
        for k, width in enumerate((0.05, 0.03, 0.01, 0.01, 0.03, 0.05), start=1)
    ]
    ends = [-HALF, *(end for y, width in gaps for end in (y - width / 2, y + width / 2)), HALF]
    stretches = list(zip(ends[::2], ends[1::2], strict=True))
    walls = ((-0.25, 0.05), (0.0, 0.1), (0.25, 0.05))
    return [box for x, w in walls for box in _wall((x - w / 2, x + w / 2), *stretches)]


def _wall_gap(n: int) -> Boxes:
    return _wall((-0.1, 0.1), (-HALF, 0.08), (0.12, 0.30))


def _narrow_passage(n: int) -> Boxes:
    return _wall((-0.1, 0.1), (-HALF, 0.05), (0.15, HALF))


def _flanking_gap(n: int) -> Boxes:
    """A wall to go around, and a hole in it; in 3-D the hole is 0.01 wide both ways."""
    if n == 2:
        return _wall((-0.05, 0.05), (-0.35, 0.2), (0.23, 0.35))
    beside = [([-0.05, a, -0.4], [0.05, b, 0.4]) for a, b in ((-0.4, 0.1), (0.11, 0.4))]
    around = [([-0.05, 0.1, a], [0.05, 0.11, b]) for a, b in ((-0.4, -0.005), (0.005, 0.4))]
    return [*beside, *around]


def _double_enclosure(n: int) -> Boxes:
    """Two boxes without a lid, around start and goal, open where they turn their backs."""
    outer, inner, boxes = 0.125, 0.1, []
    for x, facing in ((-0.2, 1.0), (0.2, -1.0)):
        front = sorted((x + facing * inner, x + facing * outer))
        boxes.append(([front[0]] + [-outer] * (n - 1), [front[1]] + [outer] * (n - 1)))
        for axis, side in product(range(1, n), (-1.0, 1.0)):
            low, high = [x - outer] + [-outer] * (n - 1), [x + outer] + [outer] * (n - 1)
            low[axis], high[axis] = sorted((side * inner, side * outer))
            boxes.append((low, high))
    return boxes


_PIECES: dict[str, tuple[Callable[[int], Boxes], float, float]] = {
    "center_square": (_center_square, -0.3, 0.3),
    "dividing_walls": (_dividing_walls, -0.45, 0.45),
    "wall_gap": (_wall_gap, -0.3, 0.3),
    "narrow_passage": (_narrow_passage, -0.2, 0.2),
    "flanking_gap": (_flanking_gap, -0.2, 0.2),
    "double_enclosure": (_double_enclosure, -0.2, 0.2),
}
"""Obstacles, and the x of start and goal; these lie in the middle otherwise."""
PIECES = {2: tuple(_PIECES), 3: ("dividing_walls", "wall_gap", "flanking_gap", "double_enclosure")}
"""Set pieces that are measured, by dimension."""


def set_piece(name: str, n: int) -> BoxScene:
    """One of `PIECES` in n dimensions."""
    make, x0, x1 = _PIECES[name]
    boxes = make(n)
    tall = [([*a, -HALF][:n], [*b, HALF][:n]) for a, b in boxes]
    low, high = (np.array(ends) for ends in zip(*tall, strict=True))
    ends: Iterator[Floats] = (np.array([x, 0.0, 0.0])[:n] for x in (x0, x1))
    return BoxScene(
        f"{name}_{n}d", f"set pieces, {n}-D",
        np.full(n, -HALF), np.full(n, HALF), low, high, next(ends), next(ends),
    )  # fmt: skip


# --- mazes ----------------------------------------------------------------------------------------


def maze(side: int, seed: int) -> BoxScene:
    """Rooms 1 wide, each joined to a tree by a random walk, then some more walls opened."""
    rng = np.random.default_rng([seed, side])
    trail = [(0, 0)]
    seen, doors = {(0, 0)}, set()
    while trail:
        x, y = trail[-1]
        beside = [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]
        fresh = [r for r in beside if min(r) >= 0 and max(r) < side and r not in seen]
        if not fresh:
            trail.pop()
            continue
        room = fresh[int(rng.integers(len(fresh)))]
        doors.add(frozenset((trail[-1], room)))
        seen.add(room)
        trail.append(room)
    boxes: Boxes = []
    half = _WALL / 2.0
    for x, y in product(range(side), repeat=2):
        for other in ((x + 1, y), (x, y + 1)):
            if max(other) == side or frozenset(((x, y), other)) in doors or rng.random() < _OPENED:
                continue
            along = (x, y + 1) if other[0] > x else (x + 1, y)
            # Longer by half a thickness at both ends: walls overlap where they meet.
            boxes.append(
                (
                    [other[0] - half, other[1] - half],
                    [max(along[0], other[0]) + half, max(along[1], other[1]) + half],
                )
            )
    low, high = (np.array(ends) for ends in zip(*boxes, strict=True))
    return BoxScene(
        f"maze_{side}_s{seed}", "mazes, 2-D", np.zeros(2), np.full(2, float(side)), low, high,
        np.full(2, 0.5), np.full(2, side - 0.5),
    )  # fmt: skip


def default_scenes(seed: int, quick: bool) -> tuple[list[BoxScene], list[str]]:
    """The scenes of a run without files, and what there is to say about the draws."""
    scenes: list[BoxScene] = []
    remarks = []
    for n, count, many in ((2, FLAT, 6), (3, SPARSE, 3), (3, DENSE, 3)):
        drawn, passed = solvable_draws(n, count, seed, 1 if quick else many)
        scenes += drawn.values()
        if passed:
            remarks.append(f"{scenes[-1].group}: {passed} unsolvable draws were passed over")
    for n, names in PIECES.items():
        scenes += [set_piece(name, n) for name in (names[2:3] if quick else names)]
    scenes += [maze(side, seed) for side in ((5,) if quick else (10, 20))]
    return scenes, remarks
