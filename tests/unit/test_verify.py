from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Plan, PlanStatus, plan, verify
from hzmp_planners.planning.certificate import Certificate, CrossingGraph
from hzmp_planners.sets import Polytope
from oracles import load_scene, random_free_points, random_world


@cache
def planned(name: str, gap: float = 1e-3) -> Plan:
    scene = load_scene(name)
    space = scene.free_space()
    if space.n == 2:
        space = space.overlapping()  # where leaves are disjoint the plane is not bounded over faces
    return plan(space, scene.start, scene.goal, time_limit=60.0, gap=gap)


def chain(result: Plan) -> list[Certificate]:
    links = []
    link = result.certificate
    while isinstance(link, Certificate):
        links.append(link)
        link = link.parent
    return links


def claims(result: Plan, **changed: object) -> set[str]:
    """Names of the residuals that expose a changed plan."""
    report = verify(replace(result, **changed))  # type: ignore[arg-type]
    assert "FAILED" in report.describe() or report.ok
    return {name for name, value in report.residuals.items() if not value <= report.tolerance}


PLANS = {
    # name: (gap, links in the certificate's chain)
    "random_3d_s004": (1e-3, 0),  # the straight line
    "dividing_walls_3d": (1e-2, 0),  # faces shut by their detours
    "narrow_passage_2d": (1e-3, 1),  # nothing left to bound
    "random_2d_s010": (1e-3, 1),  # potentials
    "random_2d_s001": (1e-5, 2),  # faces divided and potentials again
    "random_3d_s003": (1e-4, 1),  # potentials on bends
}


@pytest.mark.parametrize("name", PLANS)
def test_every_kind_of_proof_is_accepted(name: str) -> None:
    gap, links = PLANS[name]
    result = planned(name, gap)
    assert len(chain(result)) >= links
    assert (result.certificate is None) == (links == 0)
    report = verify(result)
    assert report.ok, report.describe()
    assert set(report.residuals) == {
        "bound_excess", "endpoints", "length", "path_outside_leaves", "leaf_inside_obstacle",
        "uncovered", *(["gap_excess"] if result.status is PlanStatus.OPTIMAL else []),
    }  # fmt: skip
    assert "all claims hold" in report.describe()


@pytest.mark.parametrize("name", PLANS)
@pytest.mark.parametrize("raise_by", [1e-6, 1e-2, 1.0, math.inf, math.nan])
def test_a_bound_that_was_raised_is_caught(name: str, raise_by: float) -> None:
    gap, _ = PLANS[name]
    result = planned(name, gap)
    exposed = claims(result, lower_bound=result.lower_bound + raise_by)
    # With no number for a bound there is no gap that could have been met, either.
    unmet = (
        {"gap_excess"} if math.isnan(raise_by) and result.status is PlanStatus.OPTIMAL else set()
    )
    assert exposed == {"bound_excess"} | unmet


def test_a_lower_bound_may_be_weakened() -> None:
    result = replace(planned("random_2d_s010"), status=PlanStatus.FEASIBLE)
    assert claims(result, lower_bound=result.lower_bound * 0.9) == set()
    assert claims(result, lower_bound=0.0, certificate=None) == set()


@pytest.mark.parametrize("name", PLANS)
def test_a_length_that_was_changed_is_caught(name: str) -> None:
    gap, _ = PLANS[name]
    result = planned(name, gap)
    for cost in (result.cost - 1e-6, result.cost + 1e-6, 0.0, math.inf, math.nan):
        assert "length" in claims(result, cost=cost)


def test_a_path_that_was_moved_is_caught() -> None:
    scene = load_scene("random_2d_s010")
    result = plan(scene.free_space(), scene.start, scene.goal)
    rng = np.random.default_rng(0)
    for k in range(len(result.waypoints)):
        points = result.waypoints.copy()
        points[k] += 1e-3 * rng.standard_normal(2)
        found = claims(result, waypoints=points)
        assert "length" in found
        assert "path_outside_leaves" in found or "endpoints" in found
        points[k] = math.nan
        assert {"length", "path_outside_leaves"} <= claims(result, waypoints=points)
    line = np.array([result.start, result.goal])
    cost = math.dist(*line)
    assert claims(result, waypoints=line, leaves=result.leaves[:1], cost=cost)


def test_a_path_must_say_which_leaf_holds_each_segment() -> None:
    result = planned("random_2d_s010")
    points, leaves = result.waypoints, result.leaves
    # A straight line, of which only a first little piece is claimed to be in a leaf.
    short = np.array([result.start, result.start * (1 - 1e-6) + result.goal * 1e-6, result.goal])
    cheat = {"waypoints": short, "cost": math.dist(result.start, result.goal)}
    for changed in (
        {"leaves": leaves[:-1]},
        {"leaves": np.append(leaves, leaves[-1])},
        {"leaves": leaves[:0]},
        {"leaves": leaves[::-1].copy()},
        {"leaves": leaves + len(result.space.leaves)},
        {"waypoints": points[:0], "leaves": leaves[:0]},
        {"waypoints": points[:0], "leaves": leaves[:0], "cost": math.inf},
        {"waypoints": points[:1], "leaves": leaves[:0]},
        {**cheat, "leaves": leaves[:1]},
    ):
        assert "path_outside_leaves" in claims(result, **changed), changed


