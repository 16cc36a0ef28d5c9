"""Cells cut in batches, against the one-cell double description and hulls of vertices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from hzmp_planners.free_space.boxes import box_cell
from hzmp_planners.free_space.cells import Cells, clip, join_cells
from hzmp_planners.free_space.polygons import Polygons
from hzmp_planners.free_space.polyhedra import Polyhedra
from hzmp_planners.sets.hulls.cell import Cell
from oracles import Floats, halfspace_volume

TOL = 1e-12


def boxes(n: int, count: int) -> Cells:
    return box_cell(np.zeros(n), np.ones(n), np.arange(2 * n)).take(np.zeros(count, dtype=np.int64))


def random_planes(rng: np.random.Generator, n: int, count: int) -> tuple[Floats, Floats]:
    normals = rng.standard_normal((count, n))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals, (normals * rng.uniform(0.1, 0.9, (count, n))).sum(axis=1)


def corners(cells: Cells, i: int) -> Floats:
    return cells.vertices[cells.vertex_starts[i] : cells.vertex_starts[i + 1]]


def volume(cells: Cells, i: int) -> float:
    return float(ConvexHull(corners(cells, i)).volume)


def divide(cells: Cells, normals: Floats, offsets: Floats, label: int) -> Cells:
    labels = np.column_stack([np.full(len(cells), label), np.full(len(cells), label + 1)])
    wanted = np.ones((len(cells), 2), dtype=np.bool_)
    return cells.divide(labels, normals, offsets, TOL, wanted)[0]


@pytest.mark.parametrize("n", [2, 3])
def test_parts_are_those_of_the_double_description(n: int) -> None:
    rng = np.random.default_rng(n)
    cells = boxes(n, 20)
    upper = [2**k for k in range(n)]
    corner_masks = [
        sum(1 << (k if point[k] else n + k) for k in range(n)) for point in corners(cells, 0)
    ]
    assert len(upper) == n
    reference = [
        Cell(corners(cells, i), list(corner_masks), [(k, 1) for k in range(2 * n)])
        for i in range(20)
    ]
    for step in range(6):
        normals, offsets = random_planes(rng, n, len(cells))
        parts: list[Cell] = []
        for cell, normal, offset in zip(reference, normals, offsets, strict=True):
            heights = cell.vertices @ normal - offset
            if heights.min() < -TOL and heights.max() > TOL:
                parts.extend(cell.split(10 + step, heights, TOL))
            else:
                parts.append(cell)
        cells = divide(cells, normals, offsets, 100 + 2 * step)
        reference = parts
        assert len(cells) == len(reference)
        for i, cell in enumerate(reference):
            mine = corners(cells, i)
            assert mine.shape == cell.vertices.shape
            assert np.allclose(
                mine[np.lexsort(mine.round(9).T)],
                cell.vertices[np.lexsort(cell.vertices.round(9).T)],
                atol=1e-9,
            )
    assert sum(volume(cells, i) for i in range(len(cells))) == pytest.approx(20.0, rel=1e-12)


@pytest.mark.parametrize("n", [2, 3])
def test_cuts_through_vertices_and_edges_add_no_vertices(n: int) -> None:
    cells = boxes(n, 1)
    diagonal = np.zeros((1, n))
    diagonal[0, :2] = (np.sqrt(0.5), -np.sqrt(0.5))
    parts = divide(cells, diagonal, np.zeros(1), 50)
    assert [len(corners(parts, i)) for i in (0, 1)] == [3 * 2 ** (n - 2)] * 2
    assert [volume(parts, i) for i in (0, 1)] == pytest.approx([0.5, 0.5])
    touching = divide(cells, diagonal, np.array([np.sqrt(0.5)]), 50)
    assert len(touching) == 1
    assert np.array_equal(touching.vertices, cells.vertices)
    assert np.array_equal(touching.facets, cells.facets)


@pytest.mark.parametrize("n", [2, 3])
def test_facets_and_edges_close_up(n: int) -> None:
    rng = np.random.default_rng(5 + n)
    cells = boxes(n, 8)
    for step in range(5):
        cells = divide(cells, *random_planes(rng, n, len(cells)), 100 + 2 * step)
    cell, label, vertex = cells.incidence()
    for i in range(len(cells)):
        pairs = {(a, b) for a, b in zip(label[cell == i], vertex[cell == i], strict=True)}
        facets = cells.facets[cells.facet_starts[i] : cells.facet_starts[i + 1]]
        assert {a for a, _ in pairs} == set(facets.tolist())
        if isinstance(cells, Polyhedra):
            edges = cells.edge_starts[i + 1] - cells.edge_starts[i]
            assert len(corners(cells, i)) - edges + len(facets) == 2  # Euler
        assert all(sum(b == v for _, b in pairs) >= n for v in set(vertex[cell == i].tolist()))


@pytest.mark.parametrize("n", [2, 3])
def test_clipping_each_cell_by_its_own_list(n: int) -> None:
    rng = np.random.default_rng(n)
    counts = np.array([0, 3, 1, 5, 2])
    A, b = random_planes(rng, n, int(counts.sum()))
    starts = np.concatenate([[0], counts.cumsum()])
    parts, origin = clip(boxes(n, 5), A, b, np.arange(len(b)) + 50, starts, TOL)
    walls = np.concatenate([np.eye(n), -np.eye(n)])
    limits = np.concatenate([np.ones(n), np.zeros(n)])
    for i in range(5):
        rows = slice(starts[i], starts[i + 1])
        expected = halfspace_volume(np.vstack([walls, A[rows]]), np.append(limits, b[rows]))
        found = [volume(parts, k) for k in (origin == i).nonzero()[0]]
        assert sum(found) == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_only_the_wanted_sides_are_kept() -> None:
    cells = boxes(3, 3)
    normals, offsets = np.tile([1.0, 0.0, 0.0], (3, 1)), np.full(3, 0.25)
    wanted = np.array([[True, False], [False, True], [False, False]])
    labels = np.tile([7, 8], (3, 1))
    parts, parent, side = cells.divide(labels, normals, offsets, TOL, wanted)
    assert parent.tolist() == [0, 1]
    assert side.tolist() == [0, 1]
    assert [volume(parts, i) for i in (0, 1)] == pytest.approx([0.25, 0.75])
    assert 7 in parts.facets[: parts.facet_starts[1]]
    assert 8 in parts.facets[parts.facet_starts[1] :]


@pytest.mark.parametrize("n", [2, 3])
def test_taking_and_joining_keep_each_cell(n: int) -> None:
    rng = np.random.default_rng(n)
    cells = divide(boxes(n, 6), *random_planes(rng, n, 6), 50)
    rows = rng.permutation(len(cells))
    again = join_cells([cells.take(rows[:4]), cells.take(rows[4:]), cells.take(rows[:0])])
    assert len(again) == len(cells)
    for i, row in enumerate(rows.tolist()):
        assert np.array_equal(corners(again, i), corners(cells, row))
        assert volume(again, i) == volume(cells, row)
    low, high = again.bounds
    assert np.array_equal(low[0], corners(again, 0).min(axis=0))
    assert np.array_equal(high[-1], corners(again, len(again) - 1).max(axis=0))


def test_a_polygon_in_space_is_cut_like_one_in_the_plane() -> None:
    square = np.array([[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [1.0, 1.0, 2.0], [0.0, 1.0, 2.0]])
    face = Polygons.of(square, np.array([0, 4]), np.arange(4))
    half, _ = clip(
        face, np.array([[1.0, 0.0, 0.0]]), np.array([0.5]), np.array([9]), np.array([0, 1]), TOL
    )
    assert half.vertices[:, 0].max() == 0.5
    assert (half.vertices[:, 2] == 2.0).all()
    assert sorted(half.facets.tolist()) == [0, 2, 3, 9]
