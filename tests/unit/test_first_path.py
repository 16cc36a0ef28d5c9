"""The first path: valid wherever there is one, and in the plane taut through its leaves."""

from __future__ import annotations

import math
import time
from itertools import pairwise

import numpy as np
import pytest

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.attempt import Attempt, Route
from hzmp_planners.planning.first_path import offer_first, search_leaves
from hzmp_planners.planning.planar.funnel import taut_string
from hzmp_planners.planning.prepared import prepared
from hzmp_planners.planning.refine import refine
from hzmp_planners.planning.result import path_length
from hzmp_planners.planning.roadmap import Query
from oracles import Floats, load_scene, random_free_points, random_world


def asked(space: FreeSpace, start: Floats, goal: Floats) -> Query:
    return Query(start, goal, space.leaves_at(start), space.leaves_at(goal))


def first_route(space: FreeSpace, query: Query, time_limit: float = math.inf) -> Route | None:
    began = time.perf_counter()
    attempt = Attempt(space.graph, query, gap=0.0)
    attempt.clock.resume(began, time_limit)
    offer_first(attempt, space)
    return attempt.route


def apart(query: Query) -> bool:
    return not set(query.start_leaves.tolist()) & set(query.goal_leaves.tolist())


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("kind", ["grid", "rotated", "hulls", "slivers"])
@pytest.mark.parametrize("overlapping", [False, True])
def test_a_path_in_its_leaves_wherever_there_is_one(n: int, kind: str, overlapping: bool) -> None:
    rng = np.random.default_rng(n)
    world = random_world(rng, kind, n, 8, 10.0 ** rng.uniform(-2, 2))
    space = world.free_space().overlapping() if overlapping else world.free_space()
    doors = [face.vertices for face in space.graph.faces]
    on_faces = [doors[i].mean(axis=0) for i in rng.choice(len(doors), 4)]
    ends = [*random_free_points(rng, world, 8), *on_faces, *space.vertices[:4]]
    parts = space.graph.components
    for start, goal in zip(ends, ends[3:], strict=False):
        query = asked(space, start, goal)
        if not apart(query):
            continue
        route = first_route(space, query)
        one, two = (set(parts[at].tolist()) for at in (query.start_leaves, query.goal_leaves))
        assert (route is not None) == bool(one & two)
        if route is None:
            continue
        leaves = route.leaves.tolist()
        assert np.array_equal(route.waypoints[[0, -1]], [start, goal])
        assert len(set(leaves)) == len(leaves) == len(route.waypoints) - 1
        for leaf, segment in zip(leaves, pairwise(route.waypoints), strict=True):
            assert space.leaf(leaf).violation(segment).max() <= 1e-9 * space.scale
        again = first_route(space, query)
        assert again is not None
        assert np.array_equal(again.waypoints, route.waypoints)


@pytest.mark.parametrize("kind", ["grid", "rotated", "hulls", "slivers"])
def test_the_string_is_the_shortest_through_its_leaves(kind: str) -> None:
    rng = np.random.default_rng(7)
    for _ in range(5):
        world = random_world(rng, kind, 2, 10)
        space = world.free_space()
        graph = space.graph
        query = asked(space, *random_free_points(rng, world, 2))
        found = search_leaves(prepared(space).exits, query)
        if found is None or not apart(query):
            continue
        faces, leaves, _ = found
        assert np.array_equal(np.sort(graph.ends[faces]), np.sort([*pairwise(leaves.tolist())]))
        forward = (graph.ends[faces, 1] == leaves[1:])[:, None]
        ahead = np.where(forward, graph.normals[faces], -graph.normals[faces])
        ends, corners = (query.start, query.goal), graph.corners[faces]
        taut = path_length(taut_string(*ends, corners, ahead))
        assert taut == pytest.approx(path_length(refine(*ends, corners, 60.0)), rel=1e-7)
        # Which end of a face comes first is of no account, nor is the way it is travelled.
        assert taut == pytest.approx(
            path_length(taut_string(*ends, corners[:, ::-1], ahead)), rel=1e-12
        )
        back = taut_string(query.goal, query.start, corners[::-1], -ahead[::-1])
        assert taut == pytest.approx(path_length(back), rel=1e-12)


def test_a_string_along_faces_and_through_their_ends() -> None:
    start, goal = np.array([0.0, 0.0]), np.array([3.0, 0.0])
    faces = np.array([[[1.0, 0.0], [1.0, 2.0]], [[1.0, 0.0], [2.0, 0.0]], [[2.0, -1.0], [2.0, 0]]])
    ahead = np.array([[1.0, 0.0], [0.0, -1.0], [1.0, 0.0]])
    points = taut_string(start, goal, faces, ahead)
    np.testing.assert_allclose(points[:, 1], 0.0, atol=1e-15)
    assert path_length(points) == pytest.approx(3.0, rel=1e-15)
    assert path_length(taut_string(start, goal, faces[:0], ahead[:0])) == 3.0


@pytest.mark.parametrize("name", ["random_2d_s008", "random_3d_s003"])
def test_first_paths_are_short_and_end_with_the_time(name: str) -> None:
    scene = load_scene(name)
    space = scene.free_space()
    query = asked(space, scene.start, scene.goal)
    route = first_route(space, query)
    assert route is not None
    assert route.cost <= 1.05 * scene.cost
    assert search_leaves(prepared(space).exits, query, deadline=-math.inf) is None
    assert first_route(space, query, time_limit=-1.0) is None
