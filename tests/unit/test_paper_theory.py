"""The theorems of the HZ-MP paper as experiments, on problems whose answers are known.

Numbers of theorems are those of arXiv 2507.09309 v4: lemma 3.6 (pruning), theorem 3.7
(completeness), theorem 3.8 (optimality). All seeds are fixed.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.stats import chisquare

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import PlanStatus, plan
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.planning.paper import PaperSettings, algorithm
from hzmp_planners.planning.paper.breadth_first import Candidate, find_all_connected_paths
from hzmp_planners.planning.paper.informed_faces import compute_shared_faces, generate_samples
from hzmp_planners.planning.paper.optimize import PathTable, optimize_paths
from hzmp_planners.planning.paper.reachable import Detours, ReachableSet, update_reachable_set
from hzmp_planners.planning.refine import refine
from hzmp_planners.planning.result import path_length
from hzmp_planners.planning.roadmap import Query
from hzmp_planners.sets import Activity, Polytope
from oracles import Floats, random_free_points, random_world

LONG = 60.0


def sampled_cost(space: FreeSpace, start: Any, goal: Any, samples: int, seed: int) -> float:
    """Cost after one iteration."""
    method = PaperSettings(samples=samples, iterations=1)
    found = plan(space, start, goal, gap=0.0, time_limit=LONG, seed=seed, method=method)
    return found.cost


# --- theorem 3.7: completeness --------------------------------------------------------------------


def hairline(n: int, width: float) -> FreeSpace:
    """A wall with a door of a width, across the unit cube."""
    blocks = [
        Polytope.from_box([0.4] + [-0.1] * (n - 1), [0.6, 0.7] + [1.1] * (n - 2)),
        Polytope.from_box([0.4, 0.7 + width] + [-0.1] * (n - 2), [0.6] + [1.1] * (n - 1)),
    ]
    return FreeSpace.decompose(([0] * n, [1] * n), blocks)


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("width", [1e-2, 1e-5, 1e-8])
def test_one_sample_per_face_is_enough_to_pass_any_door(n: int, width: float) -> None:
    """Theorem 3.7 has success as a limit; it is certain from the first sample on.

    Leaves are convex: any points of a sequence of shared faces, one each, are joined by a path.
    """
    space = hairline(n, width)
    start, goal = [0.1] * n, [0.9] + [0.1] * (n - 1)
    costs = [
        sampled_cost(space, start, goal, samples, seed)
        for samples in (1, 2, 8)
        for seed in range(10)
    ]
    assert np.isfinite(costs).all()


def test_uniform_samples_of_the_volume_miss_the_door_that_faces_have() -> None:
    """What the faces are for: a uniform point is in a door of width w with probability 0.2 w."""
    rng = np.random.default_rng(0)
    points = rng.random((100_000, 2))
    width = 1e-4
    held = (points[:, 0] > 0.4) & (points[:, 0] < 0.6) & (np.abs(points[:, 1] - 0.7) < width)
    assert held.sum() <= 20


# --- theorem 3.8: optimality ----------------------------------------------------------------------


def mean_excess(
    space: FreeSpace, start: Any, goal: Any, optimum: float, counts: list[int], runs: int
) -> Floats:
    means = [
        np.mean([sampled_cost(space, start, goal, N, seed) for seed in range(runs)]) for N in counts
    ]
    return np.array(means, dtype=np.float64) - optimum


def exponent(counts: list[int], excess: Floats) -> float:
    """Of a power law fitted to means."""
    return float(np.polyfit(np.log(counts), np.log(excess), 1)[0])


COUNTS = [8, 16, 32, 64, 128]


@pytest.mark.parametrize("walls", [1, 3])
def test_in_the_plane_the_excess_falls_as_one_over_the_samples(walls: int) -> None:
    """Shortest paths bend at corners, the ends of faces: there the cost is linear in the distance,
    and the nearest of N uniform samples is 1/(N+1) of the face away on average."""
    blocks = []
    for k in range(walls):
        lo, hi = (-0.1, 0.6) if k % 2 == 0 else (0.4, 1.1)
        blocks.append(Polytope.from_box([k + 0.5, lo], [k + 0.5 + 1e-3, hi]))
    space = FreeSpace.decompose(([0, 0], [walls, 1]), blocks)
    start, goal = [0.1, 0.2], [walls - 0.1, 0.2 if walls % 2 else 0.8]
    optimum = plan(space, start, goal, gap=1e-9, time_limit=LONG).cost
    excess = mean_excess(space, start, goal, optimum, COUNTS, 40)
    assert (np.diff(excess) < 0.0).all()
    assert exponent(COUNTS, excess) == pytest.approx(-1.0, abs=0.15)


def test_in_space_the_excess_falls_with_the_power_two_thirds() -> None:
    """On the edge of a face the cost is linear across it and quadratic along it: the excess is
    below e on an area of order e^(3/2), so the least of N is of order N^(-2/3)."""
    blocks = [Polytope.from_box([0.5, -0.1, -0.1], [0.5 + 1e-3, 0.6, 1.1])]
    space = FreeSpace.decompose(([0, 0, 0], [1, 1, 1]), blocks)
    start, goal = [0.1, 0.2, 0.3], [0.9, 0.2, 0.7]
    optimum = plan(space, start, goal, gap=1e-7, time_limit=LONG).cost
    excess = mean_excess(space, start, goal, optimum, COUNTS, 60)
    assert exponent(COUNTS, excess) == pytest.approx(-2.0 / 3.0, abs=0.15)


def test_where_faces_are_crossed_inside_the_excess_falls_faster() -> None:
    """A straight way through the inside of one face: quadratic in the distance, N^-2."""
    blocks = [
        Polytope.from_box([0.5, -0.1], [0.7, 0.3]),
        Polytope.from_box([0.5, 0.7], [0.7, 1.1]),
    ]
    space = FreeSpace.decompose(([0, 0], [1, 1]), blocks)
    start, goal = [0.2, 0.5], [0.6, 0.45]
    counts = [4, 8, 16, 32, 64]
    excess = mean_excess(space, start, goal, math.dist(start, goal), counts, 80)
    assert exponent(counts, excess) == pytest.approx(-2.0, abs=0.35)


def test_no_finite_number_of_samples_is_optimal() -> None:
    space = hairline(2, 0.1)
    optimum = plan(space, [0.1, 0.1], [0.9, 0.1], gap=1e-9, time_limit=LONG).cost
    costs = [sampled_cost(space, [0.1, 0.1], [0.9, 0.1], 32, seed) for seed in range(50)]
    assert min(costs) > optimum * (1.0 + 1e-6)


def test_iterations_do_what_samples_do() -> None:
    """Fresh samples in each iteration: the best of many iterations converges, too."""
    space = hairline(2, 0.1)
    start, goal = [0.1, 0.1], [0.9, 0.1]
    optimum = plan(space, start, goal, gap=1e-9, time_limit=LONG).cost
    excess = []
    for iterations in (1, 10, 100):
        method = PaperSettings(samples=8, iterations=iterations)
        costs = [
            plan(space, start, goal, gap=0.0, time_limit=LONG, seed=seed, method=method).cost
            for seed in range(8)
        ]
        excess.append(np.mean(costs) - optimum)
    assert excess[1] < 0.5 * excess[0]
    assert excess[2] < 0.5 * excess[1]


# --- lemma 3.6: pruning ---------------------------------------------------------------------------


def hard_query(seed: int, n: int) -> tuple[FreeSpace, Query, list[Candidate]]:
    """Turned boxes, with all leaf sequences from start to goal; none is in sight of the other."""
    rng = np.random.default_rng(seed)
    while True:
        world = random_world(rng, "rotated", n, 4 if n == 2 else 2)
        space = world.free_space()
        start, goal = random_free_points(rng, world, 2)
        query = Query(start, goal, space.leaves_at(start), space.leaves_at(goal))
        if np.intersect1d(query.start_leaves, query.goal_leaves).size:
            continue
        every = find_all_connected_paths(space.graph, query, None, 1500)
        if every is None or not 1 < len(every) <= 150:
            continue
        if plan(space, start, goal, gap=1e-2, time_limit=LONG).cost > 1.02 * math.dist(start, goal):
            return space, query, every


@pytest.mark.parametrize("seed", [0, 1, 4])
@pytest.mark.parametrize("n", [2, 3])
def test_pruning_never_loses_the_optimum(n: int, seed: int) -> None:
    space, query, every = hard_query(seed, n)
    graph = space.graph
    lengths = [
        path_length(refine(query.start, query.goal, graph.corners[list(path.faces)], LONG))
        for path in every
    ]
    optimum = min(lengths)
    least = least_detour(graph.corners, query.start, query.goal)[0]
    detours = Detours.of(space, query, least)
    for factor in (1.0 + 1e-9, 1.01, 1.2):
        reachable = update_reachable_set(query, factor * optimum, detours)
        for path, length in zip(every, lengths, strict=True):
            if length <= factor * optimum * (1.0 - 1e-9):
                assert (reachable.faces[list(path.faces)] != Activity.INACTIVE).all()
                assert (reachable.leaves[list(path.leaves)] != Activity.INACTIVE).all()


@pytest.mark.parametrize("seed", range(4))
def test_with_and_without_pruning_the_same_optimum_is_approached(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    space, query, _ = hard_query(seed, 2)
    optimum = plan(space, query.start, query.goal, gap=1e-9, time_limit=LONG).cost
    method = PaperSettings(samples=24, iterations=25)

    def solved() -> float:
        found = plan(space, query.start, query.goal, gap=0.0, time_limit=LONG, method=method)
        assert found.status is PlanStatus.FEASIBLE
        return found.cost

    pruned = solved()
    whole = ReachableSet.everything(space.graph)
    monkeypatch.setattr(algorithm, "update_reachable_set", lambda *_: whole)
    unpruned = solved()
    assert optimum - 1e-9 <= pruned <= 1.01 * optimum
    assert optimum - 1e-9 <= unpruned <= 1.01 * optimum


# --- the cost as a function of the waypoints ------------------------------------------------------


def cost_of(start: Floats, waypoints: Floats, goal: Floats) -> float:
    return sum(math.dist(p, q) for p, q in pairwise([start, *waypoints, goal]))


@pytest.mark.parametrize("n", [2, 3])
def test_the_cost_is_lipschitz_with_twice_the_way_that_waypoints_move(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(300):
        start, goal, *points = rng.random((2 + int(rng.integers(1, 8)), n))
        moved = points + rng.normal(0.0, 10.0 ** rng.uniform(-6, 0), (len(points), n))
        change = abs(cost_of(start, np.array(points), goal) - cost_of(start, moved, goal))
        way = float(np.linalg.norm(moved - points, axis=1).sum())
        assert change <= 2.0 * way * (1.0 + 1e-9) + 1e-14
    # Attained: a waypoint that moves away along the line on which start and goal both lie behind.
    axis = np.eye(n)[0]
    ends = -axis, -2.0 * axis
    assert cost_of(ends[0], np.array([axis]), ends[1]) - cost_of(
        ends[0], np.zeros((1, n)), ends[1]
    ) == pytest.approx(2.0)


@pytest.mark.parametrize("seed", [0, 1, 3, 4, 5])
def test_the_excess_is_at_most_twice_the_distances_of_the_nearest_samples(seed: int) -> None:
    """The bound in the proof of theorem 3.8. It needs the product of the samples of all faces."""
    space, query, every = hard_query(seed, 2 if seed % 2 else 3)
    graph = space.graph
    best = [refine(query.start, query.goal, graph.corners[list(p.faces)], LONG) for p in every]
    k = int(np.argmin([path_length(way) for way in best]))
    table = PathTable.of([every[k]])
    rng = np.random.default_rng(seed)
    for count in (1, 4, 16):
        samples = generate_samples(graph.corners[table.faces], count, rng)
        cost, _, _ = optimize_paths(query.start, query.goal, samples, table)
        apart = np.linalg.norm(samples[table.rows[0]] - best[k][1:-1, None], axis=2).min(axis=1)
        assert cost <= path_length(best[k]) + 2.0 * apart.sum() + 1e-12


# --- uniform samples ------------------------------------------------------------------------------


def turned(flat: Floats) -> Floats:
    """A polygon of the plane somewhere in space."""
    axes = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    return np.asarray(np.column_stack([flat, np.zeros(len(flat))]) @ axes.T + [0.3, -0.2, 0.5])


def ring(count: int, stretch: float) -> Floats:
    angle = np.sort(np.random.default_rng(count).uniform(0.0, 2.0 * np.pi, count))
    return np.column_stack([stretch * np.cos(angle), np.sin(angle)])


SHAPES = {
    "triangle": np.array([[0.0, 0.0], [1.0, 0.0], [0.3, 0.8]]),
    "needle": np.array([[0.0, 0.0], [1.0, 1e-6], [0.2, 1e-5]]),
    "long and thin": np.array([[0.0, 0.0], [9.0, 0.0], [9.1, 0.01], [0.2, 0.02]]),
    "five corners": np.array([[0.0, 0.0], [2.0, -0.5], [2.5, 1.0], [1.0, 2.0], [0.1, 1.5]]),
    "many corners": ring(24, 3.0),
}


def cells_of(corners: Floats) -> tuple[Floats, Floats]:
    """Triangles from the mean of a polygon to its sides, quartered; and their areas."""
    middle = corners.mean(axis=0)
    triangles = [np.array([middle, p, q]) for p, q in pairwise([*corners, corners[0]])]
    quartered = []
    for a, b, c in triangles:
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        quartered += [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    cells = np.array(quartered)
    edges = cells[:, 1:] - cells[:, :1]
    return cells, np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2.0


def counts_in(cells: Floats, points: Floats) -> Floats:
    """How many points each triangle holds: barycentric coordinates by least squares."""
    found = np.full(len(points), -1)
    most = np.full(len(points), -math.inf)
    for k, (a, b, c) in enumerate(cells):
        weights = (points - a) @ np.linalg.pinv(np.array([b - a, c - a]))
        inside = np.minimum(weights.min(axis=1), 1.0 - weights.sum(axis=1))
        better = inside > most
        found[better], most[better] = k, inside[better]
    assert most.min() >= -1e-6
    return np.bincount(found, minlength=len(cells)).astype(np.float64)


def padded(corners: Floats, width: int) -> Floats:
    return corners[np.minimum(np.arange(width), len(corners) - 1)][None]


@pytest.mark.parametrize("shape", SHAPES)
def test_samples_are_uniform_on_polygons(shape: str) -> None:
    corners = turned(SHAPES[shape])
    for width in (len(corners), len(corners) + 3):
        points = generate_samples(padded(corners, width), 20_000, np.random.default_rng(1))[0]
        cells, areas = cells_of(corners)
        expected = areas / areas.sum() * len(points)
        assert chisquare(counts_in(cells, points), expected).pvalue > 1e-3


def test_samples_are_uniform_on_segments() -> None:
    ends = np.array([[[0.2, 0.1], [1.3, -0.7]]])
    points = generate_samples(ends, 20_000, np.random.default_rng(1))[0]
    share = np.linalg.norm(points - ends[0, 0], axis=1) / math.dist(*ends[0])
    assert chisquare(np.histogram(share, 40, (0.0, 1.0))[0]).pvalue > 1e-3


def test_samples_are_uniform_on_what_the_ellipsotope_leaves_of_faces() -> None:
    space, query, _ = hard_query(0, 3)
    graph = space.graph
    least, nearest = least_detour(graph.corners, query.start, query.goal)
    cost = float(np.median(least)) * 1.1
    reachable = update_reachable_set(query, cost, Detours.of(space, query, least))
    partial = np.flatnonzero(reachable.faces == Activity.PARTIAL)
    assert len(partial) > 3
    parts = compute_shared_faces(graph, partial, reachable, nearest)
    for part in parts[:4]:
        corners = part[np.append(np.linalg.norm(np.diff(part, axis=0), axis=1) > 1e-12, True)]
        points = generate_samples(part[None], 10_000, np.random.default_rng(2))[0]
        cells, areas = cells_of(corners)
        usual = areas > 1e-3 * areas.sum()
        counts = counts_in(cells, points)
        expected = areas / areas.sum() * len(points)
        shares = [*counts[usual], counts[~usual].sum()], [*expected[usual], expected[~usual].sum()]
        rows = np.array(shares)[:, np.array(shares)[1] > 0.0]
        assert chisquare(*rows).pvalue > 1e-3
