"""Sets side by side, and slabs of time that are made once."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import hzmp_sim as hz
from hzmp_planners.sets import Polytope
from hzmp_sim.motion.hulls import Hulls
from moving_worlds import SCRIPT, WORLD, flown

CUBE = Polytope.from_box((0, 0, 0), (1, 1, 1))


def three() -> Hulls:
    """A cube, nothing, and a cube with its corner cut off, which has one facet more."""
    A = np.concatenate([CUBE.A, np.full((1, 3), 3.0**-0.5)])
    b = np.array([[*CUBE.b, np.inf], [-np.inf] * 7, [*CUBE.b, 1.0]])
    return Hulls(np.repeat(A[None], 3, axis=0), b)


def test_polytopes_of_those_that_exist() -> None:
    hulls = three()
    assert hulls.exist.tolist() == [True, False, True]
    cube, nothing, cut = hulls
    assert nothing is None
    assert cube is not None
    assert cut is not None
    assert cube.volume() == pytest.approx(1.0)
    assert cut.volume() < 0.9
    assert [each is None for each in hulls[1:]] == [True, False]
    assert len(Hulls.none(2)) == 0
    assert not Hulls.none(2).contain(np.zeros(2)).size


def test_points_are_in_the_sets_that_hold_them() -> None:
    hulls = three()
    rng = np.random.default_rng(1)
    for point in rng.uniform(-0.2, 1.2, (200, 3)):
        expected = [each is not None and bool(each.contains(point[None])[0]) for each in hulls]
        assert hulls.contain(point).tolist() == expected


def test_rows_are_taken_out_and_replaced() -> None:
    hulls, moved = three(), Hulls(three().A, three().b + 0.5)
    rows = np.array([True, False, False])
    assert hulls.without(rows).exist.tolist() == [False, False, True]
    mixed = hulls.replaced(rows, moved)
    assert np.array_equal(mixed.b[0], moved.b[0])
    assert np.array_equal(mixed.b[2], hulls.b[2])


def test_boxes_know_their_vertices() -> None:
    scene = hz.load_scene(mujoco.MjSpec.from_string(WORLD), "point", motion=SCRIPT)
    prediction = hz.Predictor(scene).predict(flown(scene), 0.0)
    window = np.full(len(scene.moving), 0.4), np.full(len(scene.moving), 1.0)
    boxes, hulls = prediction.boxes(*window), prediction.hulls(*window)
    assert any(each is not None for each in boxes)
    for box, hull in zip(boxes, hulls, strict=True):
        assert (box is None) == (hull is None)
        if box is not None and hull is not None:
            again = Polytope.from_halfspaces(box.A, box.b)
            assert again.volume() == pytest.approx(box.volume())
            assert box.violation(hull.vertices()).max() < 1e-7


def test_slabs_do_not_hang_on_what_was_asked_before() -> None:
    scene = hz.load_scene(mujoco.MjSpec.from_string(WORLD), "point", motion=SCRIPT)
    data = flown(scene)
    one, other = (hz.Predictor(scene).predict(data, 0.0) for _ in range(2))
    whole = one.slabs(0.0, 0.05, 60)
    for start, count in ((1.0, 10), (0.42, 8), (2.5, 10), (0.0, 60)):
        part = other.slabs(start, 0.05, count)
        first = round(part.start / 0.05)
        assert part.start <= start + 1e-9 < part.start + 0.05 + 2e-9
        np.testing.assert_allclose(part.b, whole.b[first : first + count], atol=1e-12)
