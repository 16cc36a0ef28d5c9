"""Independent answers that tests compare the planners with: linear programs, grids, visibility."""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import ConvexHull, HalfspaceIntersection

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope

Floats = NDArray[np.float64]
SCENES = Path(__file__).parent / "data" / "scenes"


@dataclass(frozen=True)
class World:
    """A workspace box and convex obstacles."""

    lo: Floats
    hi: Floats
    obstacles: list[Polytope]

    @property
    def n(self) -> int:
        return self.lo.size

    @property
    def scale(self) -> float:
        return max(1.0, float(np.abs([self.lo, self.hi]).max()))

    def free_space(self) -> FreeSpace:
        return FreeSpace.decompose((self.lo, self.hi), self.obstacles)


@dataclass(frozen=True)
class Scene(World):
    """A world of `data/scenes` with its query and what is known about its optimum."""

    start: Floats
    goal: Floats
    cost: float


def load_scene(name: str) -> Scene:
    data = json.loads((SCENES / f"{name}.json").read_text())
    boxes = [Polytope.from_box(box["lo"], box["hi"]) for box in data["obstacles"]]
    lo, hi = np.array(data["bounds"]["lo"]), np.array(data["bounds"]["hi"])
    cost = data.get("optimum", {}).get("cost", np.nan)
    return Scene(lo, hi, boxes, np.array(data["start"]), np.array(data["goal"]), cost)


def rotation(rng: np.random.Generator, n: int) -> Floats:
    return np.asarray(np.linalg.qr(rng.standard_normal((n, n)))[0])


def random_world(
    rng: np.random.Generator, kind: str, n: int, count: int, size: float = 1.0
) -> World:
    """Obstacles in and around the cube [0, size]^n.

    Kinds: "grid" (boxes on a coarse grid: touching, nested, on and across the walls, one repeated),
    "loose grid" (the same turned, each corner off by 1e-13 to 1e-7), "rotated" (boxes), "hulls" (of
    random points), "slivers" (rotated boxes down to 1e-6 thin).
    """
    obstacles: list[Polytope] = []
    if kind == "loose grid":
        turn, loose = rotation(rng, n), 10.0 ** rng.uniform(-13.0, -7.0)
        for _ in range(count):
            low = rng.integers(-1, 6, n) / 6.0
            body = Polytope.from_box(low, low + rng.integers(1, 4, n) / 6.0).vertices()
            body = body + loose * rng.uniform(-1.0, 1.0, body.shape) - 0.5
            obstacles.append(Polytope.from_vertices((0.5 + body @ turn.T) * size))
        return World(np.zeros(n), np.full(n, size), obstacles)
    for _ in range(count):
        if kind == "grid":
            corner = rng.integers(-1, 6, n)
            obstacles.append(
                Polytope.from_box(
                    corner / 6.0 * size, (corner + rng.integers(1, 4, n)) / 6.0 * size
                )
            )
            continue
        centre, reach = rng.random(n), 0.05 + 0.2 * rng.random(n)
        if kind == "hulls":
            points = rng.uniform(-1.0, 1.0, (int(rng.integers(n + 1, 4 * n)), n))
        else:
            points = np.array(np.meshgrid(*[[-1.0, 1.0]] * n)).reshape(n, -1).T
            if kind == "slivers":
                reach[0] = 10.0 ** rng.uniform(-6.0, -2.0)
        body = (points * reach) @ rotation(rng, n).T
        obstacles.append(Polytope.from_vertices((centre + body) * size))
    if kind == "grid":
        obstacles.append(obstacles[0])
    return World(np.zeros(n), np.full(n, size), obstacles)


def minimum(
    cost: Floats, A: Floats, b: Floats, equal: tuple[Floats, Floats] | None = None
) -> tuple[float, Floats] | None:
    """Least cost.x with A x <= b, and where; None when there is no such x."""
    E, e = equal or (None, None)
    # The default tolerance, 1e-7, is wider than what is compared here: the last resort.
    attempts: tuple[tuple[Literal["highs", "highs-ipm"], float], ...] = (
        ("highs", 1e-10),
        ("highs-ipm", 1e-10),
        ("highs-ipm", 1e-7),
    )
    for method, strict in attempts:
        result = linprog(
            cost,
            A,
            b,
            E,
            e,
            bounds=(None, None),
            method=method,
            options={"primal_feasibility_tolerance": strict, "dual_feasibility_tolerance": strict},
        )
        if result.status == 2:
            return None
        if result.status == 0 and result.fun is not None:
            return float(result.fun), np.asarray(result.x)
    raise AssertionError("no verdict on a linear program")


def largest_ball(A: Floats, b: Floats) -> tuple[float, Floats]:
    """Radius (negative: how far the half-spaces are from meeting) and centre; unit rows."""
    n = A.shape[1]
    size = max(1.0, float(np.abs(b).max()))
    rows = np.hstack([A, np.ones((len(b), 1))])
    found = minimum(np.append(np.zeros(n), -1.0), rows, b / size)
    assert found is not None
    return float(found[1][-1]) * size, found[1][:n] * size


def overlap(one: Polytope, two: Polytope) -> float:
    """Radius of the largest ball in both polytopes [m]; negative when they are apart."""
    return largest_ball(np.vstack([one.A, two.A]), np.concatenate([one.b, two.b]))[0]


