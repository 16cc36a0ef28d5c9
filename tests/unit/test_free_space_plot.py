"""Pictures of free spaces: the leaves are drawn, and what is in front hides what is behind."""

from __future__ import annotations

import itertools
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from hzmp_planners._polygons import facet_corners
from hzmp_planners._solids import Solids
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.free_space.plot import (
    greedy_colouring,
    leaf_colours,
    plot_leaves,
    shrunk,
    within,
)
from hzmp_planners.sets import Polytope
from oracles import Floats

PLANE = FreeSpace.decompose(
    ((0, 0), (8, 6)),
    [
        Polytope.from_vertices([(2, 2), (4, 1), (5, 3), (3, 4)]),
        Polytope.from_box((6, -1), (7, 4)),
        Polytope.from_vertices([(1, 5), (2, 4.5), (2.5, 5.5)]),
    ],
)


def room() -> FreeSpace:
    rng = np.random.default_rng(1)
    boxes = []
    for _ in range(5):
        corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
        corners = corners * rng.uniform(0.3, 0.9, 3) @ Rotation.random(random_state=rng).as_matrix()
        boxes.append(Polytope.from_vertices(corners + rng.uniform(0.5, 3.5, 3)))
    return FreeSpace.decompose(((0, 0, 0), (4, 4, 4)), boxes)


ROOM = room()


def axes(space: FreeSpace) -> Any:
    figure = Figure(figsize=(4, 3))
    FigureCanvasAgg(figure)
    return figure.add_subplot(projection="3d" if space.n == 3 else None)


def picture(ax: Any) -> Floats:
    ax.figure.canvas.draw()
    return np.asarray(ax.figure.canvas.buffer_rgba(), dtype=np.float64)[..., :3]


def colours_in(image: Floats) -> set[tuple[int, ...]]:
    return {tuple(row) for row in image.astype(int).reshape(-1, 3).tolist()}


def bounding_facets(bodies: list[Polytope]) -> int:
    return sum(int((body.incidence.sum(axis=0) >= 3).sum()) for body in bodies)


