"""Parts, joins and files of trajectories are exact."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking import Limits, Trajectory, time_parameterize

LIMITS = Limits(velocity=2.0, acceleration=4.0, jerk=20.0)
CELLS = [Polytope.from_box(*box) for box in (([0, 0], [3, 1]), ([3, 0], [4, 1]), ([3, 1], [4, 4]))]
FORMATS = ("trajectory.json", "trajectory.npz", "trajectory.parquet")


@pytest.fixture(scope="module")
def curve() -> Trajectory:
    return time_parameterize([[0.5, 0.5], [3.0, 0.5], [3.5, 1.0], [3.5, 3.5]], CELLS, LIMITS)


def assert_same_motion(one: Trajectory, two: Trajectory, offset: float = 0.0) -> None:
    """Until the end of one, which begins `offset` later than two."""
    t = np.linspace(0.0, one.duration, 1001)[:-1]
    for a, b in zip(one.sample(t)[:3], two.sample(t + offset)[:3], strict=True):
        assert np.allclose(a, b, rtol=0.0, atol=1e-11)


def test_parts_are_the_same_motion_and_as_proved(curve: Trajectory) -> None:
    rng = np.random.default_rng(0)
    spans = np.sort(rng.uniform(0.0, curve.duration, (20, 2)), axis=1).tolist()
    knots = curve.breakpoints.tolist()
    for start, end in [*spans, [0.0, curve.duration], knots[3:5], knots[:2]]:
        part = curve.part(start, end)
        assert part.duration == pytest.approx(end - start, abs=1e-12)
        assert_same_motion(part, curve, start)
        assert part.containment <= curve.containment + 1e-12
        assert len(part.waypoints) == len(part.cells) + 1
        assert np.allclose(part.waypoints[[0, -1]], curve.sample([start, end]).position)


@pytest.mark.parametrize("span", [(1.0, 1.0), (2.0, 1.0), (-0.1, 1.0), (0.0, 99.0), (np.nan, 1.0)])
def test_parts_that_are_none_are_refused(curve: Trajectory, span: tuple[float, float]) -> None:
    with pytest.raises(QueryError, match="no part from"):
        curve.part(*span)


def test_joined_parts_are_the_whole(curve: Trajectory) -> None:
    cuts = np.linspace(0.0, curve.duration, 6)
    parts = [curve.part(*span) for span in pairwise(cuts.tolist())]
    whole = Trajectory.join(parts)
    assert whole.duration == pytest.approx(curve.duration, abs=1e-12)
    assert_same_motion(whole, curve)
    assert whole.containment == pytest.approx(curve.containment, abs=1e-12)
    assert len(whole.waypoints) == len(whole.cells) + 1
    for k, cell in enumerate(whole.cells):
        assert cell.violation(whole.waypoints[k : k + 2]).max() <= 1e-9


def test_there_and_back_again(curve: Trajectory) -> None:
    back = time_parameterize(curve.waypoints[::-1], CELLS[::-1], LIMITS)
    both = Trajectory.join([curve, back, curve])
    assert both.duration == pytest.approx(2.0 * curve.duration + back.duration)
    assert both.containment <= 0.0
    assert len(both.cells) == 7  # where one ends the next begins, in the same cell
    assert np.allclose(both.sample(both.duration).position, [[3.5, 3.5]])


def test_what_does_not_go_on_is_refused(curve: Trajectory) -> None:
    half, rest = curve.part(0.0, 1.5), curve.part(1.5, curve.duration)
    with pytest.raises(ShapeError, match="no trajectory"):
        Trajectory.join([])
    with pytest.raises(QueryError, match="position is off"):
        Trajectory.join([half, curve])
    still = time_parameterize([half.waypoints[-1]] * 2, CELLS[:1], LIMITS)
    with pytest.raises(QueryError, match="velocity is off"):
        Trajectory.join([half, still])
    slow = Trajectory(rest.breakpoints, rest.coefficients, rest.piece_cells, rest.cells,
                      rest.waypoints, Limits(velocity=3.0))  # fmt: skip
    with pytest.raises(QueryError, match="different limits"):
        Trajectory.join([half, slow])
    line = time_parameterize([[0.0], [1.0]], [Polytope.from_box([0.0], [1.0])], LIMITS)
    with pytest.raises(ShapeError, match="dimension"):
        Trajectory.join([half, line])


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize(
    "limits",
    [LIMITS, Limits([2.0, 1.0], 4.0, [30.0, 20.0]), Limits(2.0, 4.0, 20.0, total_jerk=18.0)],
)
def test_files_keep_every_bit(tmp_path: Path, name: str, limits: Limits) -> None:
    curve = time_parameterize([[0.5, 0.5], [3.0, 0.5], [3.5, 0.7]], CELLS[:2], limits)
    curve.save(tmp_path / name)
    again = Trajectory.load(tmp_path / name)
    for field in ("breakpoints", "coefficients", "piece_cells", "waypoints"):
        assert np.array_equal(getattr(again, field), getattr(curve, field))
        assert getattr(again, field).dtype == getattr(curve, field).dtype
    assert again.containment == curve.containment
    assert np.array_equal(again.limit_usage, curve.limit_usage)
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert Trajectory.from_json(curve.to_json()).to_json() == curve.to_json()


def test_usage_of_limits_is_that_of_the_peaks(curve: Trajectory) -> None:
    assert curve.limit_usage.shape == (3, 3)  # two axes and the norm
    assert 0.99 < curve.limit_usage.max() <= 1.0 + 1e-9
    sample = curve.sample(np.linspace(0.0, curve.duration, 20001))
    assert (np.abs(sample.velocity).max(axis=0) <= curve.limit_usage[0, :2] * 2.0 + 1e-12).all()


@pytest.mark.parametrize("name", FORMATS)
def test_files_that_are_none_are_refused(tmp_path: Path, curve: Trajectory, name: str) -> None:
    path = tmp_path / name
    with pytest.raises(OSError, match="No such file"):
        Trajectory.load(path)
    for content in (b"", b"nonsense", b"{}", b"[1]", curve.to_json().replace("1", "]").encode()):
        path.write_bytes(content)
        with pytest.raises(ShapeError, match="not a saved trajectory"):
            Trajectory.load(path)
    curve.save(path)
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(ShapeError, match="not a saved trajectory"):
        Trajectory.load(path)


def test_other_suffixes_formats_and_sizes_are_refused(tmp_path: Path, curve: Trajectory) -> None:
    for act in (curve.save, Trajectory.load):
        with pytest.raises(QueryError, match=r"does not end in \.json"):
            act(tmp_path / "trajectory.csv")
    held = json.loads(curve.to_json())
    changes: list[dict[str, object]] = [
        {"format": "other"}, {"breakpoints": [0.0, 1.0]}, {"cells": 3}, {"limits": {}},
    ]  # fmt: skip
    for change in changes:
        with pytest.raises(ShapeError):
            Trajectory.from_json(json.dumps(held | change))


def test_picture_shows_all_derivatives_and_the_limits(curve: Trajectory) -> None:
    axes = curve.plot()
    assert [ax.get_ylabel().split()[0] for ax in axes] == [
        "position", "velocity", "acceleration", "jerk",
    ]  # fmt: skip
    highest = max(float(np.max(line.get_ydata())) for line in axes[1].lines)
    assert highest == pytest.approx(2.0, abs=1e-9)
    assert axes[0].figure.axes == list(axes)
