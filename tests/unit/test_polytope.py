from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from hzmp_planners.errors import ShapeError
from hzmp_planners.sets import Polytope
from oracles import Floats, largest_ball, minimum, rotation


def same_points(one: Floats, two: Floats, tol: float) -> bool:
    distance = np.linalg.norm(one[:, None] - two[None], axis=2)
    return bool(distance.min(axis=0).max() <= tol and distance.min(axis=1).max() <= tol)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_three_forms_of_a_box_are_one_set(n: int) -> None:
    rng = np.random.default_rng(n)
    lo = rng.standard_normal(n)
    hi = lo + rng.random(n) + 0.1
    box = Polytope.from_box(lo, hi)
    assert len(box.vertices()) == 2**n
    for other in (Polytope.from_vertices(box.vertices()), Polytope.from_halfspaces(box.A, box.b)):
        assert same_points(other.vertices(), box.vertices(), 1e-12)
        assert sorted(map(tuple, np.round(other.A, 9) + 0.0)) == sorted(map(tuple, box.A + 0.0))
        assert other.volume() == pytest.approx(np.prod(hi - lo), rel=1e-12)


@given(
    st.integers(2, 3),
    st.integers(4, 14),
    st.integers(0, 2**32 - 1),
    st.floats(-4.0, 4.0),
    st.floats(-4.0, 4.0),
)
def test_hull_agrees_with_qhull_at_every_scale(
    n: int, count: int, seed: int, size: float, offset: float
) -> None:
    rng = np.random.default_rng(seed)
    scale = 10.0**size
    points = rng.standard_normal((count, n)) * scale + 10.0**offset
    tol = 1e-9 * scale + 1e-14 * 10.0**offset
    hull = ConvexHull((points - points.mean(axis=0)) / scale)
    body = Polytope.from_vertices(points)
    np.testing.assert_allclose(np.linalg.norm(body.A, axis=1), 1.0, atol=1e-12)
    assert same_points(body.vertices(), points[hull.vertices], tol)
    assert body.contains(points, tol).all()
    assert body.volume() == pytest.approx(hull.volume * scale**n, rel=1e-6)
    # Points pushed out of the hull along its normals are outside by just that much.
    middles = points[hull.simplices].mean(axis=1)
    pushed = middles + 0.1 * scale * hull.equations[:, :-1]
    assert (body.violation(pushed) > 0.1 * scale - tol).all()
    again = Polytope.from_halfspaces(body.A, body.b)
    assert same_points(again.vertices(), body.vertices(), 1e-6 * scale + tol)


def test_support_and_emptiness_agree_with_linear_programs() -> None:
    rng = np.random.default_rng(3)
    empty = 0
    for trial in range(60):
        n = 2 + trial % 2
        A = rng.standard_normal((7, n))
        b = rng.standard_normal(7) * 0.4 + 0.3
        A, b = np.vstack([A, np.eye(n), -np.eye(n)]), np.append(b, np.full(2 * n, 2.0))
        body, d = Polytope.from_halfspaces(A, b), rng.standard_normal(n)
        least = minimum(-d, A, b)
        assert body.is_empty() == (least is None)
        empty += body.is_empty()
        expected = -np.inf if least is None else -least[0]
        assert body.support(d) == pytest.approx(expected, abs=1e-8)
        assert body.contains(body.vertices(), 1e-9).all()
    assert 0 < empty < 60


@pytest.mark.parametrize("size", [1e-4, 1e-2, 1.0, 1e2, 1e4])
@pytest.mark.parametrize(("n", "rank"), [(2, 0), (2, 1), (3, 0), (3, 1), (3, 2)])
def test_flat_sets_keep_their_dimension_in_both_forms(n: int, rank: int, size: float) -> None:
    rng = np.random.default_rng(10 * n + rank)
    plane, origin = rotation(rng, n)[:, :rank], rng.standard_normal(n) * size
    inner = rng.standard_normal((6, rank)) * size
    flat = Polytope.from_vertices(origin + inner @ plane.T)
    expected = {0: 1, 1: 2}.get(rank) or len(ConvexHull(inner).vertices)
    assert len(flat.vertices()) == expected
    assert flat.volume() == 0.0
    assert not flat.is_empty()
    assert largest_ball(flat.A, flat.b)[0] <= 1e-9 * size
    inside = flat.vertices().mean(axis=0)
    off = np.linalg.svd(plane.T)[2][rank] if rank else np.eye(n)[0]
    assert flat.violation([inside, inside + 0.01 * size * off])[0] <= 1e-12 * size
    assert flat.violation(inside + 0.01 * size * off)[0] >= 0.005 * size
    # The same set from half-spaces alone.
    again = Polytope.from_halfspaces(flat.A, flat.b)
    assert same_points(again.vertices(), flat.vertices(), 1e-6 * max(size, 1.0))


