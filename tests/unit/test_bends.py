"""Bend graphs hold every taut string: their bounds never exceed the length of a free path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import plan
from hzmp_planners.planning.bends.bend_graph import BendGraphs, BendWorld, never_joined
from hzmp_planners.planning.bends.blockers import build_blockers
from hzmp_planners.planning.bends.edges import obstacle_edges
from hzmp_planners.planning.bends.exposure import exposed_edges
from hzmp_planners.planning.bends.sight import Sight
from hzmp_planners.planning.clock import Clock, finished
from hzmp_planners.planning.relaxation import solve_relaxation
from hzmp_planners.sets import Polytope
from oracles import Floats, World, depth_in_obstacles, random_free_points, random_world, rotation

_MOST_PAIRS = 800  # of a relaxation: the tests stay fast
CUBE = (np.zeros(3), np.ones(3))


def pyramid(sides: int, height: float, below: float = 0.0) -> Floats:
    """Corners of a pyramid on a regular polygon of radius 1, or a lens of two of them."""
    turns = np.arange(sides) / sides * 2.0 * np.pi
    foot = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(sides)])
    tips = [[0.0, 0.0, height]] + ([[0.0, 0.0, -below]] if below else [])
    return np.vstack([foot, tips])


def raw_bounds(space: FreeSpace, start: Floats, goal: Floats, threshold: float) -> list[float]:
    """Bounds of the bend graphs alone: nobody takes the least of them and a path's length."""
    graphs = BendGraphs(BendWorld(space), start, goal, Clock())
    graph, bounds = finished(graphs.build(threshold)), [0.0]
    while graph is not None and len(bounds) < 5 and len(graph.pairs) < _MOST_PAIRS:
        if not len(graph.pairs):
            return [*bounds, threshold]
        relaxation = solve_relaxation(graph, threshold, 10.0)
        assert relaxation is not None
        bounds.append(relaxation.certificate.bound())
        kept = relaxation.certificate.least_through() < threshold
        cuts = graphs.loose_points(relaxation)
        pruned = replace(graph, pairs=graph.pairs[kept])
        graph = finished(graphs.divide(pruned, cuts, threshold))
    return bounds


def boxes_on_a_grid(rng: np.random.Generator) -> list[Polytope]:
    lows = rng.integers(-1, 4, (int(rng.integers(2, 7)), 3))
    return [Polytope.from_box(low / 4, (low + rng.integers(1, 4, 3)) / 4) for low in lows]


def bodies(kind: str) -> Callable[[np.random.Generator], list[Polytope]]:
    def drawn(rng: np.random.Generator) -> list[Polytope]:
        return random_world(rng, kind, 3, int(rng.integers(2, 7))).obstacles

    return drawn


def pyramids(rng: np.random.Generator) -> list[Polytope]:
    found = []
    for _ in range(int(rng.integers(1, 4))):
        body = pyramid(int(rng.integers(4, 8)), rng.uniform(0.3, 2.0), rng.choice([0.0, 1.0]))
        body = 0.35 * body @ rotation(rng, 3).T + rng.uniform(0.2, 0.8, 3)
        found.append(Polytope.from_vertices(body))
    return found


def slabs(rng: np.random.Generator) -> list[Polytope]:
    """Plates that stick out of the workspace: strings slide along edges into the walls."""
    corners = np.array(list(product(*[[-1.0, 1.0]] * 3))) * [0.05, 0.6, 0.6]
    return [Polytope.from_vertices(corners @ rotation(rng, 3).T + rng.random(3)) for _ in range(3)]


WORLDS = {
    "grid": boxes_on_a_grid, "loose grid": bodies("loose grid"), "rotated": bodies("rotated"),
    "hulls": bodies("hulls"), "pyramids": pyramids, "slabs": slabs,
}  # fmt: skip


def on_surface(rng: np.random.Generator, space: FreeSpace) -> Floats:
    """A free vertex, or a free point on an edge or facet of an obstacle."""
    while True:
        block = space.obstacles[int(rng.integers(len(space.obstacles)))]
        on = block.vertices()[block.incidence[:, int(rng.integers(len(block.b)))]]
        weights = rng.dirichlet(np.ones(len(on))) * (rng.permutation(len(on)) < rng.integers(1, 4))
        x = np.clip(weights @ on / max(float(weights.sum()), 1e-9), *space.bounds)
        if len(space.leaves_at(x)):
            return np.asarray(x)


@pytest.mark.parametrize("kind", WORLDS)
def test_no_bound_exceeds_the_length_of_a_path(kind: str) -> None:
    """The threshold is above the path's length, so that the path itself must be in the graphs."""
    rng = np.random.default_rng(2)
    bent = 0
    for trial in range(40):
        world = World(*CUBE, WORLDS[kind](rng))
        space = world.free_space()
        start, goal = random_free_points(rng, world, 2)
        if trial % 2:
            start, goal = on_surface(rng, space), on_surface(rng, space)
        result = plan(space, start, goal, time_limit=1.0, gap=1e-2)
        if np.isfinite(result.cost) and result.cost > 1.0001 * np.linalg.norm(goal - start):
            bent += 1
            bounds = raw_bounds(space, start, goal, 1.02 * result.cost)
            assert max(bounds) <= result.cost * (1.0 + 1e-7), (trial, bounds, result.cost)
            if bent == 4:
                return
    raise AssertionError(f"only {bent} paths bend")