def test_leaves_inside_obstacles_are_caught() -> None:
    lo, hi = np.zeros(2), np.ones(2)
    space = FreeSpace.decompose((lo, hi), [Polytope.from_box([2, 2], [3, 3])])
    result = plan(space, [0.1, 0.1], [0.9, 0.9])
    assert verify(result).ok
    block = Polytope.from_box([0.4, 0.4], [0.6, 0.6])
    fooled = replace(space, obstacles=(block,))
    report = verify(replace(result, space=fooled))
    assert report.residuals["leaf_inside_obstacle"] == pytest.approx(0.1, abs=1e-9)
    assert not report.ok


def test_another_start_or_goal_is_caught() -> None:
    result = planned("random_2d_s010")
    assert "endpoints" in claims(result, start=result.start + 1e-3)
    # The bound was proved for this query and no other.
    nearer = result.start + 0.2 * (result.goal - result.start)
    if result.space.contains(nearer).all():
        assert "bound_excess" in claims(result, start=nearer)


def with_chain(result: Plan, links: list[Certificate]) -> Plan:
    """The plan with a chain rebuilt from its links, newest first."""
    parent = None
    for link in reversed(links):
        parent = replace(link, parent=parent)
    return replace(result, certificate=parent)


@pytest.mark.parametrize("name", ["random_2d_s010", "random_3d_s003"])
def test_potentials_that_were_changed_prove_less(name: str) -> None:
    result = planned(name, 1e-2 if "3d" in name else 1e-3)
    links = chain(result)
    phi = links[0].potentials
    raised = phi.copy()
    raised[1] += 0.01  # at the goal: a higher bound, if the pairs there allowed it
    bent = phi.copy()
    bent[2:, 0] -= 0.01
    for potentials in (raised, bent, np.zeros_like(phi), np.full_like(phi, np.nan), 1.01 * phi):
        changed = with_chain(result, [replace(links[0], potentials=potentials), *links[1:]])
        assert claims(changed) == {"bound_excess"}


def test_directions_longer_than_one_prove_less() -> None:
    result = planned("random_2d_s010")
    link = chain(result)[0]
    stretched = replace(link, directions=1.01 * link.directions, potentials=1.01 * link.potentials)
    lied = replace(result, certificate=stretched, lower_bound=1.01 * result.lower_bound)
    assert claims(lied) == {"bound_excess"}
    unknown = replace(link, directions=np.full_like(link.directions, np.nan))
    assert claims(replace(result, certificate=unknown)) == {"bound_excess"}