def halfspace_volume(A: Floats, b: Floats) -> float:
    """Volume of {A x <= b} from the half-spaces alone."""
    radius, centre = largest_ball(A, b)
    if radius <= max(1e-12, 1e-8 * float(np.abs(b).max())):  # thinner than the program can tell
        return 0.0
    local = HalfspaceIntersection(
        np.column_stack([A, -(b - A @ centre) / radius]), np.zeros(A.shape[1])
    )
    return float(ConvexHull(local.intersections).volume * radius ** A.shape[1])


def union_volume(world: World) -> float:
    """Volume of the obstacles' union inside the box, by inclusion and exclusion."""
    n = world.n
    box_A, box_b = np.vstack([np.eye(n), -np.eye(n)]), np.concatenate([world.hi, -world.lo])
    total = 0.0
    # Sets of obstacles with a common interior: larger sets grow from these only.
    live: list[tuple[int, ...]] = [()]
    for order in range(1, len(world.obstacles) + 1):
        known, live = set(live), []
        for group in combinations(range(len(world.obstacles)), order):
            if group[:-1] not in known:
                continue
            A = np.vstack([box_A, *(world.obstacles[i].A for i in group)])
            b = np.concatenate([box_b, *(world.obstacles[i].b for i in group)])
            volume = halfspace_volume(A, b)
            if volume > 0.0:
                live.append(group)
                total += volume if order % 2 else -volume
    return total


def free_box_volume(world: World) -> float:
    """Free volume among axis-aligned boxes, cell by cell of the grid of all their coordinates."""
    lows = np.array([block.vertices().min(axis=0) for block in world.obstacles])
    highs = np.array([block.vertices().max(axis=0) for block in world.obstacles])
    axes = [
        np.unique(
            np.clip([world.lo[k], world.hi[k], *lows[:, k], *highs[:, k]], world.lo[k], world.hi[k])
        )
        for k in range(world.n)
    ]
    middles = np.stack(np.meshgrid(*[(a[1:] + a[:-1]) / 2 for a in axes], indexing="ij"), axis=-1)
    cells = np.ones(middles.shape[:-1])
    for k, axis in enumerate(axes):
        shape = [1] * world.n
        shape[k] = -1
        cells = cells * np.diff(axis).reshape(shape)
    inside = ((middles[..., None, :] > lows) & (middles[..., None, :] < highs)).all(-1).any(-1)
    return float(cells[~inside].sum())


def contact_dimension(one: Polytope, two: Polytope, tol: float) -> int:
    """Dimension of the common set of two polytopes; -1 when they are apart.

    As long as the set has an extent at right angles to the directions found, it has one more.
    """
    A, b = np.vstack([one.A, two.A]), np.concatenate([one.b, two.b]) + tol
    n = A.shape[1]
    found = np.zeros((0, n))
    untried = np.linalg.svd(np.random.default_rng(0).standard_normal((n, n)))[2]
    while len(untried):
        low, high = minimum(untried[0], A, b), minimum(-untried[0], A, b)
        if low is None or high is None:
            return -1
        across = high[1] - low[1]
        if across @ untried[0] > 1e3 * tol:
            across = across - found.T @ (found @ across)
            found = np.vstack([found, across / np.linalg.norm(across)])
            untried = np.linalg.svd(found)[2][len(found) :]
        else:
            untried = untried[1:]
    return len(found)


def depth_in_obstacles(world: World, X: Floats) -> Floats:
    """How deep each point (k, n) is inside the obstacles [m]; negative: at least so far outside."""
    depths = [(block.b - X @ block.A.T).min(axis=1) for block in world.obstacles]
    return np.asarray(np.max(depths, axis=0))


def random_free_points(rng: np.random.Generator, world: World, count: int) -> Floats:
    """Points at least a thousandth of the box away from obstacles' facets."""
    points: list[Floats] = []
    size = world.hi - world.lo
    while len(points) < count:
        x = world.lo + (0.01 + 0.98 * rng.random(world.n)) * size
        if depth_in_obstacles(world, x[None])[0] < -1e-3 * size.max():
            points.append(x)
    return np.array(points)


def shortest_length(world: World, start: Floats, goal: Floats) -> float:
    """Length of the shortest path in the plane by a visibility graph; inf when there is none.

    A segment is blocked when some part of it is inside a polygon by more than round-off. Corners
    where polygons cross are no nodes: they are concave for the free space.
    """
    eps = 1e-11 * world.scale
    corners = [start[None], goal[None]]
    corners += [block.vertices() for block in world.obstacles]
    nodes = np.vstack(corners)
    within = ((nodes >= world.lo - eps) & (nodes <= world.hi + eps)).all(axis=1)
    nodes = nodes[within & (depth_in_obstacles(world, nodes) <= eps)]
    i, j = np.triu_indices(len(nodes), 1)
    seen = np.ones(len(i), dtype=np.bool_)
    for block in world.obstacles:
        # Where along p + t (q - p) every half-space is satisfied strictly.
        at_p = block.b - eps - nodes[i] @ block.A.T
        fall = (nodes[j] - nodes[i]) @ block.A.T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = at_p / fall
        enter = np.where(fall < 0.0, t, np.where(fall > 0.0, -np.inf, 0.0)).max(axis=1)
        leave = np.where(fall > 0.0, t, np.inf).min(axis=1)
        never = ((fall == 0.0) & (at_p <= 0.0)).any(axis=1)
        seen &= never | (np.minimum(leave, 1.0) <= np.maximum(enter, 0.0))
    i, j = i[seen], j[seen]
    lengths = np.linalg.norm(nodes[i] - nodes[j], axis=1)
    graph = csr_array((lengths, (i, j)), shape=(len(nodes), len(nodes)))
    return float(dijkstra(graph, directed=False, indices=[0])[0, 1])
