"""Pictures of sets: what is drawn is the set."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from hzmp_planners.errors import ShapeError
from hzmp_planners.sets import (
    ConstrainedZonotope,
    Ellipsotope,
    HybridZonotope,
    Polytope,
    Set,
    Zonotope,
)
from oracles import Floats

mpl.use("Agg")

SQUARE = Polytope.from_box([0, 0], [2, 1])
CUBE = Polytope.from_box([0, 0, 0], [1, 2, 3])
UNION = HybridZonotope.from_polytopes([Polytope.from_box([i, 0], [i + 1, 1]) for i in range(3)])
FLAT: dict[str, Set] = {
    "polytope": SQUARE,
    "zonotope": Zonotope(np.eye(2), np.zeros(2)),
    "constrained": ConstrainedZonotope.from_vertices([[0, 0], [1, 0], [0, 1]]),
    "ellipsotope": Ellipsotope(np.diag([2.0, 1.0]), np.zeros(2)),
    "mixed": Ellipsotope(np.eye(2), np.zeros(2)) & SQUARE,
    "union": UNION,
    "segment": Polytope.from_vertices([[0, 0], [1, 1]]),
    "point": Polytope.from_vertices([[1, 1]]),
}


def outline(artist: Any) -> Floats:
    return np.asarray(artist.get_xy() if hasattr(artist, "get_xy") else artist.get_xydata())


@pytest.mark.parametrize("name", FLAT)
def test_outlines_in_the_plane_span_the_set(name: str) -> None:
    body = FLAT[name]
    ax = Figure().add_subplot()
    artists = body.plot(ax, label="a set")
    corners = np.concatenate([outline(artist) for artist in artists])
    assert body.contains(corners, 1e-7).all()
    lo, hi = body.interval_hull()
    np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [lo, hi], atol=2e-3)
    assert len(artists) == len(body.convex_parts())
    assert ax.get_legend_handles_labels()[1] == ["a set"]


def test_solids_are_drawn_by_their_facets() -> None:
    ax: Any = Figure().add_subplot(projection="3d")
    bodies: list[Set] = [
        CUBE,
        Ellipsotope(np.eye(3), np.zeros(3)),
        Polytope.from_vertices([[0, 0, 0], [1, 0, 0], [0, 1, 1]]),
    ]
    for body, facets in zip(bodies, (6, 100, 1), strict=True):
        (artist,) = body.plot(ax, alpha=0.2)
        drawn: Any = artist
        polygons = drawn._faces if hasattr(drawn, "_faces") else drawn._vec.T[None]
        assert len(polygons) >= facets
    segment = Polytope.from_vertices([[0, 0, 0], [1, 1, 1]])
    assert len(segment.plot(ax)) == 1
    ax.figure.canvas.draw()


def test_parts_take_turns_in_colour_unless_one_is_given() -> None:
    ax = Figure().add_subplot()
    colours = [artist.get_facecolor() for artist in UNION.plot(ax)]  # type: ignore[attr-defined]
    assert len(set(colours)) == 3
    colours = [
        artist.get_facecolor()  # type: ignore[attr-defined]
        for artist in UNION.plot(ax, color="black")
    ]
    assert len(set(colours)) == 1


def test_empty_sets_draw_nothing_and_other_dimensions_are_refused() -> None:
    ax = Figure().add_subplot()
    assert Polytope.empty(2).plot(ax) == []
    with pytest.raises(ShapeError, match="2 or 3 dimensions"):
        Zonotope(np.eye(4), np.zeros(4)).plot(ax)
