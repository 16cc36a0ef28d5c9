from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import LinearConstraint, minimize

from hzmp_planners.planning.detour import bottleneck_bound, least_detour
from oracles import Floats, random_world, rotation

seeds = st.integers(0, 2**32 - 1)


def detour(x: Floats, s: Floats, g: Floats) -> float:
    return float(np.linalg.norm(x - s) + np.linalg.norm(x - g))


def searched(corners: Floats, s: Floats, g: Floats) -> float:
    """The least detour by numerical minimisation over barycentric weights."""
    k = len(corners)
    best = min(detour(corner, s, g) for corner in corners)

    def length(w: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
        return detour(w @ corners, s, g)

    for first in [np.full(k, 1.0 / k), *(0.9 * np.eye(k) + 0.1 / k)]:
        result = minimize(
            length,
            first,
            bounds=[(0.0, 1.0)] * k,
            constraints=LinearConstraint(np.ones((1, k)), 1.0, 1.0),
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 200},
        )
        weights = np.maximum(result.x, 0.0)
        best = min(best, detour(weights / weights.sum() @ corners, s, g))
    return best


def polygon(rng: np.random.Generator, n: int, size: float, offset: float) -> Floats:
    """A segment in the plane, a convex polygon in space, of 3 to 6 corners."""
    origin = offset * rng.standard_normal(n)
    if n == 2:
        return origin + size * rng.standard_normal((2, 2))
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, int(rng.integers(3, 7))))
    flat = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    return origin + size * (flat @ rotation(rng, 3).T)


@pytest.mark.parametrize("n", [2, 3])
def test_least_detour_against_numerical_search(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(40):
        corners = polygon(rng, n, 1.0, 1.0)
        s, g = corners.mean(axis=0) + 1.5 * rng.standard_normal((2, n))
        least, where = least_detour(corners[None], s, g)
        assert least[0] == pytest.approx(searched(corners, s, g), rel=1e-6)
        assert least[0] == pytest.approx(detour(where[0], s, g), abs=1e-12)


@given(seeds, st.integers(2, 3), st.sampled_from([1e-3, 1.0, 1e2]), st.sampled_from([0.0, 1e3]))
def test_the_minimiser_is_on_the_face_and_nothing_on_it_is_better(
    seed: int, n: int, size: float, offset: float
) -> None:
    """Convexity makes local optimality enough: no corner direction descends."""
    rng = np.random.default_rng(seed)
    corners = polygon(rng, n, size, offset)
    s, g = corners.mean(axis=0) + size * rng.standard_normal((2, n))
    least, where = least_detour(corners[None], s, g)
    tol = 1e-9 * size + 1e-13 * offset
    weights = np.vstack([corners.T, np.ones(len(corners))])
    found = np.linalg.lstsq(weights, np.append(where[0], 1.0), rcond=None)[0]
    np.testing.assert_allclose(weights @ found, np.append(where[0], 1.0), atol=tol)
    assert least[0] == pytest.approx(detour(where[0], s, g), abs=tol)
    samples = rng.dirichlet(np.ones(len(corners)), 200) @ corners
    near = where[0] + 1e-2 * (samples - where[0])
    for points in (samples, near):
        sums = np.linalg.norm(points - s, axis=1) + np.linalg.norm(points - g, axis=1)
        assert sums.min() >= least[0] - tol
    inside = polygon_violation(corners, where[0])
    assert inside <= tol


def polygon_violation(corners: Floats, x: Floats) -> float:
    """How far x is outside the segment or convex polygon, within its line or plane [m]."""
    if corners.shape[1] == 2:
        d = corners[1] - corners[0]
        along = (x - corners[0]) @ d / np.linalg.norm(d)
        return float(max(-along, along - np.linalg.norm(d)))
    normal = np.linalg.svd(corners - corners.mean(axis=0))[2][2]
    edges = np.roll(corners, -1, axis=0) - corners
    inward = np.cross(normal, edges)
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    inward *= np.sign(((corners.mean(axis=0) - corners) * inward).sum(axis=1))[:, None]
    return float(-(((x - corners) * inward).sum(axis=1)).min())


SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 0], [0, 1, 0]])
SEGMENT = np.array([[0.0, 0.0], [1.0, 0.0]])
INSIDE, EDGE, CORNER, LEFT, FAR = (
    [0.4, 0.3, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.0], [-1.0, 0.5, 0.0], [-2.0, 0.5, 0.0],
)  # fmt: skip
ABOVE, BELOW, BESIDE = [0.5, 0.5, 1.0], [0.5, 0.5, -1.0], [3.0, 0.5, 1.0]


