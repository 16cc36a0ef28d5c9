"""Strings over sampled lines of sight find the shortest way around obstacles in 3-D."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from hzmp_planners._arrays import Ints
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import PlanStatus, plan, verify
from hzmp_planners.planning.bends.bend_graph import BendGraphs, BendWorld
from hzmp_planners.planning.bends.strings import _hidden, _sampled, _shortest
from hzmp_planners.planning.clock import Clock, finished
from hzmp_planners.sets import Polytope
from oracles import Floats, World, depth_in_obstacles, random_free_points, random_world

CUBE = (np.zeros(3), np.ones(3))


def nothing(*_: object) -> Iterator[None]:
    yield from ()


@pytest.fixture
def strings_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """After the first path nothing but strings improves the route."""
    for step in ("explore", "prove", "_prove_over_faces"):
        monkeypatch.setattr(f"hzmp_planners.planning.strategy.{step}", nothing)
    monkeypatch.setattr("hzmp_planners.planning.strategy._FEW_PAIRS", 0)


def crossed(rng: np.random.Generator, kind: str) -> tuple[FreeSpace, Floats, Floats]:
    """A world, and a start and a goal that do not see each other."""
    while True:
        world = random_world(rng, kind, 3, 12)
        space = world.free_space()
        start, goal = random_free_points(rng, world, 2)
        apart = np.linalg.norm(goal - start) > 0.5
        if apart and space.trace([start, goal]) is None and joined(space, start, goal):
            return space, start, goal


def world_of(space: FreeSpace) -> World:
    return World(*space.bounds, list(space.obstacles))


def joined(space: FreeSpace, start: Floats, goal: Floats) -> bool:
    return plan(space, start, goal, time_limit=0.5, gap=10.0).status is not PlanStatus.INFEASIBLE


def test_way_over_a_wall_is_exact_at_once(strings_only: None) -> None:
    wall = Polytope.from_box([0.4, -1.0, -1.0], [0.6, 2.0, 0.8])
    space = FreeSpace.decompose(CUBE, [wall])
    found = plan(space, [0.1, 0.5, 0.5], [0.9, 0.5, 0.5], time_limit=10.0, gap=1e-9)
    assert found.cost == pytest.approx(2.0 * np.hypot(0.3, 0.3) + 0.2, rel=1e-9)


@pytest.mark.parametrize("kind", ["rotated", "hulls"])
def test_strings_alone_find_the_optimum(kind: str, request: pytest.FixtureRequest) -> None:
    rng = np.random.default_rng(3)
    queries = [crossed(rng, kind) for _ in range(6)]
    best = [plan(*query, time_limit=10.0, gap=1e-5) for query in queries]
    request.getfixturevalue("strings_only")
    found = [plan(*query, time_limit=10.0, gap=1e-5) for query in queries]
    ratios = [few.cost / least.cost for few, least in zip(found, best, strict=True)]
    first = [few.history[0][1] / least.cost for few, least in zip(found, best, strict=True)]
    assert max(ratios) < 1.0 + 1e-4
    assert max(first) > 1.01
    assert all(verify(few).ok for few in found)


def test_lines_of_sight_are_tested_exactly_and_the_shortest_string_comes_first() -> None:
    rng = np.random.default_rng(8)
    stopped = free = 0
    for _ in range(6):
        space, start, goal = crossed(rng, "rotated")
        graphs = BendGraphs(BendWorld(space), start, goal, Clock())
        graph = finished(graphs.build(1.3 * float(np.linalg.norm(goal - start))))
        assert graph is not None
        lines = _sampled(graph, graph.pairs, 3)
        hidden = finished(_hidden(lines, graphs, Clock()))
        for line in rng.permutation(len(hidden))[:40].tolist():
            p, q = lines.points[lines.links[line]]
            on = p + np.linspace(0.0, 1.0, 2001)[:, None] * (q - p)
            depth = float(depth_in_obstacles(world_of(space), on).max())
            assert depth < 1e-6 or hidden[line]
            assert depth > 0.0 or not hidden[line]
            stopped, free = stopped + int(hidden[line]), free + int(not hidden[line])
        seen = lines.take(~hidden)
        strings = list(_shortest(seen))
        lengths = [np.linalg.norm(np.diff(points, axis=0), axis=1).sum() for points, _ in strings]
        assert len({pieces for _, pieces in strings}) == len(strings)
        assert lengths == sorted(lengths)
        if strings:
            assert lengths[0] == pytest.approx(shortest_way(seen.links, seen.lengths, 3), rel=1e-12)
            assert np.array_equal(strings[0][0][[0, -1]], [start, goal])
    assert stopped
    assert free


def shortest_way(links: Ints, lengths: Floats, samples: int) -> float:
    """From the first sample of node 0 to that of node 1, by relaxing all lines until none gains."""
    cost = np.full(int(links.max()) + 1, np.inf)
    cost[0], before = 0.0, None
    while before is None or (cost < before).any():
        before = cost.copy()
        np.minimum.at(cost, links[:, 1], cost[links[:, 0]] + lengths)
    return float(cost[samples])