@pytest.mark.parametrize("height", [1e-2, 1e-5, 1e-7, 2e-8, 4e-9])
def test_strings_bend_over_the_flat_ridges_and_sharp_rims_of_lenses(height: float) -> None:
    """Near such edges heights above facets are next to nothing although the line is far away."""
    rng = np.random.default_rng(0)
    for _ in range(3):
        turn = rotation(rng, 3)
        lens = Polytope.from_vertices(0.5 + 0.35 * pyramid(7, height, 0.6 * height) @ turn.T)
        space = FreeSpace.decompose(CUBE, [lens])
        start = 0.5 + turn @ [*rng.uniform(-0.15, 0.15, 2), 0.2]
        goal = lens.vertices()[-1]
        if goal @ turn[:, 2] > 0.5 * turn[:, 2].sum():
            start = 0.5 - (start - 0.5)
        result = plan(space, start, goal, time_limit=1.0, gap=1e-2)
        bounds = raw_bounds(space, start, goal, 1.02 * result.cost)
        assert max(bounds) <= result.cost * (1.0 + 1e-7), (bounds, result.cost)


def test_boxes_have_twelve_edges_and_an_apex_is_a_node_of_its_own() -> None:
    box = obstacle_edges([Polytope.from_box([0.0, 0.0, 0.0], [1.0, 2.0, 3.0])])
    assert len(box) == 12
    assert np.linalg.norm(box.ends[:, 1] - box.ends[:, 0], axis=1).sum() == pytest.approx(24.0)
    for ends, normals in zip(box.ends, box.normals, strict=True):
        assert normals @ (ends[1] - ends[0]) == pytest.approx([0.0, 0.0])
    both = obstacle_edges([Polytope.from_vertices(pyramid(5, 1.0)), *[Polytope.from_box(*CUBE)]])
    vertices = ~both.normals.any(axis=(1, 2))
    assert len(both) == 10 + 1 + 12
    assert both.ends[vertices].tolist() == [[[0.0, 0.0, 1.0]] * 2]


@pytest.mark.parametrize("height", [1e-2, 1e-6, 1e-8, 4e-9])
def test_obstacles_as_thin_as_the_tolerances_keep_their_edges(height: float) -> None:
    """There vertices are near facets that they do not belong to."""
    sides = 16
    body = 0.5 + 0.35 * pyramid(sides, height, 0.6 * height)
    edges = obstacle_edges([Polytope.from_vertices(body)])
    for one in range(sides):
        rim = body[[one, (one + 1) % sides]]
        ends = np.stack([edges.ends, edges.ends[:, ::-1]])
        assert np.abs(ends - rim).max(axis=(2, 3)).min() < 1e-12, one


def test_edges_end_at_other_obstacles_walls_and_the_informed_set() -> None:
    rod = Polytope.from_box([-1.0, 0.4, 0.4], [2.0, 0.6, 0.6])
    sleeve = Polytope.from_box([0.3, 0.2, 0.2], [0.5, 0.8, 0.8])
    end = Polytope.from_box([0.5, 0.2, 0.2], [0.6, 0.8, 0.8])
    blocks = [rod, sleeve, end]
    edges, blockers = obstacle_edges(blocks), build_blockers(blocks)
    foci = (np.array([0.1, 0.5, 0.9]), np.array([0.8, 0.5, 0.9]))
    found = exposed_edges(edges, blockers, CUBE, foci, 1e3, 1.0)
    along = found.ends[(found.owner == 0), :, 0]
    parts = sorted({tuple(np.round(np.sort(part), 7).tolist()) for part in along})
    # Where sleeve and end touch a string could pass: obstacles are open.
    assert parts == [(0.0, 0.3), (0.5, 0.5), (0.6, 1.0)]
    near = exposed_edges(edges, blockers, CUBE, foci, 1.2, 1.0)
    assert len(near) < len(found)
    detours = sum(np.linalg.norm(near.ends - focus, axis=2) for focus in foci)
    assert np.max(detours) <= 1.2 + 1e-8


def test_what_is_hidden_sees_nothing() -> None:
    rng = np.random.default_rng(0)
    share = np.linspace(0.0, 1.0, 60)[:, None]
    count = 0
    for _ in range(20):
        world = random_world(rng, "rotated", 3, 6)
        pieces = rng.random((12, 1, 3)) + 0.3 * rng.uniform(-1.0, 1.0, (12, 2, 3))
        pairs = np.array(list(product(range(6), range(6, 12))))
        sight = Sight(pieces, build_blockers(world.obstacles), 1e-9)
        for i, j in pairs[sight.hidden(pairs)].tolist():
            x, z = (w[0] + rng.random() * (w[1] - w[0]) for w in pieces[[i, j]])
            assert depth_in_obstacles(world, x + share * (z - x)).max() > -0.05
            count += 1
    assert count > 20


def test_strings_leave_an_edge_above_one_facet_and_below_the_other() -> None:
    edge = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    normals = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    others = {
        "above both": ([1.0, 1.0, 0.0], True),
        "below both": ([-1.0, -1.0, 0.0], True),
        "around": ([1.0, -1.0, 0.0], False),
        "along a facet": ([0.0, -1.0, 0.0], False),
        "on the line": ([0.0, 0.0, 2.0], True),
        "nearly on the line": ([1e-10, -1e-10, 2.0], False),
    }
    for name, (point, never) in others.items():
        pieces = np.array([edge, [point, np.add(point, [0.0, 0.0, 0.5])]])
        both = np.array([normals, np.zeros((2, 3))])
        for pair in ([0, 1], [1, 0]):
            found = never_joined(pieces, both, np.array([pair]), 1.0)
            # The other piece is on no edge here, except that its own line may hold the edge.
            assert found.tolist() == [never], name
