"""The checker of bounds over bends accepts what the planner proves, and nothing changed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hzmp_planners._arrays import Bools, Floats
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Plan, plan
from hzmp_planners.planning.certificate import SOURCE, TARGET, Certificate, CrossingGraph
from hzmp_planners.planning.checks.bounds import certified_bound
from hzmp_planners.planning.checks.edge_list import list_edges, open_parts
from hzmp_planners.planning.clock import Clock, finished
from hzmp_planners.planning.crossings import build_crossings, prune_pairs
from hzmp_planners.planning.detour import least_detour
from hzmp_planners.planning.relaxation import solve_relaxation
from hzmp_planners.planning.roadmap import Query
from hzmp_planners.sets import Polytope
from oracles import random_free_points, random_world

Change = Callable[[Certificate], Certificate]
CUBE = (np.zeros(3), np.ones(3))


@pytest.fixture(autouse=True)
def bends_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Worlds as small as these would be bounded over their few faces."""
    monkeypatch.setattr("hzmp_planners.planning.strategy._FEW_PAIRS", 0)


@cache
def proved() -> Plan:
    """A plan around three pyramids whose bound takes a chain of several graphs."""
    apex = [0.5, 0.45, 0.95]
    feet = [[0.1, 0.1, 0.05], [0.9, 0.1, 0.05], [0.9, 0.8, 0.05], [0.1, 0.8, 0.05]]
    wall = Polytope.from_box([0.3, 0.5, 0.0], [0.75, 0.6, 0.8])
    bar = Polytope.from_box([0.0, 0.85, 0.3], [1.0, 0.95, 0.6])
    space = FreeSpace.decompose(CUBE, [Polytope.from_vertices([apex, *feet]), wall, bar])
    result = plan(space, [0.4, 0.02, 0.3], [0.6, 0.98, 0.4], time_limit=20.0, gap=1e-6)
    assert result.certificate is not None
    return result


def chain(result: Plan) -> list[Certificate]:
    """Links of the certificate, newest first."""
    links: list[Certificate] = []
    link = result.certificate
    while isinstance(link, Certificate):
        links.append(link)
        link = link.parent
    return links


def with_link(result: Plan, place: int, changed: Certificate, **others: object) -> Plan:
    """The plan with one link of its chain changed."""
    links = chain(result)
    links[place] = changed
    parent: Certificate | None = None
    for link in reversed(links):
        parent = replace(link, parent=parent)
    return replace(result, certificate=parent, **others)  # type: ignore[arg-type]


def supported(result: Plan) -> bool:
    return result.lower_bound - certified_bound(result) <= 1e-7 * result.lower_bound


def with_pairs(link: Certificate, kept: Bools) -> Certificate:
    graph = replace(link.graph, pairs=link.graph.pairs[kept])
    return replace(link, graph=graph, directions=link.directions[kept])


def without_node(link: Certificate, node: int) -> Certificate:
    """The graph as if the planner had not known a node."""
    others = np.flatnonzero(np.arange(len(link.graph.corners)) != node)
    number = np.full(len(link.graph.corners), -1)
    number[others] = np.arange(len(others))
    kept = (number[link.graph.pairs] >= 0).all(axis=1)
    graph = CrossingGraph(
        link.graph.corners[others],
        link.graph.face[others],
        link.graph.into[others],
        link.graph.out_of[others],
        number[link.graph.pairs[kept]],
        "edges",
    )
    return replace(
        link, graph=graph, potentials=link.potentials[others], directions=link.directions[kept]
    )


def test_what_the_planner_proves_is_accepted_and_recomputed_to_round_off() -> None:
    result = proved()
    links = chain(result)
    assert len(links) > 1
    assert any(link.cuts for link in links)
    assert {link.graph.over for link in links} == {"edges"}
    assert certified_bound(result) == pytest.approx(result.lower_bound, rel=1e-7)
    assert certified_bound(result) <= result.lower_bound


@pytest.mark.parametrize("kind", ["rotated", "grid", "loose grid"])
def test_random_plans_are_accepted(kind: str) -> None:
    rng = np.random.default_rng(5)
    proofs = 0
    for _ in range(40):
        world = random_world(rng, kind, 3, int(rng.integers(6, 12)))
        start, goal = random_free_points(rng, world, 2)
        result = plan(world.free_space(), start, goal, time_limit=3.0, gap=1e-4)
        proofs += result.certificate is not None
        assert supported(result)
        if proofs == 2:
            break
    assert proofs, "no bound above the straight line"


