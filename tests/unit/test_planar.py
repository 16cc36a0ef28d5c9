from __future__ import annotations

import gc
import math
import weakref
from dataclasses import replace

import numpy as np
import pytest

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Plan, PlanStatus, plan, verify
from hzmp_planners.planning.planar.certificate import CornerCertificate
from hzmp_planners.planning.planar.mesh import build_mesh
from hzmp_planners.planning.planar.taut_search import TautSearch
from hzmp_planners.sets import Polytope
from oracles import load_scene, random_free_points, random_world


def box(*corners: float) -> Polytope:
    return Polytope.from_box(corners[:2], corners[2:])


def room(*blocks: Polytope, side: float = 4.0) -> FreeSpace:
    return FreeSpace.decompose(bounds=([0.0, 0.0], [side, side]), obstacles=blocks)


def corner_proof(result: Plan) -> CornerCertificate:
    assert isinstance(result.certificate, CornerCertificate)
    return result.certificate


@pytest.mark.parametrize("kind", ["boxes", "hulls", "grid", "loose grid"])
def test_paths_and_bounds_agree_and_are_verified(kind: str) -> None:
    rng = np.random.default_rng(sum(map(ord, kind)))
    for _ in range(12):
        world = random_world(rng, kind, 2, 12)
        start, goal = random_free_points(rng, world, 2)
        result = plan(world.free_space(), start, goal, gap=0.0, time_limit=60.0)
        if result.status is not PlanStatus.INFEASIBLE:
            assert result.gap <= 1e-12
        assert verify(result).ok, verify(result).describe()


def test_a_search_that_was_stopped_goes_on_and_its_bound_only_rises() -> None:
    scene = load_scene("random_2d_s001")
    space = scene.free_space()
    ends = space.leaves_at(scene.start), space.leaves_at(scene.goal)
    search = TautSearch(build_mesh(space), scene.start, scene.goal, *ends)
    bounds = [search.bound]
    while search.path is None:
        search.run(deadline=-math.inf)
        bounds.append(search.bound)
    assert len(bounds) > 3
    assert (np.diff(bounds) >= 0.0).all()
    length = np.linalg.norm(np.diff(search.path.waypoints, axis=0), axis=1).sum()
    assert length == pytest.approx(bounds[-1], rel=1e-12)


def test_no_path_shorter_than_a_limit_is_a_bound() -> None:
    scene = load_scene("random_2d_s010")
    space = scene.free_space()
    ends = space.leaves_at(scene.start), space.leaves_at(scene.goal)
    search = TautSearch(build_mesh(space), scene.start, scene.goal, *ends)
    best = plan(space, scene.start, scene.goal).cost
    search.run(limit=0.99 * best)
    assert search.path is None
    assert search.bound == 0.99 * best


def test_a_limit_below_every_way_out_of_the_start_proves_no_more_than_itself() -> None:
    space = room(box(1.0, 0.5, 1.5, 3.5))
    start, goal = np.array([0.5, 2.0]), np.array([3.5, 2.0])
    ends = space.leaves_at(start), space.leaves_at(goal)
    search = TautSearch(build_mesh(space), start, goal, *ends)
    search.run(limit=3.1)
    assert search.path is None
    assert search.bound == 3.1


def test_a_shorter_string_to_a_corner_goes_where_a_longer_one_was_first() -> None:
    boxes = [
        box(-0.009, 0.077, 0.107, 0.24),
        box(0.248, 0.237, 0.365, 0.413),
        box(-0.039, -0.101, 0.069, 0.066),
        box(0.267, -0.001, 0.456, 0.18),
    ]
    space = FreeSpace.decompose(bounds=([-0.5, -0.5], [0.5, 0.5]), obstacles=boxes)
    result = plan(space, [-0.1, -0.1], [0.4, 0.4], gap=0.0)
    # Below the third box, between it and the fourth, and past a corner of the second.
    bends = [(-0.039, -0.101), (0.069, -0.101), (0.267, 0.18), (0.365, 0.237)]
    length = sum(map(math.dist, [(-0.1, -0.1), *bends], [*bends, (0.4, 0.4)]))
    assert result.cost == pytest.approx(length, rel=1e-12)
    assert verify(result).ok, verify(result).describe()


def test_obstacles_that_touch_in_a_point_leave_no_passage_and_two_corners() -> None:
    space = room(box(0.0, 2.0, 2.0, 3.0), box(2.0, 1.0, 3.0, 2.0), side=4.0)
    result = plan(space, [1.0, 1.0], [3.0, 3.0], gap=0.0)
    # Through the point it would be 2.83; around the lower box by its right side it is longer.
    around = math.dist((1.0, 1.0), (3.0, 1.0)) + 1.0 + math.dist((3.0, 2.0), (3.0, 3.0))
    assert result.cost == pytest.approx(around, rel=1e-12)
    assert verify(result).ok, verify(result).describe()


@pytest.mark.parametrize("start", [(1.0, 1.0), (1.0, 2.0), (2.0, 1.5), (0.0, 0.0), (4.0, 1.5)])
def test_starts_on_corners_faces_and_walls(start: tuple[float, float]) -> None:
    space = room(box(1.0, 1.0, 2.0, 2.0), box(2.5, 0.5, 3.5, 3.0))
    for goal in [(4.0, 4.0), (2.5, 3.0), (2.25, 1.5), (3.75, 1.0)]:
        result = plan(space, start, goal, gap=0.0)
        assert result.gap <= 1e-12
        assert verify(result).ok, verify(result).describe()
        back = plan(space, goal, start, gap=0.0)
        assert back.cost == pytest.approx(result.cost, rel=1e-12, abs=1e-12)


def test_changed_potentials_prove_less() -> None:
    scene = load_scene("random_2d_s010")
    result = plan(scene.free_space(), scene.start, scene.goal)
    proof = corner_proof(result)
    none = np.zeros(0, dtype=np.int64)
    forged = [
        replace(proof, potentials=proof.potentials - 0.05),
        replace(proof, potentials=np.full_like(proof.potentials, math.nan)),
        replace(proof, potentials=np.zeros_like(proof.potentials)),
        replace(proof, bound=1.01 * proof.bound),
        replace(
            proof,
            corners=proof.corners[none],
            leaves=proof.leaves[none],
            potentials=proof.potentials[none],
        ),
    ]
    for lie in forged:
        report = verify(replace(result, certificate=lie, lower_bound=max(result.cost, lie.bound)))
        assert report.residuals["bound_excess"] > 1e-4


def test_out_of_time_leaves_a_proved_bound() -> None:
    scene = load_scene("random_2d_s001")
    result = plan(scene.free_space(), scene.start, scene.goal, time_limit=1e-4, gap=0.0)
    assert result.lower_bound <= 0.8084174 * (1.0 + 1e-6)
    assert verify(result).ok, verify(result).describe()


@pytest.mark.parametrize("n", [2, 3])
def test_what_a_plan_prepares_is_freed_with_its_space(n: int) -> None:
    space = FreeSpace.decompose(
        ([0.0] * n, [4.0] * n), [Polytope.from_box([1.0] * n, [3.0, 3.0, 3.5][:n])]
    )
    result = plan(space, [0.5, *[2.0] * (n - 1)], [3.5, *[2.1] * (n - 1)])
    assert result.status is PlanStatus.OPTIMAL
    alive = weakref.ref(space)
    del space, result
    gc.collect()
    assert alive() is None
