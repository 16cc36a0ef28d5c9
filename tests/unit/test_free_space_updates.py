"""Spaces that follow obstacles, against fresh decompositions of the same obstacles."""

from __future__ import annotations

import numpy as np
import pytest

from free_space_checks import check_space, pairs_of, roomy, violations
from fuzz_worlds import KINDS, fuzz_bodies
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.free_space.shared_faces import build_leaf_graph
from hzmp_planners.planning import PlanStatus, plan
from hzmp_planners.sets import Polytope
from oracles import World, random_free_points, random_world

Moves = list[Polytope] | dict[int, Polytope | None]


def world_and_spares(seed: int) -> tuple[World, list[Polytope], np.random.Generator]:
    """A fuzz world, and obstacles of it and of another kind to add."""
    _, bodies, lo, hi, rng = fuzz_bodies(seed)
    more = list(KINDS.values())[int(rng.integers(len(KINDS)))](rng, lo.size)
    blocks, spares = (
        [Polytope.from_vertices(lo + body * (hi - lo)) for body in some]
        for some in (bodies, [*more[:5], *bodies[:1]])
    )
    return World(lo, hi, blocks), spares, rng


def random_moves(rng: np.random.Generator, space: FreeSpace, spares: list[Polytope]) -> Moves:
    """More obstacles; or some of them gone, exchanged, shifted by much or little, or as before."""
    count = len(space.obstacles)
    if not count or (spares and rng.random() < 0.3):
        return [spares[int(i)] for i in rng.integers(len(spares), size=2)] if spares else []
    moved: dict[int, Polytope | None] = {}
    for number in rng.choice(count, min(count, int(rng.integers(1, 4))), replace=False).tolist():
        block = space.obstacles[number]
        shift = rng.standard_normal(space.n) * 10.0 ** rng.uniform(-12.0, -1.0) * space.scale
        choices = [None, block, Polytope.from_vertices(block.vertices() + shift), *spares[:2]]
        moved[number] = choices[int(rng.integers(len(choices)))]
    return moved


def vertices_of(space: FreeSpace) -> set[bytes]:
    return {leaf.vertices().tobytes() for leaf in space.leaves}


def check_against_fresh(space: FreeSpace, rng: np.random.Generator) -> None:
    """Same volume, points and components; the graph is that of its own leaves."""
    fresh = FreeSpace.decompose(space.bounds, space.obstacles)
    lo, hi = space.bounds
    S, whole = space.scale, float(np.prod(hi - lo))
    room = 1e-9 * whole + 1e-8 * S * float((whole / (hi - lo)).sum())
    assert space.volume == pytest.approx(fresh.volume, abs=room)
    X = lo + (hi - lo) * rng.random((100, space.n))
    clear = (np.abs(violations(space.obstacles, X)) > 1e-8 * S).all(axis=0)
    assert np.array_equal(space.contains(X)[clear], fresh.contains(X)[clear])
    parts = [len(set(each.graph.components[roomy(each)].tolist())) for each in (space, fresh)]
    assert parts[0] == parts[1]
    rebuilt = build_leaf_graph(space._world.leaves, space._world.table, S)
    assert pairs_of(space.graph.ends) == pairs_of(rebuilt.ends)
    assert len(space.graph) == len(rebuilt)


@pytest.mark.parametrize("seeds", [range(k, k + 17) for k in range(0, 68, 17)])
def test_chained_updates_are_fresh_decompositions(seeds: range) -> None:
    for seed in seeds:
        world, spares, rng = world_and_spares(seed)
        space = world.free_space()
        for step in range(3):
            before = (space.vertices.copy(), space.graph.ends.copy(), vertices_of(space))
            after = space.with_obstacles(random_moves(rng, space, spares))
            assert np.array_equal(space.vertices, before[0])
            assert np.array_equal(space.graph.ends, before[1])
            assert vertices_of(space) == before[2]
            space = after
            try:
                check_against_fresh(space, rng)
                check_space(space, rng)
            except AssertionError as failure:
                raise AssertionError(f"seed {seed}, step {step}: {failure}") from failure


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("count", [1, 5, 30])
@pytest.mark.parametrize("kind", ["grid", "loose grid", "rotated"])
def test_any_number_of_obstacles_comes_at_once(kind: str, n: int, count: int) -> None:
    rng = np.random.default_rng(count)
    world = random_world(rng, kind, n, count)
    empty = FreeSpace.decompose((world.lo, world.hi))
    check_against_fresh(empty.with_obstacles(world.obstacles), rng)