def test_a_pair_that_was_dropped_is_caught() -> None:
    """In any graph: pairs on ways that are short according to it."""
    result = proved()
    for place, link in enumerate(chain(result)):
        short = np.flatnonzero(link.least_through() < result.lower_bound * (1.0 - 1e-7))
        for row in short[:: max(1, len(short) // 6)].tolist():
            fewer = with_pairs(link, np.arange(len(link.graph.pairs)) != row)
            assert not supported(with_link(result, place, fewer)), (place, row)


def test_a_node_that_was_dropped_or_shortened_is_caught() -> None:
    """Shortened as if an obstacle's edge ended earlier."""
    result = proved()
    link = chain(result)[-1]
    graph = link.graph
    short = link.least_through() < result.lower_bound * (1.0 - 1e-6)
    used = np.setdiff1d(graph.pairs[short], [SOURCE, TARGET])
    assert len(used)
    for node in used.tolist():
        assert not supported(with_link(result, -1, without_node(link, node))), node
        corners = graph.corners.copy()
        corners[node, 1] += 0.02 * (corners[node, 0] - corners[node, 1])
        if (corners != graph.corners).any():
            alone = replace(
                result, certificate=replace(link, graph=replace(graph, corners=corners))
            )
            alone = replace(
                alone, lower_bound=0.999 * certified_bound(replace(result, certificate=link))
            )
            assert not supported(alone), node


def start_only(link: Certificate) -> Floats:
    return np.asarray(0.1 * (np.arange(len(link.potentials)) == SOURCE)[:, None, None])


CHANGES: dict[str, Change] = {
    "goal's potential raised": lambda link: replace(
        link, potentials=link.potentials + 0.01 * (np.arange(len(link.potentials)) == 1)[:, None]
    ),
    "steeper": lambda link: replace(
        link, potentials=1.01 * link.potentials, directions=1.01 * link.directions
    ),
    "unknown potentials": lambda link: replace(link, potentials=np.nan * link.potentials),
    "unknown directions": lambda link: replace(link, directions=np.nan * link.directions),
    "unknown threshold": lambda link: replace(link, threshold=math.nan),
    "over faces": lambda link: replace(link, graph=replace(link.graph, over="faces")),
    "another obstacle's edges": lambda link: replace(
        link, graph=replace(link.graph, into=np.roll(link.graph.into, 1))
    ),
    "other facets": lambda link: replace(
        link, graph=replace(link.graph, out_of=link.graph.out_of + 1)
    ),
    "one name for all nodes": lambda link: replace(
        link, graph=replace(link.graph, face=0 * link.graph.face)
    ),
    "started elsewhere": lambda link: replace(
        link, graph=replace(link.graph, corners=link.graph.corners + start_only(link))
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CHANGES)
@pytest.mark.parametrize("place", [0, -1])
def test_a_link_that_was_changed_is_caught(name: str, place: int) -> None:
    result = proved()
    changed = with_link(result, place, CHANGES[name](chain(result)[place]))
    if place == 0:
        changed = replace(changed, lower_bound=1.001 * result.lower_bound)
    assert not supported(changed)


def test_thresholds_cannot_be_raised_or_links_left_out() -> None:
    result = proved()
    links = chain(result)
    empty = Certificate.empty(
        prune_pairs(links[-1].graph, np.zeros(len(links[-1].graph.pairs), dtype=bool)),
        9.0, None, {},
    )  # fmt: skip
    assert not supported(replace(result, certificate=empty, lower_bound=9.0))
    high = result
    for place, link in enumerate(links):
        high = with_link(high, place, replace(link, threshold=2.0 * link.threshold))
    assert not supported(replace(high, lower_bound=1.5 * result.lower_bound))
    assert not supported(replace(result, certificate=replace(links[0], parent=None)))
    assert not supported(replace(result, lower_bound=result.lower_bound * (1.0 + 1e-6)))


def test_nodes_must_be_divided_without_loss() -> None:
    result = proved()
    for place, link in enumerate(chain(result)):
        for node, (point, direction) in list(link.cuts.items())[:2]:
            moved = {**link.cuts, node: (point + 1e-3 * direction, direction)}
            assert not supported(with_link(result, place, replace(link, cuts=moved)))
            for cut in ((np.nan * point, direction), (point, np.nan * direction)):
                unknown = {**link.cuts, node: cut}
                assert not supported(with_link(result, place, replace(link, cuts=unknown)))
        if link.cuts:
            assert not supported(with_link(result, place, replace(link, cuts={})))


def test_another_query_or_another_world_is_caught() -> None:
    result = proved()
    assert not supported(replace(result, goal=result.goal - [0.0, 0.0, 1e-3]))
    more = [*result.space.obstacles, Polytope.from_box([0.2, 0.65, 0.7], [0.4, 0.7, 0.75])]
    assert not supported(replace(result, space=FreeSpace.decompose(CUBE, more)))
    # Without an obstacle lines of sight that it blocked are missing.
    fewer = FreeSpace.decompose(CUBE, result.space.obstacles[:-1])
    assert not supported(replace(result, space=fewer))


def test_a_chain_over_faces_is_accepted_in_3d_too() -> None:
    result = proved()
    space = result.space
    query = Query(
        result.start, result.goal, space.leaves_at(result.start), space.leaves_at(result.goal)
    )
    detours, _ = least_detour(space.graph.corners, result.start, result.goal)
    first = finished(build_crossings(space.graph, query, detours, result.cost, Clock()))
    relaxation = solve_relaxation(first, result.cost, 20.0)
    assert relaxation is not None
    certificate = relaxation.certificate
    over_faces = replace(result, certificate=certificate, lower_bound=certificate.bound())
    assert supported(over_faces)
    mixed = replace(chain(result)[0], parent=certificate)
    assert not supported(replace(result, certificate=mixed))


def test_edges_and_their_free_parts_are_enumerated_anew() -> None:
    box = Polytope.from_box([0.0, 0.0, 0.0], [1.0, 2.0, 3.0])
    edges = list_edges([box])
    assert len(edges) == 12
    octahedron = Polytope.from_vertices(np.vstack([np.eye(3), -np.eye(3)]))
    assert len(list_edges([box, octahedron])) == 12 + 12 + 6
    along = next(edge for edge in edges if np.ptp(edge.ends[:, 0]) and not edge.ends[:, 1:].any())
    walls = (np.full(3, -1.0), np.array([0.9, 5.0, 5.0]))
    left = Polytope.from_box([0.2, -1.0, -1.0], [0.4, 1.0, 1.0])
    right = Polytope.from_box([0.4, -1.0, -1.0], [0.6, 1.0, 1.0])
    parts = np.array(open_parts(along, [left, right], walls, 1e-10))
    if along.ends[0, 0] > along.ends[1, 0]:
        parts = 1.0 - parts[::-1, ::-1]
    # Between the two that touch one point is left.
    assert parts == pytest.approx(np.array([[0.0, 0.2], [0.4, 0.4], [0.6, 0.9]]), abs=1e-9)
