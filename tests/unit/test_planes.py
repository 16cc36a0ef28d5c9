from __future__ import annotations

import numpy as np
import pytest

from hzmp_planners.free_space.planes import PlaneTable

A = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
b = np.array([2.0, -2.0, 1.0, 3.0])


def test_opposite_and_repeated_half_spaces_are_one_plane() -> None:
    table, codes = PlaneTable.empty(2, 1.0).extended(A, b)
    assert codes.tolist() == [1, 0, 3, 5]
    assert np.array_equal(table.normals, A[[0, 2, 3]])
    normals, offsets = table.halfspaces(codes)
    assert np.array_equal(normals, A)
    assert np.array_equal(offsets, b)


def test_known_planes_keep_their_numbers() -> None:
    table, _ = PlaneTable.empty(2, 1.0).extended(A, b)
    wider, codes = table.extended(np.array([[0.0, -1.0], [-1.0, 0.0]]), np.array([-1.0, 5.0]))
    assert codes.tolist() == [2, 7]
    assert np.array_equal(wider.offsets[:3], table.offsets)
    again, same = wider.extended(A, b)
    assert same.tolist() == [1, 0, 3, 5]
    assert len(again.offsets) == len(wider.offsets)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_planes_within_a_billionth_of_the_scale_are_one(scale: float) -> None:
    rng = np.random.default_rng(0)
    offsets = scale * (0.3 + np.array([0.0, 2e-10, -3e-10, 1e-6]))
    normals = np.tile([0.6, 0.8], (4, 1)) * np.array([[1.0], [-1.0], [1.0], [1.0]])
    offsets[1] *= -1.0
    table, codes = PlaneTable.empty(2, scale).extended(normals, offsets)
    assert codes.tolist() == [1, 0, 1, 3]
    _, codes = table.extended(
        *(x[rng.permutation(4)] for x in (normals[:1].repeat(4, 0), offsets[[0] * 4]))
    )
    assert codes.tolist() == [1] * 4


def test_an_empty_list_adds_nothing() -> None:
    table, codes = PlaneTable.empty(3, 1.0).extended(np.zeros((0, 3)), np.zeros(0))
    assert codes.size == 0
    assert table.normals.shape == (0, 3)
