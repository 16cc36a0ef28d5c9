"""Whether convex pieces cover a surface, and growing them until they do.

CoACD's pieces are hulls of what it cut, by planes and through points that it rounds: by themselves
they leave slivers of the surface uncovered (measured: up to 8e-4 of the mesh's size).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.sets import Polytope
from hzmp_sim.scene.shapes import Hull

if TYPE_CHECKING:
    import trimesh

SURFACE_SAMPLES = 20_000
"""Points of the surface that are looked at, besides its vertices and middles of faces."""

WRITING_SHARE = 1e-5
"""Share of the largest coordinate by which pieces must reach beyond the surface: MJCF text has six
digits, and the world that is flown is the one that is written."""

FLAT_SHARE = 1e-9
"""Pieces of less than this share of the hull's volume are slivers: MuJoCo refuses flat meshes."""


@dataclass(frozen=True, eq=False)
class Cover:
    """Convex pieces that hold every point of a surface that was looked at."""

    pieces: tuple[Floats, ...]
    """Corners of each, shape (k, 3) [m]."""
    leak: float
    """How far the surface stood out of the pieces before they were grown: the farthest point's
    distance beyond the facets of the piece nearest to it [m]; 0 when they covered it."""
    growth: float
    """By how much each facet was moved outwards [m]."""
    volume: float
    """Sum of the pieces' volumes: at least that of their union [m^3]."""


def cover_surface(surface: trimesh.Trimesh, pieces: list[Floats], hull_volume: float) -> Cover:
    """Grow pieces until they cover a surface.

    Facets move outwards, so that a piece keeps their number: the planner pays for every one.

    Args:
        surface: closed or open.
        pieces: corners of each, (k, 3) [m].
        hull_volume: of the surface's convex hull [m^3].
    """
    hulls = [Hull.from_points(points) for points in pieces]
    volumes = [_volume(hull) for hull in hulls]
    solid = [hull for hull, v in zip(hulls, volumes, strict=True) if v > FLAT_SHARE * hull_volume]
    points = surface_points(surface)
    leak = max(0.0, float(outside(points, solid).max()))
    growth = leak + WRITING_SHARE * float(np.abs(points).max())
    grown = [
        Polytope.from_halfspaces(hull.equations[:, :3], growth - hull.equations[:, 3]).vertices()
        for hull in solid
    ]
    volume = sum(_volume(Hull.from_points(corners)) for corners in grown)
    return Cover(tuple(grown), leak, growth, volume)


def surface_points(surface: trimesh.Trimesh) -> Floats:
    """Vertices, middles of faces, and samples uniform by area, shape (k, 3) [m]."""
    from trimesh.sample import sample_surface

    samples = sample_surface(surface, SURFACE_SAMPLES, seed=0)[0]
    return np.vstack([surface.vertices, surface.triangles_center, samples])


def outside(points: Floats, hulls: list[Hull]) -> Floats:
    """How far each of (k, 3) points is beyond the facets of the piece nearest to it, (k,) [m].

    At most 0 for points that a piece holds.
    """
    nearest = np.full(len(points), np.inf)
    for hull in hulls:
        normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
        for part in np.array_split(np.arange(len(points)), 1 + len(points) // 50_000):
            beyond = (points[part] @ normals.T + offsets).max(axis=1)
            nearest[part] = np.minimum(nearest[part], beyond)
    return nearest


def _volume(hull: Hull) -> float:
    """By tetrahedra from the centre, which the hull holds."""
    corners = hull.points[hull.facets] - hull.centre
    return float(np.abs(np.linalg.det(corners)).sum() / 6.0)
