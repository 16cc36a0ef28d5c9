import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from corridors import L_SHAPE, LIMITS, check, random_boxes
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking import Limits, time_parameterize

DATA = Path(__file__).parents[1] / "data"


@pytest.mark.parametrize("name", ["corridor_3", "corridor_4"])
def test_reference_corridors_are_near_the_best_known(name: str) -> None:
    case = json.loads((DATA / f"{name}.json").read_text())
    cells = [Polytope.from_halfspaces(cell["A"], cell["b"]) for cell in case["cells"]]
    trajectory = time_parameterize(case["waypoints"], cells, LIMITS)
    check(trajectory, case["waypoints"], cells, LIMITS, containment=-1e-6)
    assert trajectory.duration <= 1.02 * case["reference"]["best_known_s"]


@pytest.mark.parametrize(("K", "n", "seed"), [(2, 3, 0), (4, 2, 1), (6, 3, 2), (9, 2, 3),
                                              (12, 3, 4)])  # fmt: skip
@pytest.mark.parametrize(
    "limits",
    [
        Limits(2.0, 4.0, 20.0, speed=2.0, total_acceleration=4.0, total_jerk=20.0),
        Limits(2.0, 4.0, 20.0, total_acceleration=2.5),
        Limits(2.0, 3.0, 20.0, speed=2.5, total_jerk=25.0),
    ],
)
def test_norms_are_kept_at_every_instant(K: int, n: int, seed: int, limits: Limits) -> None:
    points, cells = random_boxes(np.random.default_rng(seed), K, n)
    trajectory = time_parameterize(points, cells, limits)
    check(trajectory, points, cells, limits)
    sample = trajectory.sample(np.linspace(0.0, trajectory.duration, 40_001)[:-1])
    rows = zip(trajectory.norm_peaks, sample[1:], limits.norms, strict=True)
    for peak, values, norm in rows:
        dense = float(np.linalg.norm(values, axis=1).max())
        assert peak <= norm * (1.0 + 1e-9)
        assert dense - 1e-9 <= peak <= dense + 1e-3  # over all instants, and not above them
    usage = trajectory.limit_usage[:, -1]
    assert usage == pytest.approx(trajectory.norm_peaks / np.array(limits.norms))
    assert trajectory.limit_usage.max() > 0.999


def test_norms_from_a_moving_start() -> None:
    limits = Limits(2.0, 4.0, 20.0, speed=2.0, total_acceleration=4.0, total_jerk=20.0)
    whole = time_parameterize(*L_SHAPE, limits)
    for t in (0.25, 0.5, 0.75):
        state = whole.sample(t * whole.duration)
        piece = int(np.searchsorted(whole.breakpoints, t * whole.duration, side="right")) - 1
        k = int(whole.piece_cells[piece])
        points = np.vstack([state.position, whole.waypoints[k + 1 :]])
        rest = time_parameterize(
            points, whole.cells[k:], limits, state.velocity[0], state.acceleration[0]
        )
        assert rest.limit_usage.max() <= 1.0 + 1e-9
        assert rest.containment <= 0.0
    with pytest.raises(QueryError, match=r"in all; the limit is 2"):
        time_parameterize(*L_SHAPE, limits, start_velocity=[1.8, 1.8])


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), [1.0, 2.0]])
def test_norms_that_make_no_sense_are_refused(bad: Any) -> None:
    with pytest.raises((QueryError, ShapeError), match="total_jerk"):
        Limits(total_jerk=bad)


@pytest.mark.parametrize(("K", "n", "seed"), [(2, 2, 0), (5, 3, 1), (9, 2, 2), (9, 3, 3),
                                              (25, 3, 4), (40, 2, 5)])  # fmt: skip
def test_random_chains_of_touching_boxes(K: int, n: int, seed: int) -> None:
    points, cells = random_boxes(np.random.default_rng(seed), K, n)
    check(time_parameterize(points, cells, LIMITS), points, cells, LIMITS)


def test_a_bend_is_passed_without_stopping() -> None:
    trajectory = time_parameterize(*L_SHAPE, LIMITS)
    check(trajectory, *L_SHAPE, LIMITS)
    t = np.linspace(0.3, trajectory.duration - 0.3, 2000)
    assert np.linalg.norm(trajectory.sample(t).velocity, axis=1).min() > 0.3


def test_a_straight_run_through_many_cells_takes_the_time_of_one() -> None:
    points = [[0.5, 0.5], *([k, 0.5] for k in range(1, 20)), [19.5, 0.5]]
    cells = [Polytope.from_box([k, 0], [k + 1, 1]) for k in range(20)]
    trajectory = time_parameterize(points, cells, LIMITS)
    whole = time_parameterize([points[0], points[-1]], [Polytope.from_box([0, 0], [20, 1])], LIMITS)
    check(trajectory, points, cells, LIMITS)
    assert trajectory.duration == pytest.approx(whole.duration, rel=1e-9)
    # 19 m: the speed limit, plus ramps v / a + a / j.
    assert whole.duration == pytest.approx(19 / 2 + 2 / 4 + 4 / 20)
    assert sorted(set(trajectory.piece_cells)) == list(range(20))