def test_in_the_plane_there_is_a_polygon_for_each_leaf_and_obstacle() -> None:
    ax = plot_leaves(PLANE, axes(PLANE), faces=True, labels=True)
    leaves, obstacles = (item for item in ax.collections if isinstance(item, PolyCollection))
    drawn = [np.asarray(path.vertices)[:-1] for path in leaves.get_paths()]
    assert len(drawn) == len(PLANE)
    for ring, leaf in zip(drawn, PLANE.leaves, strict=True):
        np.testing.assert_array_equal(np.unique(ring, axis=0), np.unique(leaf.vertices(), axis=0))
    assert len(obstacles.get_paths()) == 3
    cut = np.vstack([np.asarray(path.vertices) for path in obstacles.get_paths()])
    assert cut[:, 1].min() == pytest.approx(0.0)  # at the wall of the workspace
    (lines,) = (item for item in ax.collections if isinstance(item, LineCollection))
    assert len(lines.get_segments()) == len(PLANE.graph)
    assert ax.get_legend_handles_labels()[1] == ["obstacles", "shared faces"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [m]", "y [m]")
    assert ax.get_aspect() == 1.0
    assert {int(text.get_text()) for text in ax.texts} <= set(range(len(PLANE)))
    assert len(ax.texts) > len(PLANE) // 2
    assert len(colours_in(picture(ax))) > 5


@pytest.mark.parametrize("explode", [0.0, 0.5])
def test_in_space_there_is_a_polygon_for_each_facet(explode: float) -> None:
    ax = plot_leaves(ROOM, axes(ROOM), explode=explode)
    (solids,) = (item for item in ax.collections if isinstance(item, Solids))
    blocks = [within(block, *ROOM.bounds) for block in ROOM.obstacles]
    bodies = [*ROOM.leaves, *blocks]
    assert len(solids.facets) == bounding_facets(bodies)
    # Both sides of facets that can be seen through, only those towards the eye of others.
    assert len(colours_in(picture(ax))) > 20
    shown = len(solids.get_paths())
    half = bounding_facets(bodies if explode else blocks) / 2.0
    hidden = len(solids.facets) - shown
    assert 0.5 * half < hidden < 1.5 * half
    assert ax.get_zlabel() == "z [m]"


def test_faces_and_labels_in_space() -> None:
    plain = plot_leaves(ROOM, axes(ROOM), explode=0.5)
    full = plot_leaves(ROOM, axes(ROOM), explode=0.5, faces=True, labels=True)
    few, many = (
        next(item for item in ax.collections if isinstance(item, Solids)) for ax in (plain, full)
    )
    assert len(many.facets) == len(few.facets) + 2 * len(ROOM.graph)
    assert len(full.texts) > 0


def test_overlapping_leaves_are_drawn_with_their_doors() -> None:
    cover = PLANE.overlapping()
    ax = plot_leaves(cover, axes(cover), faces=True)
    leaves = next(item for item in ax.collections if isinstance(item, PolyCollection))
    assert len(leaves.get_paths()) == len(cover)
    assert (np.array(leaves.get_facecolor())[:, 3] < 1.0).all()
    assert ax.get_legend_handles_labels()[1] == ["obstacles", "doors"]


@pytest.mark.parametrize("space", [PLANE, ROOM], ids=["2-D", "3-D"])
def test_exploded_leaves_are_apart_and_inside_themselves(space: FreeSpace) -> None:
    shapes = [shrunk(leaf.vertices(), 0.3) for leaf in space.leaves]
    for leaf, points in zip(space.leaves, shapes, strict=True):
        assert leaf.violation(points).max() < 0.0
        body = Polytope.from_vertices(points)
        assert body.volume() == pytest.approx(leaf.volume() / 1.3**space.n, rel=1e-6)
    for i, j in space.graph.ends.tolist():  # neighbours: a facet of one is between them
        gaps = [
            float((np.min(shapes[k] @ space.leaves[m].A.T, axis=0) - space.leaves[m].b).max())
            for k, m in ((i, j), (j, i))
        ]
        assert max(gaps) > 0.0


@pytest.mark.parametrize("space", [PLANE, ROOM], ids=["2-D", "3-D"])
def test_neighbours_have_different_colours(space: FreeSpace) -> None:
    colours = leaf_colours(space)
    assert len(colours) == len(space)
    assert all(colours[i] != colours[j] for i, j in space.graph.ends.tolist())
    assert len(set(colours)) <= (6 if space.n == 2 else 10)


def test_greedy_colouring_of_known_graphs() -> None:
    ring = np.array([(i, (i + 1) % 6) for i in range(6)])
    assert greedy_colouring(ring, 6).max() == 1
    everyone = np.array(list(itertools.combinations(range(5), 2)))
    assert sorted(greedy_colouring(everyone, 5)) == list(range(5))
    assert greedy_colouring(np.zeros((0, 2), dtype=np.int64), 3).tolist() == [0, 0, 0]


def test_facets_turn_counter_clockwise_seen_from_outside() -> None:
    for body in [Polytope.from_box((0, 0, 0), (1, 2, 3)), *ROOM.leaves]:
        vertices = body.vertices()
        volume = 0.0
        for row, corners in facet_corners(vertices, body.A, body.incidence):
            ring = vertices[corners]
            area = sum(
                np.cross(b - ring[0], c - ring[0]) / 2.0 for b, c in itertools.pairwise(ring[1:])
            )
            assert area @ body.A[row] == pytest.approx(np.linalg.norm(area))
            volume += float(area @ ring[0]) / 3.0
        assert volume == pytest.approx(body.volume(), rel=1e-6)


@pytest.mark.parametrize("projection", ["persp", "ortho"])
@pytest.mark.parametrize("azimuth", [-58, 40, 150])
def test_what_is_in_front_hides_what_is_behind(projection: str, azimuth: int) -> None:
    """The colour at the middle of each leaf facet that the eye sees is that of the nearest leaf."""
    ax = axes(ROOM)
    ax.figure.set_size_inches(8, 8)
    ax.set_proj_type(projection)
    plot_leaves(ROOM, ax, explode=0.4)
    ax.view_init(elev=24, azim=azimuth)
    image = picture(ax)
    matrix = ax.get_proj()
    eye = np.linalg.svd(matrix[[0, 1, 3]])[2][3]
    bodies = [Polytope.from_vertices(shrunk(leaf.vertices(), 0.4)) for leaf in ROOM.leaves]
    bodies += [within(block, *ROOM.bounds) for block in ROOM.obstacles]
    fills = [*leaf_colours(ROOM), *[(0.36, 0.38, 0.42)] * len(ROOM.obstacles)]
    wrong = checked = 0
    for body in bodies[::2]:
        target = body.vertices().mean(axis=0)
        ray = eye[:3] / eye[3] - target if abs(eye[3]) > 1e-9 else eye[:3]
        ray = ray if projection == "persp" else -ray * np.sign(matrix[2, :3] @ ray)
        nearest = max(range(len(bodies)), key=lambda k: exit_along(bodies[k], target, ray))
        spot = matrix @ np.append(target, 1.0)
        column, row = ax.transData.transform(spot[:2] / spot[3])
        seen = image[int(image.shape[0] - row), int(column)]
        hue = np.array(fills[nearest])
        checked += 1
        wrong += not np.allclose(seen / seen.max(), hue / hue.max(), atol=0.06)
    assert checked > 20
    assert wrong <= 0.1 * checked  # some middles lie under an edge


def exit_along(body: Polytope, point: Floats, ray: Floats) -> float:
    """Where the ray from a point leaves a body, -inf when it misses."""
    slope, room = body.A @ ray, body.b - body.A @ point
    with np.errstate(divide="ignore", invalid="ignore"):
        t = room / slope
    out = np.min(t[slope > 1e-12], initial=np.inf)
    enter = np.max(t[slope < -1e-12], initial=-np.inf)
    parallel = (np.abs(slope) <= 1e-12) & (room < 0.0)
    return float(out) if enter < out and out > 0.0 and not parallel.any() else -np.inf


def test_axes_are_made_or_must_fit() -> None:
    made = plot_leaves(PLANE)
    assert made.figure.number in plt.get_fignums()  # pyplot's, so that a notebook shows it
    plt.close(made.figure)
    solid = plot_leaves(ROOM)
    assert solid.name == "3d"
    plt.close(solid.figure)
    with pytest.raises(ShapeError, match="3-D cannot be drawn on 2-D"):
        plot_leaves(ROOM, axes(PLANE))
    with pytest.raises(ShapeError, match="2-D cannot be drawn on 3-D"):
        plot_leaves(PLANE, axes(ROOM))
    for bad in (-0.1, np.nan, np.inf):
        with pytest.raises(QueryError, match="explode"):
            plot_leaves(PLANE, axes(PLANE), explode=bad)


@pytest.mark.parametrize("n", [2, 3])
def test_spaces_without_obstacles_or_without_leaves(n: int) -> None:
    lo, hi = np.zeros(n), np.ones(n)
    for blocks in ([], [Polytope.from_box(lo - 1, hi + 1)]):
        space = FreeSpace.decompose((lo, hi), blocks)
        ax = plot_leaves(space, axes(space), explode=0.2, faces=True, labels=True)
        picture(ax)