@pytest.mark.parametrize(
    ("corners", "s", "g", "expected"),
    [
        (SQUARE, ABOVE, BELOW, 2.0),  # straight through
        (SQUARE, ABOVE, ABOVE, 2.0),  # there and back
        (SQUARE, ABOVE, [0.5, 0.5, 2.0], 3.0),  # mirrored
        (SQUARE, INSIDE, INSIDE, 0.0),
        (SQUARE, INSIDE, ABOVE, np.linalg.norm(np.subtract(ABOVE, INSIDE))),
        (SQUARE, EDGE, CORNER, 0.5),
        (SQUARE, LEFT, [2.0, 0.5, 0.0], 3.0),  # in the plane, across the square
        (SQUARE, LEFT, FAR, 3.0),  # in the plane, both on one side
        (SQUARE, LEFT, LEFT, 2.0),
        (SQUARE, CORNER, CORNER, 0.0),
        (SQUARE, BESIDE, BESIDE, 2.0 * np.sqrt(5.0)),
        (SEGMENT, [0.5, 1.0], [0.5, -1.0], 2.0),
        (SEGMENT, [0.5, 1.0], [0.5, 1.0], 2.0),
        (SEGMENT, [-1.0, 0.0], [2.0, 0.0], 3.0),  # on the line, across the segment
        (SEGMENT, [-1.0, 0.0], [-2.0, 0.0], 3.0),  # on the line, both on one side
        (SEGMENT, [2.0, 0.0], [3.0, 0.0], 3.0),
        (SEGMENT, [0.3, 0.0], [0.6, 0.0], 0.3),
        (SEGMENT, [0.0, 0.0], [0.0, 0.0], 0.0),
        (SEGMENT, [0.0, 0.0], [2.0, 0.0], 2.0),
        (np.array([[1.0, 1.0], [1.0, 1.0]]), [0.0, 1.0], [1.0, 0.0], 2.0),  # a point
    ],
)
def test_degenerate_positions(corners: Floats, s: Floats, g: Floats, expected: float) -> None:
    for turned in (corners, corners[::-1]):
        for one, two in ((s, g), (g, s)):
            least, where = least_detour(turned[None], np.array(one), np.array(two))
            assert least[0] == pytest.approx(expected, abs=1e-12)
            assert detour(where[0], np.array(s), np.array(g)) == pytest.approx(expected, abs=1e-12)


def test_many_faces_at_once_give_what_each_gives_alone() -> None:
    rng = np.random.default_rng(0)
    corners = random_world(rng, "hulls", 3, 3).free_space().graph.corners
    s, g = rng.random((2, len(corners), 3))
    least, where = least_detour(corners, s, g)
    for i in range(0, len(corners), 7):
        alone, point = least_detour(corners[i : i + 1], s[i], g[i])
        assert alone[0] == least[i]
        assert np.array_equal(point[0], where[i])


def test_bottleneck_is_the_cheapest_worst_door_of_all_routes() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        leaves, doors = 7, 9
        ends = np.array([rng.choice(leaves, 2, replace=False) for _ in range(doors)])
        cost = rng.random(doors)
        # Minimax by relaxing "worst door so far" until nothing changes.
        worst = np.full(leaves, np.inf)
        worst[[0, 1]] = 0.0
        for _ in range(leaves):
            for (i, j), c in zip(ends.tolist(), cost.tolist(), strict=True):
                worst[j] = min(worst[j], max(worst[i], c))
                worst[i] = min(worst[i], max(worst[j], c))
        goals = np.array([5, 6])
        found = bottleneck_bound(cost, ends, leaves, np.array([0, 1]), goals)
        assert found == worst[goals].min()