def test_limits_hold_on_each_axis() -> None:
    limits = Limits(velocity=[2.0, 0.5], acceleration=[4.0, 1.0], jerk=[20.0, 40.0])
    check(time_parameterize(*L_SHAPE, limits), *L_SHAPE, limits)


def test_duplicates_and_standing_still() -> None:
    points, cells = L_SHAPE
    repeated = [points[0], points[1], points[1], points[2], points[3], points[3]]
    chain = [cells[0], cells[1], cells[1], cells[2], cells[2]]
    check(time_parameterize(repeated, chain, LIMITS), repeated, chain, LIMITS)
    still = time_parameterize([points[0], points[0]], cells[:1], LIMITS)
    assert still.duration == 0.0
    assert still.containment == pytest.approx(-0.5)
    assert np.allclose(still.sample([0.0, 1.0]).position, points[0])


def test_cells_that_meet_in_a_corner_only() -> None:
    cells = [Polytope.from_box([0, 0], [1, 1]), Polytope.from_box([1, 1], [2, 2])]
    points = [[0.2, 0.5], [1.0, 1.0], [1.5, 1.8]]
    trajectory = time_parameterize(points, cells, LIMITS)
    check(trajectory, points, cells, LIMITS)


def test_start_and_goal_on_the_walls() -> None:
    points, cells = [[0.0, 0.0], [3.0, 0.5], [3.5, 1.0], [4.0, 4.0]], L_SHAPE[1]
    check(time_parameterize(points, cells, LIMITS), points, cells, LIMITS)


@pytest.mark.parametrize(("v", "a"), [([1.0, 0.5], None), ([-1.0, 0.0], None), ([2.0, 0.0], None),
                                      ([1.0, 0.5], [3.0, -1.0]),
                                      ([0.0, 0.0], [4.0, 0.0])])  # fmt: skip
def test_a_start_in_motion_goes_on_from_there(v: list[float], a: list[float] | None) -> None:
    trajectory = time_parameterize(*L_SHAPE, LIMITS, start_velocity=v, start_acceleration=a)
    check(trajectory, *L_SHAPE, LIMITS)
    start = trajectory.sample(0.0)
    assert start.velocity[0] == pytest.approx(v, abs=1e-8)
    assert start.acceleration[0] == pytest.approx(a or [0.0, 0.0], abs=1e-8)


def test_a_start_that_cannot_stop_inside_is_refused() -> None:
    with pytest.raises(QueryError, match=r"start_velocity.*cannot be kept inside"):
        time_parameterize(*L_SHAPE, LIMITS, start_velocity=[-2.0, 0.0])


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"waypoints": [[0.5, 0.5], [3.0, 0.5]]}, ShapeError, "3 cells need 4 waypoints, got 2"),
        ({"waypoints": [[0.5, np.nan]] * 4}, ShapeError, "finite"),
        ({"waypoints": [[0.5, 0.5, 0.0]] * 4}, ShapeError, "2 columns"),
        ({"waypoints": [[0.5, 0.5], [3.1, 0.5], [3.5, 1], [3.5, 3]]}, QueryError, "waypoint 1"),
        ({"cells": []}, ShapeError, "at least one"),
        ({"cells": [*L_SHAPE[1][:2], Polytope.from_box([0], [1])]}, ShapeError, "1 dimensions"),
        ({"limits": Limits(velocity=[1.0, 1.0, 1.0])}, ShapeError, "velocity"),
        ({"start_velocity": [3.0, 0.0]}, QueryError, "limit is 2"),
        ({"start_acceleration": [9.0, 0.0]}, QueryError, "limit is 4"),
        ({"start_velocity": [1.0]}, ShapeError, "2 coordinates"),
    ],
)
def test_bad_input_has_one_clear_line(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    arguments: dict[str, Any] = {
        "waypoints": L_SHAPE[0],
        "cells": L_SHAPE[1],
        "limits": LIMITS,
    } | change
    with pytest.raises(error, match=message) as caught:
        time_parameterize(**arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [-1.0, 0.0, np.nan, np.inf, "fast", [1.0, -1.0], [[1.0]]])
def test_limits_are_positive_and_finite(value: Any) -> None:
    with pytest.raises((QueryError, ShapeError), match="limit jerk"):
        Limits(jerk=value)


def test_samples_outside_the_duration_are_clamped() -> None:
    trajectory = time_parameterize(*L_SHAPE, LIMITS, start_velocity=[1.0, 0.0])
    sample = trajectory.sample([-1.0, 0.0, trajectory.duration + 1.0])
    assert np.allclose(sample.position[[0, 1]], L_SHAPE[0][0])
    assert np.array_equal(sample.velocity[0], sample.velocity[1])
    assert np.allclose(sample.position[2], L_SHAPE[0][-1])
    assert not any(part[2].any() for part in sample[1:])
    with pytest.raises(ShapeError):
        trajectory.sample(np.nan)