@pytest.mark.parametrize("thin", [1e-4, 1e-6, 1e-8])
def test_badly_proportioned_boxes_keep_every_facet(thin: float) -> None:
    rng = np.random.default_rng(7)
    for n in (2, 3):
        sides = np.append(thin, np.full(n - 1, 1.0))
        turned = Polytope.from_box(-sides, sides).vertices() @ rotation(rng, n).T
        body = Polytope.from_vertices(turned)
        assert len(body.vertices()) == 2**n
        assert body.volume() == pytest.approx(np.prod(2 * sides), rel=1e-6)
        width = [body.support(a) + body.support(-a) for a in body.A]
        assert min(width) == pytest.approx(2 * thin, rel=1e-5)


def test_points_that_differ_by_round_off_are_one_point() -> None:
    rng = np.random.default_rng(0)
    for n in (1, 2, 3):
        point = Polytope.from_vertices(0.7 + 1e-16 * rng.standard_normal((9, n)))
        assert point.vertices().shape == (1, n)
        assert point.contains([[0.7] * n], 1e-12).all()


def test_far_from_the_origin_flat_is_still_flat() -> None:
    rng = np.random.default_rng(1)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * 1e-4
    body = Polytope.from_vertices(square @ rotation(rng, 3).T + 1e4)
    assert len(body.vertices()) == 4
    assert body.volume() == pytest.approx(0.0, abs=1e-15)


UNBOUNDED: dict[str, tuple[list[list[float]], list[float]]] = {
    "half-plane": ([[1, 0]], [1]),
    "quadrant": ([[1, 0], [0, 1]], [1, 1]),
    "slab": ([[1, 0], [-1, 0]], [1, 1]),
    "half-slab": ([[1, 0], [0, 1], [-1, 0]], [1, 1, 1]),
    "cone": ([[1, 0.3], [0.2, 1], [-1, 0.1]], [1, 1, 1]),
    "prism": ([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], [1, 1, 1, 1]),
    "line": ([[1, 0], [-1, 0]], [1, -1]),
    "ray": ([[1, 0], [-1, 0], [0, 1]], [1, -1, 1]),
}


@pytest.mark.parametrize("name", UNBOUNDED)
def test_unbounded_sets_say_so(name: str) -> None:
    body = Polytope.from_halfspaces(*UNBOUNDED[name])
    assert body.contains(np.zeros((1, body.n)), 2.0).all()  # the half-spaces need no vertices
    with pytest.raises(ShapeError, match="unbounded"):
        _ = body.vertices()


BAD: dict[str, Callable[[], Polytope]] = {
    "no points": lambda: Polytope.from_vertices(np.zeros((0, 2))),
    "nan": lambda: Polytope.from_vertices([[0.0, np.nan]]),
    "infinite": lambda: Polytope.from_box([0.0], [np.inf]),
    "ragged": lambda: Polytope.from_vertices([[0.0, 1.0], [1.0]]),
    "text": lambda: Polytope.from_vertices("box"),
    "corners swapped": lambda: Polytope.from_box([0.0, 1.0], [1.0, 0.0]),
    "corners of two lengths": lambda: Polytope.from_box([0.0], [1.0, 1.0]),
    "zero row": lambda: Polytope.from_halfspaces([[0.0, 0.0]], [1.0]),
    "no row": lambda: Polytope.from_halfspaces(np.zeros((0, 2)), []),
    "rows and offsets": lambda: Polytope.from_halfspaces([[1.0, 0.0]], [1.0, 2.0]),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_clear_line(name: str) -> None:
    with pytest.raises(ShapeError) as caught:
        BAD[name]()
    assert "\n" not in str(caught.value)


def test_arrays_are_copies_that_nobody_can_change() -> None:
    lo = np.zeros(2)
    box = Polytope.from_box(lo, [1.0, 1.0])
    lo[:] = -5.0
    assert box.vertices().min() == 0.0
    for array in (box.A, box.b, box.vertices(), box.incidence):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_incidence_marks_the_vertices_of_each_facet() -> None:
    cube = Polytope.from_box(np.zeros(3), np.ones(3))
    assert cube.incidence.sum(axis=0).tolist() == [4] * 6
    assert cube.incidence.sum(axis=1).tolist() == [3] * 8