@pytest.mark.parametrize("n", [2, 3])
def test_leaves_out_of_reach_are_taken_over(n: int) -> None:
    """A leaf that no new obstacle meets keeps its half-spaces and vertices to the last bit."""
    rng = np.random.default_rng(n)
    for _ in range(6):
        world, other = (random_world(rng, "hulls", n, 6) for _ in range(2))
        space = world.free_space()
        added = other.obstacles[:2]
        after = vertices_of(space.with_obstacles(added))
        kept = 0
        for leaf in space.leaves:
            lo, hi = leaf.interval_hull()
            hulls = [block.interval_hull() for block in added]
            if all((high <= lo).any() or (low >= hi).any() for low, high in hulls):
                assert leaf.vertices().tobytes() in after
                kept += 1
        assert kept > 0


@pytest.mark.parametrize("n", [2, 3])
def test_nothing_comes_of_moves_that_change_nothing(n: int) -> None:
    """No moves at all, obstacles outside, flat ones, and a full workspace."""
    lo, hi = np.zeros(n), np.ones(n)
    block = Polytope.from_box(lo + 0.4, hi - 0.4)
    space = FreeSpace.decompose((lo, hi), [block])
    outside = Polytope.from_box(hi, hi + 1.0)
    flat = Polytope.from_vertices(np.eye(n))
    for moved in ([], {}, [outside], [flat], [block], {0: block}):
        assert space.with_obstacles(moved).volume == pytest.approx(space.volume)
    full = space.with_obstacles([Polytope.from_box(lo - 1.0, hi + 1.0)])
    assert len(full) == len(full.graph) == 0
    assert len(full.with_obstacles([block, outside])) == 0
    again = full.with_obstacles({1: None})
    assert again.volume == pytest.approx(space.volume)
    assert again.with_obstacles({0: None}).volume == pytest.approx(1.0)
    assert len(space.with_obstacles({0: flat}).obstacles) == 0


@pytest.mark.parametrize(("kind", "n"), [("grid", 2), ("rotated", 2), ("hulls", 2), ("hulls", 3)])
def test_plans_cost_the_same_as_on_a_fresh_space(kind: str, n: int) -> None:
    rng = np.random.default_rng(7 * n + len(kind))
    for _ in range(5):
        world, other = (random_world(rng, kind, n, 5) for _ in range(2))
        space = world.free_space()
        for moved in ({0: other.obstacles[0], 1: None}, {2: other.obstacles[2]}):
            space = space.with_obstacles(moved)
        fresh = FreeSpace.decompose(space.bounds, space.obstacles)
        start, goal = random_free_points(rng, World(world.lo, world.hi, list(space.obstacles)), 2)
        one, two = (plan(each, start, goal, 0.5, 1e-4) for each in (space, fresh))
        assert one.status == two.status
        if one.status in (PlanStatus.OPTIMAL, PlanStatus.FEASIBLE):
            assert one.cost == pytest.approx(two.cost, rel=2e-3)


def test_a_leaf_beside_an_obstacle_is_not_filled_when_that_comes_again() -> None:
    """The leaf's corners are 1.2e-10 beyond the common facet: a block without room filled it."""
    body = [
        [-0.0004285535570487278, -0.0007646520860006888, 0.0027654783909298415],
        [7.583650957303754e-05, 0.003060226251924787, -0.0006331840129722927],
        [-0.0035458119138200663, 0.0033520311601095013, 0.0034834992331378967],
        [0.0005708713322901235, 0.003152644298430364, -0.0003908008849248956],
        [-0.00016433507064864562, -0.0003037951680741938, -0.0005092461737828662],
    ]
    lo = [-0.003545811904153716, -0.000764652097917459, -0.0006331839865704463]
    hi = [0.0005708713419564737, 0.0033520311481927308, 0.0034834992595397436]
    block = Polytope.from_vertices(body)
    space = FreeSpace.decompose((lo, hi), [block])
    assert space.with_obstacles([block]).volume == pytest.approx(space.volume, rel=1e-8)
