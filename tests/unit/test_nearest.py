"""Nearest points of hulls: Wolfe's algorithm against the cone program and against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hzmp_planners.sets import Polytope
from hzmp_planners.sets.form.form import GeneratorForm
from hzmp_planners.sets.form.queries import distance_by_axes, nearest_points
from hzmp_planners.sets.hulls.nearest import nearest_of_hulls

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(1, 4), st.sampled_from([1e-4, 1.0, 1e4]), st.booleans())
def test_nearest_pair_is_proved_by_its_slab_and_agrees_with_the_cone_program(
    seed: int, n: int, size: float, lattice: bool
) -> None:
    rng = np.random.default_rng(seed)
    k, m = rng.integers(1, 9, 2)
    V, W = rng.standard_normal((k, n)), rng.standard_normal((m, n)) + 2.0 * rng.standard_normal(n)
    if lattice:  # ties, repeated points, parallel and touching faces
        V, W = np.round(2.0 * V) / 2.0, np.round(2.0 * W) / 2.0
    V, W = size * V, size * W
    pair = nearest_of_hulls(V, W)
    reference = nearest_points(GeneratorForm.of_points(V), GeneratorForm.of_points(W))
    assert pair is not None
    assert reference is not None
    distance = float(np.linalg.norm(pair[1] - pair[0]))
    assert distance == pytest.approx(math.dist(*reference), abs=1e-7 * size)
    for points, x in zip((V, W), pair, strict=True):
        inside = distance_by_axes(GeneratorForm.of_points(points), x)
        assert inside <= 1e-7 * size
    if distance > 1e-8 * size:
        normal = (pair[1] - pair[0]) / distance
        assert (W @ normal).min() - (V @ normal).max() == pytest.approx(distance, abs=1e-9 * size)


@pytest.mark.parametrize("gap", [1e-12, 1e-9, 1e-6, 1e-3])
def test_narrow_gaps_keep_their_direction(gap: float) -> None:
    lower = Polytope.from_box([0, 0, 0], [3, 3, 1]).vertices()
    upper = Polytope.from_box([1, -1, 1], [2, 5, 4]).vertices() + np.array([0.0, 0.0, gap])
    pair = nearest_of_hulls(lower, upper)
    assert pair is not None
    np.testing.assert_allclose(pair[1] - pair[0], [0.0, 0.0, gap], atol=1e-14)


def test_hulls_that_overlap_have_a_common_point() -> None:
    V = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]])
    pair = nearest_of_hulls(V, V + 0.7)
    assert pair is not None
    assert math.dist(*pair) <= 1e-14
    assert Polytope.from_vertices(V).contains(pair[0])[0]