@pytest.mark.parametrize("name", ["random_2d_s010", "random_3d_s003"])
def test_a_pair_that_was_dropped_is_caught(name: str) -> None:
    """Leaving out any pair on a way shorter than the bound would let potentials prove anything."""
    result = planned(name, 1e-2 if "3d" in name else 1e-3)
    links = chain(result)
    for place, link in enumerate(links):
        through = link.least_through()
        short = np.flatnonzero(through < min(c.threshold for c in links) * (1 - 1e-6))
        for row in short[:: max(1, len(short) // 5)]:
            graph = link.graph
            fewer = replace(graph, pairs=np.delete(graph.pairs, row, axis=0))
            broken = replace(link, graph=fewer, directions=np.delete(link.directions, row, axis=0))
            cheat = with_chain(result, [*links[:place], broken, *links[place + 1 :]])
            assert claims(cheat) == {"bound_excess"}, (place, row)


def test_the_chain_cannot_be_shortened_or_its_threshold_raised() -> None:
    result = planned("random_2d_s001", 1e-5)
    links = chain(result)
    assert len(links) > 1
    assert claims(with_chain(result, links[:-1])) == {"bound_excess"}
    assert claims(with_chain(result, links[1:])) == {"bound_excess"}
    assert claims(replace(result, certificate=None)) == {"bound_excess"}
    high = [replace(link, threshold=link.threshold * 2.0) for link in links]
    assert claims(replace(with_chain(result, high), lower_bound=1.5 * result.cost)) == {
        "bound_excess"
    }
    unknown = [replace(link, threshold=math.nan) for link in links]
    assert claims(with_chain(result, unknown)) == {"bound_excess"}


def test_faces_must_be_divided_without_loss() -> None:
    result = planned("random_2d_s001", 1e-5)
    newest, *older = chain(result)
    assert newest.cuts
    assert claims(with_chain(result, [replace(newest, cuts={}), *older])) == {"bound_excess"}
    # Halves that only longer ways cross may be anything.
    caught = []
    for node, (point, direction) in newest.cuts.items():
        moved = {**newest.cuts, node: (point + 1e-3 * direction, direction)}
        caught.append(claims(with_chain(result, [replace(newest, cuts=moved), *older])))
    assert {"bound_excess"} in caught


def test_the_certificate_starts_and_ends_where_the_plan_does() -> None:
    """Two nodes put in front as start and goal, with any potentials, would prove any bound."""
    result = planned("random_2d_s010")
    link = chain(result)[0]
    graph = link.graph
    fake = CrossingGraph(
        np.concatenate([graph.corners[:2], graph.corners]),
        np.concatenate([graph.face[:2], graph.face]),
        np.concatenate([graph.into[:2], graph.into]),
        np.concatenate([graph.out_of[:2], graph.out_of]),
        graph.pairs + 2,
    )
    phi = np.concatenate([[[0.0] * 2, [9.0] * 2], link.potentials])
    forged = replace(link, graph=fake, potentials=phi, threshold=9.0)
    assert claims(result, certificate=forged, lower_bound=5.0) == {"bound_excess"}
    elsewhere = replace(graph, corners=np.concatenate([graph.corners[:1] - 5.0, graph.corners[1:]]))
    assert claims(result, certificate=replace(link, graph=elsewhere)) == {"bound_excess"}


def test_infeasible_is_not_believed_where_there_is_a_way() -> None:
    for name, (gap, _) in PLANS.items():
        result = planned(name, gap)
        denied = {"status": PlanStatus.INFEASIBLE, "lower_bound": math.inf, "cost": math.inf}
        assert claims(result, **denied) == {"missed_face"}


def closed_room() -> FreeSpace:
    walls = [
        Polytope.from_box([1, 1], [2, 1.1]), Polytope.from_box([1, 1.9], [2, 2]),
        Polytope.from_box([1, 1], [1.1, 2]), Polytope.from_box([1.9, 1], [2, 2]),
    ]  # fmt: skip
    return FreeSpace.decompose(([0, 0], [3, 3]), walls)


def test_infeasible_is_believed_of_a_closed_room_only_while_no_face_is_missing() -> None:
    space = closed_room()
    result = plan(space, [1.5, 1.5], [0.5, 0.5])
    assert result.status is PlanStatus.INFEASIBLE
    assert verify(result).ok
    # A door between two parts of the outside that the graph keeps quiet about.
    graph = space.graph
    outer = plan(space, [0.5, 0.5], [2.5, 2.5])
    assert outer.status is PlanStatus.OPTIMAL
    used = {frozenset(pair) for pair in zip(outer.leaves[:-1], outer.leaves[1:], strict=True)}
    assert used
    mine = set(space.leaves_at([0.5, 0.5]).tolist())
    kept = ~np.isin(graph.ends, sorted(mine)).any(axis=1)
    names = ("ends", "corners", "sizes", "normals", "offsets")
    silent = replace(space)
    silent.__dict__["graph"] = replace(graph, **{k: getattr(graph, k)[kept] for k in names})
    denied = plan(silent, [0.5, 0.5], [2.5, 2.5])
    assert denied.status is PlanStatus.INFEASIBLE
    report = verify(denied)
    assert not report.ok
    assert report.residuals["missed_face"] > 0.1


def test_infeasible_plans_come_without_path_and_with_an_infinite_bound() -> None:
    result = plan(closed_room(), [1.5, 1.5], [0.5, 0.5])
    for changed in ({"lower_bound": 1.0}, {"cost": 1.0}, {"waypoints": np.zeros((2, 2))}):
        assert claims(result, **changed), changed


def test_time_limit_without_a_path_claims_only_its_bound() -> None:
    result = planned("random_2d_s010")
    none = replace(
        result,
        status=PlanStatus.TIME_LIMIT,
        waypoints=result.waypoints[:0],
        leaves=result.leaves[:0],
        cost=math.inf,
    )
    assert claims(none) == set()
    assert claims(none, lower_bound=2.0 * result.lower_bound) == {"bound_excess"}
    assert claims(none, cost=1.0) == {"path_outside_leaves"}


def test_planes_that_nearly_coincide_do_not_break_a_proof() -> None:
    rng = np.random.default_rng(0)
    proved = 0
    for trial in range(24):
        n = 2 + trial % 2
        world = random_world(rng, "loose grid", n, 6, 10.0 ** float(rng.integers(-1, 3)))
        start, goal = random_free_points(rng, world, 2)
        result = plan(world.free_space(), start, goal, time_limit=60.0, gap=1e-2)
        report = verify(result)
        assert report.ok, (trial, report.describe())
        proved += result.certificate is not None
    assert proved > 0


def test_optimal_with_an_open_gap_is_caught() -> None:
    result = planned("random_2d_s010", 1e-2)
    assert result.status is PlanStatus.OPTIMAL
    weak = replace(result, lower_bound=0.9 * result.lower_bound)
    assert not verify(weak).ok
    assert verify(weak).residuals["gap_excess"] > 0.05 * result.cost
    assert verify(replace(weak, status=PlanStatus.FEASIBLE)).ok
