"""Random worlds that are hard on a decomposition: coplanar, nearly coplanar, thin, crowded."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import Delaunay

from hzmp_planners.sets import Polytope
from oracles import Floats, World, random_world, rotation

JITTER = [0.0, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6]
Bodies = list[Floats]
"""Corners of each obstacle in and around the unit cube."""


def corners(low: Floats, high: Floats) -> Floats:
    n = len(low)
    unit = np.array(np.meshgrid(*[[0.0, 1.0]] * n)).reshape(n, -1).T
    return np.asarray(low + (high - low) * unit)


def prism(foot: Floats, low: float, high: float) -> Floats:
    """A polygon of the plane drawn up along the third axis."""
    ends = [np.column_stack([foot, np.full(len(foot), h)]) for h in (low, high)]
    return np.vstack(ends)


def turned(rng: np.random.Generator, n: int, share: float = 0.7) -> Floats:
    return rotation(rng, n) if rng.random() < share else np.eye(n)


def plain(kind: str, most: int) -> Callable[[np.random.Generator, int], Bodies]:
    def bodies(rng: np.random.Generator, n: int) -> Bodies:
        world = random_world(rng, kind, n, int(rng.integers(1, most)))
        return [block.vertices() for block in world.obstacles]

    return bodies


def checkerboard(rng: np.random.Generator, n: int) -> Bodies:
    """Boxes that meet in edges and corners only."""
    k, turn, shrink = int(rng.integers(2, 6 - n + 1)), turned(rng, n), rng.uniform(0.4, 1.0)
    cells = [np.array(cell) for cell in np.ndindex(*[k] * n) if sum(cell) % 2 == 0]
    return [((corners(cell / k, (cell + 1) / k) - 0.5) * shrink) @ turn.T + 0.5 for cell in cells]


def angles(rng: np.random.Generator, n: int) -> Bodies:
    """L-shapes of two boxes that overlap or touch."""
    bodies = []
    for _ in range(int(rng.integers(1, 4))):
        turn, centre, size = turned(rng, n), rng.random(n), rng.uniform(0.1, 0.4, n)
        upright, lying, foot = size.copy(), size.copy(), np.zeros(n)
        upright[0] *= 0.4
        lying[1] *= 0.4
        if rng.random() < 0.5:
            foot[0] = upright[0] - float(rng.choice(JITTER))
        for low, high in ((np.zeros(n), upright), (foot, lying)):
            bodies.append((corners(low, high) - 0.1) @ turn.T + centre)
    return bodies


def simplices(rng: np.random.Generator, n: int) -> Bodies:
    """Some simplices of a triangulation: whole facets, edges or single vertices in common."""
    points = rng.random((int(rng.integers(n + 2, 11)), n))
    if rng.random() < 0.4:
        points = np.vstack([points, corners(np.zeros(n), np.ones(n))])
    found = Delaunay(points).simplices
    found = found[rng.random(len(found)) < rng.choice([0.3, 0.6, 1.0])][:12]
    bodies = [points[simplex] for simplex in found]
    return [body for body in bodies if abs(np.linalg.det(body[1:] - body[0])) > 1e-9]


def coplanar(rng: np.random.Generator, n: int) -> Bodies:
    """Frusta on the two sides of one plane, whose feet overlap in part; perhaps a little off it."""
    turn, loose, bodies = turned(rng, n), float(rng.choice(JITTER)), []
    for _ in range(int(rng.integers(2, 6))):
        foot = rng.uniform(-0.5, 0.5, (int(rng.integers(n, n + 4)), n - 1))
        height = rng.uniform(0.05, 0.5) * rng.choice([-1.0, 1.0])
        top = foot * rng.uniform(0.3, 1.2) + rng.uniform(-0.1, 0.1, n - 1)
        rise = np.repeat([0.0, height], len(foot)) + loose * rng.uniform(-1.0, 1.0, 2 * len(foot))
        bodies.append(np.column_stack([np.vstack([foot, top]), rise]) @ turn.T + 0.5)
    return bodies


def twins(rng: np.random.Generator, n: int) -> Bodies:
    """Obstacles, and copies that differ from them by next to nothing."""
    kind, loose = str(rng.choice(["rotated", "hulls", "grid"])), float(rng.choice(JITTER))
    bodies = []
    for block in random_world(rng, kind, n, int(rng.integers(1, 4))).obstacles:
        body = block.vertices()
        bodies += [body, body + loose * rng.uniform(-1.0, 1.0, body.shape)]
    return bodies


def wedges(rng: np.random.Generator, n: int) -> Bodies:
    """Triangles and prisms with angles down to 1e-6."""
    bodies = []
    for _ in range(int(rng.integers(1, 6))):
        length, rise = rng.uniform(0.3, 1.2), 10.0 ** rng.uniform(-6.0, -1.0)
        foot = length * np.array([[0.0, 0.0], [1.0, 0.0], [rng.uniform(0.2, 1.0), rise]])
        body = foot if n == 2 else prism(foot, 0.0, rng.uniform(0.1, 0.8))
        bodies.append((body - body.mean(axis=0)) @ rotation(rng, n).T + rng.random(n))
    return bodies


def rounds(rng: np.random.Generator, n: int) -> Bodies:
    """Polygons, balls and drums with many facets."""
    bodies = []
    for _ in range(int(rng.integers(1, 4))):
        count = int(rng.integers(8, 40))
        turns = np.arange(count) / count * 2.0 * np.pi
        body = np.column_stack([np.cos(turns), np.sin(turns)])
        if n == 3 and rng.random() < 0.4:
            body = prism(body[::2], -1.0, 1.0) @ rotation(rng, 3).T
        elif n == 3:
            body = rng.standard_normal((int(rng.integers(10, 24)), 3))
            body /= np.linalg.norm(body, axis=1)[:, None]
        bodies.append(body * rng.uniform(0.05, 0.4) + rng.random(n))
    return bodies


def filled(rng: np.random.Generator, n: int) -> Bodies:
    """Boxes that fill the workspace, or nearly: gaps of the size of the tolerances."""
    cells = [(np.zeros(n), np.ones(n))]
    for _ in range(int(rng.integers(1, 9))):
        low, high = cells.pop(int(rng.integers(len(cells))))
        axis = int(rng.integers(n))
        middle = low[axis] + (high[axis] - low[axis]) * rng.uniform(0.1, 0.9)
        end, start = high.copy(), low.copy()
        end[axis] = start[axis] = middle
        cells += [(low, end), (start, high)]
    gap, holes = float(rng.choice(JITTER)), rng.random() < 0.6
    return [
        corners(low + gap * rng.integers(-1, 2, n), high + gap * rng.integers(-1, 2, n))
        for low, high in cells
        if not (holes and rng.random() < 0.3)
    ]


def flat(rng: np.random.Generator, n: int) -> Bodies:
    """Some obstacles, flat ones, points, copies and a body as thin as the tolerances."""
    bodies = plain(str(rng.choice(["rotated", "hulls", "grid"])), 5)(rng, n)
    body, points = bodies[0], rng.random((n, n))
    thin = body.copy()
    thin[:, 0] = 10.0 ** rng.uniform(-14.0, -6.0) * (thin[:, 0] - thin[0, 0]) + thin[0, 0]
    middle = body.mean(axis=0)
    bodies += [points, points[:1], points[:2], body, middle + 0.6 * (body - middle), thin]
    return [bodies[i] for i in rng.permutation(len(bodies))]


def mirrored(rng: np.random.Generator, n: int) -> Bodies:
    """A hull, with others that share a vertex, a facet or a corner with it."""
    body = plain("hulls", 2)(rng, n)[0]
    body = 0.5 + 2.0 * (body - body.mean(axis=0))
    block, bodies = Polytope.from_vertices(body), [body]
    for _ in range(int(rng.integers(1, 4))):
        apex, row = body[int(rng.integers(len(body)))], int(rng.integers(len(block.b)))
        choice = int(rng.integers(3))
        beyond = (body @ block.A[row] - block.b[row])[:, None] * block.A[row]
        bodies.append(
            (apex + (body - apex) * rng.uniform(0.2, 0.9), 2.0 * apex - body, body - 2.0 * beyond)[
                choice
            ]
        )
    return bodies


def fans(rng: np.random.Generator, n: int) -> Bodies:
    """Wedges around one edge, with gaps."""
    turn, centre, bodies = turned(rng, n), rng.uniform(0.3, 0.7, n), []
    turns = np.sort(rng.random(int(rng.integers(3, 9)))) * 2.0 * np.pi
    for start, stop in zip(turns, np.append(turns[1:], turns[0] + 2.0 * np.pi), strict=True):
        if rng.random() < 0.4 or not 1e-3 < stop - start < np.pi - 1e-3:
            continue
        foot = 0.5 * np.array(
            [[0.0, 0.0], [np.cos(start), np.sin(start)], [np.cos(stop), np.sin(stop)]]
        )
        body = foot if n == 2 else prism(foot, -0.3, rng.uniform(0.0, 1.2))
        bodies.append(body @ turn.T + centre)
    return bodies


def diagonal(rng: np.random.Generator, n: int) -> Bodies:
    """Boxes and octahedra turned by exactly 45 degrees, on a coarse grid."""
    bodies = []
    for _ in range(int(rng.integers(1, 6))):
        centre, reach = rng.integers(0, 7, n) / 6.0, rng.integers(1, 3) / 6.0
        body = np.vstack([np.eye(n), -np.eye(n)])
        if n == 3 and rng.random() < 0.5:
            body = prism(np.vstack([np.eye(2), -np.eye(2)]), -1.0, 1.0)[:, rng.permutation(3)]
        bodies.append(centre + reach * body)
    return bodies


KINDS: dict[str, Callable[[np.random.Generator, int], Bodies]] = {
    **{kind: plain(kind, 8) for kind in ("grid", "loose grid", "rotated", "hulls", "slivers")},
    "checkerboard": checkerboard, "angles": angles, "simplices": simplices, "coplanar": coplanar,
    "twins": twins, "wedges": wedges, "rounds": rounds, "filled": filled, "flat": flat,
    "mirrored": mirrored, "fans": fans, "diagonal": diagonal,
}  # fmt: skip


def fuzz_bodies(seed: int) -> tuple[str, Bodies, Floats, Floats, np.random.Generator]:
    """Kind, corners of obstacles, and a workspace for the seed."""
    rng = np.random.default_rng(seed)
    kind, n = list(KINDS)[seed % len(KINDS)], 2 + seed // len(KINDS) % 2
    bodies = KINDS[kind](rng, n)
    size = 10.0 ** rng.uniform(-3.0, 3.0) if rng.random() < 0.7 else 1.0
    lo = np.zeros(n)
    place = rng.random()
    if place < 0.2:
        lo = rng.uniform(-1.0, 1.0, n) * size * 10.0 ** rng.uniform(0.0, 3.0)
    elif place < 0.5:
        lo = -rng.random(n) * size
    return kind, bodies, lo, lo + size, rng


def fuzz_world(seed: int) -> World:
    """One of the worlds, 1 mm to 1 km wide, some far from the origin; kinds take turns."""
    _, bodies, lo, hi, _ = fuzz_bodies(seed)
    return World(lo, hi, [Polytope.from_vertices(lo + body * (hi - lo)) for body in bodies])
