"""Trajectories for control loops: the same promises as of the thorough ones, from few programs."""

import numpy as np
import pytest

from corridors import L_SHAPE, LIMITS, check, random_boxes
from hzmp_planners._arrays import Floats
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking import Trajectory, time_parameterize

LANE = Polytope.from_box([0, 0], [20, 1])


def rest_of(old: Trajectory, t: float) -> tuple[Floats, list[Polytope], Floats, Floats]:
    """Waypoints, cells, velocity and acceleration of what is left at time t."""
    state = old.sample(t)
    piece = int(np.searchsorted(old.breakpoints, t, side="right")) - 1
    cell = int(old.piece_cells[piece])
    points = np.vstack([state.position, old.waypoints[cell + 1 :]])
    return points, list(old.cells[cell:]), state.velocity[0], state.acceleration[0]


def check_start(trajectory: Trajectory, velocity: Floats, acceleration: Floats) -> None:
    start = trajectory.sample(0.0)
    assert np.allclose(start.velocity[0], velocity, rtol=0, atol=1e-9)
    assert np.allclose(start.acceleration[0], acceleration, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("K", "n", "seed"), [(2, 2, 0), (5, 3, 1), (8, 2, 2), (8, 3, 3)])
def test_from_rest_it_is_nearly_as_fast(K: int, n: int, seed: int) -> None:
    points, cells = random_boxes(np.random.default_rng(seed), K, n)
    check(time_parameterize(points, cells, LIMITS, quick=True), points, cells, LIMITS)
    thorough = time_parameterize(points, cells, LIMITS)
    shortest = thorough.waypoints
    quick = time_parameterize(shortest, cells, LIMITS, quick=True)
    check(quick, shortest, cells, LIMITS)
    assert quick.duration <= 1.3 * thorough.duration


@pytest.mark.parametrize("quick", [True, False])
def test_from_states_on_the_way(quick: bool) -> None:
    old = time_parameterize(*L_SHAPE, LIMITS, quick=quick)
    for t in np.linspace(0.0, 0.98, 15) * old.duration:
        points, cells, v, a = rest_of(old, t)
        new = time_parameterize(points, cells, LIMITS, v, a, quick=True)
        check(new, points, cells, LIMITS)
        check_start(new, v, a)


@pytest.mark.parametrize("quick", [True, False])
def test_a_known_way_is_never_given_up_for_a_slower_one(quick: bool) -> None:
    points, cells = random_boxes(np.random.default_rng(7), 6, 2)
    old = time_parameterize(points, cells, LIMITS)
    for t in (0.0, 0.3 * old.duration, 0.7 * old.duration):
        tail = old.part(t, old.duration)
        ahead, chain, v, a = rest_of(old, t)
        new = time_parameterize(ahead, chain, LIMITS, v, a, quick=quick, previous=tail)
        check(new, ahead, chain, LIMITS)
        check_start(new, v, a)
        assert new.duration <= tail.duration * (1 + 1e-9)


def test_a_known_way_that_leaves_the_cells_is_not_taken() -> None:
    points, cells = L_SHAPE
    wide = [Polytope.from_box([0, 0], [4, 4])]
    shortcut = time_parameterize([points[0], points[-1]], wide, LIMITS)
    new = time_parameterize(points, cells, LIMITS, quick=True, previous=shortcut)
    check(new, points, cells, LIMITS)
    assert new.duration > shortcut.duration


def test_a_known_way_has_to_fit() -> None:
    old = time_parameterize([[1.0, 0.5], [9.0, 0.5]], [LANE], LIMITS)
    wrong = [([[1.5, 0.5], [9.0, 0.5]], "start"), ([[1.0, 0.5], [8.0, 0.5]], "end")]
    for points, name in wrong:
        with pytest.raises(QueryError, match=f"another {name}"):
            time_parameterize(points, [LANE], LIMITS, previous=old)
    slow = type(LIMITS)(1.0, 4.0, 20.0)
    with pytest.raises(QueryError, match="of a limit"):
        time_parameterize([[1.0, 0.5], [9.0, 0.5]], [LANE], slow, previous=old)
    box = Polytope.from_box([0, 0, 0], [1, 1, 1])
    with pytest.raises(ShapeError, match="previous has 2"):
        time_parameterize([[0.1] * 3, [0.9] * 3], [box], LIMITS, previous=old)


def test_in_one_cell_the_fastest_motion_is_found() -> None:
    points = [[0.5, 0.5], [19.5, 0.5]]
    quick = time_parameterize(points, [LANE], LIMITS, quick=True)
    check(quick, points, [LANE], LIMITS)
    assert quick.duration == pytest.approx(time_parameterize(points, [LANE], LIMITS).duration)
    moving = time_parameterize(points, [LANE], LIMITS, [1.0, 0.0], [1.0, 0.0], quick=True)
    check(moving, points, [LANE], LIMITS)
    assert moving.duration < quick.duration


def test_cells_that_meet_in_a_corner() -> None:
    cells = [Polytope.from_box([0, 0], [1, 1]), Polytope.from_box([1, 1], [2, 2])]
    points = [[0.2, 0.5], [1.0, 1.0], [1.5, 1.8]]
    check(time_parameterize(points, cells, LIMITS, quick=True), points, cells, LIMITS)


def test_from_a_point_on_the_face() -> None:
    points, cells = [[3.0, 0.5], [3.0, 0.5], [3.5, 1.0], [3.5, 3.5]], L_SHAPE[1]
    check(time_parameterize(points, cells, LIMITS, quick=True), points, cells, LIMITS)
    v, a = np.array([1.0, 0.2]), np.array([0.5, 0.0])
    moving = time_parameterize(points, cells, LIMITS, v, a, quick=True)
    check(moving, points, cells, LIMITS)
    check_start(moving, v, a)


def test_a_start_that_cannot_be_kept_inside_is_refused() -> None:
    with pytest.raises(QueryError, match="cannot be kept inside"):
        time_parameterize(*L_SHAPE, LIMITS, start_velocity=[-2.0, 0.0], quick=True)
