"""computeSharedFaces within the ellipsotope (line 18 of algorithm 1), and uniform samples on them.

The paper intersects sets in generator form and turns the ellipsotope into a constrained zonotope
around it (figure 4b). Here the same is done on corners: an ellipsoid meets the plane of a face in
an ellipse, and the face is clipped by tangents of that ellipse. On a segment the two tangents leave
exactly the intersection; on a polygon 12 of them leave at most 2.3 % of the ellipse's area more.
"""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._ragged import counts_of, spans, starts_of
from hzmp_planners.free_space import LeafGraph
from hzmp_planners.free_space.cells import clip
from hzmp_planners.free_space.polygons import Polygons
from hzmp_planners.planning.paper.reachable import ReachableSet
from hzmp_planners.planning.roadmap import sample_faces
from hzmp_planners.sets import Activity, Ellipsotope

_TANGENTS = 12  # of an ellipse
_FLAT = 1e-9  # half-axes shorter than this share of the longest count as this long
_THIN = 1e-12  # parts narrower than this [m at S = 1] are a point


def compute_shared_faces(
    graph: LeafGraph, faces: Ints, reachable: ReachableSet, nearest: Floats
) -> Floats:
    """Parts of some faces that the reachable set meets, shape (m, k, n) [m], padded by repetition.

    Args:
        graph: leaves and shared faces.
        faces: m faces that are not inactive.
        reachable: the ellipsotope, and how each face lies to it.
        nearest: point of each of the graph's faces at which f is least, shape (F, n) [m]: all
            that is left of a face which E only touches.
    """
    corners: Floats = graph.corners[faces].copy()
    cut = np.flatnonzero(reachable.faces[faces] == Activity.PARTIAL)
    if reachable.informed is None or not len(cut):
        return corners
    rows = faces[cut]
    directions, limits = _tangents(graph.normals[rows], graph.offsets[rows], reachable.informed)
    if graph.n == 2:
        corners[cut] = _clipped_segments(
            corners[cut], directions[:, 0], -limits[:, 1], limits[:, 0]
        )
        return corners
    parts = _clipped_polygons(graph, rows, directions, limits)
    width = max(graph.corners.shape[1], *(len(part) for part in parts.values()), 1)
    wide: Floats = corners.take(np.minimum(np.arange(width), corners.shape[1] - 1), axis=1)
    for k, row in enumerate(rows.tolist()):
        part = parts.get(k, nearest[row : row + 1])
        wide[cut[k]] = part[np.minimum(np.arange(width), len(part) - 1)]
    return wide


def generate_samples(corners: Floats, count: int, rng: np.random.Generator) -> Floats:
    """Line 13: points uniform on each face or part of a face, shape (m, count, n) [m]."""
    return sample_faces(corners, count, rng)


def _tangents(normals: Floats, offsets: Floats, informed: Ellipsotope) -> tuple[Floats, Floats]:
    """Half-spaces p.x <= q whose lines touch the ellipse in which E meets each plane a.x = b.

    With Q = G G', the ellipse has the centre m = c + Q a (b - a.c) / a'Qa, and its support function
    is p.m + rho (p'Qp - (p'Qa)^2 / a'Qa)^(1/2), rho^2 = 1 - (b - a.c)^2 / a'Qa, for p normal to a.

    Args:
        normals: unit normals a of the planes, shape (m, n).
        offsets: b, shape (m,) [m].
        informed: the ellipsoid E.

    Returns:
        Unit directions p in the planes, shape (m, t, n), and q (m, t) [m]; t is 2 in the plane.
    """
    n, axes = normals.shape[1], np.linalg.svd(informed.G)
    half = np.maximum(axes.S, _FLAT * axes.S[0])
    Q = (axes.U * half**2) @ axes.U.T
    if n == 2:
        along = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
        p = np.stack([along, -along], axis=1)
    else:
        first = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second = np.cross(normals, first)
        angle = np.arange(_TANGENTS) * (2.0 * np.pi / _TANGENTS)
        p = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
    Qa = normals @ Q
    size = np.einsum("mi,mi->m", normals, Qa)
    height = offsets - normals @ informed.c
    centre = informed.c + Qa * (height / size)[:, None]
    rho = np.sqrt(np.maximum(1.0 - height**2 / size, 0.0))
    spread = (
        np.einsum("mti,ij,mtj->mt", p, Q, p) - np.einsum("mti,mi->mt", p, Qa) ** 2 / size[:, None]
    )
    reach = rho[:, None] * np.sqrt(np.maximum(spread, 0.0))
    return p, np.einsum("mti,mi->mt", p, centre) + reach


def _clipped_segments(corners: Floats, along: Floats, low: Floats, high: Floats) -> Floats:
    """The part of each segment (m, k, 2) between two heights along its line."""
    height = np.einsum("mkn,mn->mk", corners, along)
    least, most = height.min(axis=1), height.max(axis=1)
    low, high = np.clip(low, least, most)[:, None], np.clip(high, least, most)[:, None]
    return np.asarray(corners + (np.clip(height, low, high) - height)[:, :, None] * along[:, None])


def _clipped_polygons(
    graph: LeafGraph, rows: Ints, directions: Floats, limits: Floats
) -> dict[int, Floats]:
    """Corners of what half-spaces leave of each polygon; those with nothing left are missing."""
    count, tangents = limits.shape
    sizes = graph.sizes[rows]
    ends = np.arange(graph.corners.shape[1]) < sizes[:, None]
    faces = Polygons.of(
        graph.corners[rows][ends], starts_of(sizes), np.zeros(int(sizes.sum()), dtype=np.int64)
    )
    lists = tangents * np.arange(count + 1)
    flat = directions.reshape(-1, 3), limits.ravel()
    tol = _THIN * float(np.abs(graph.corners).max())
    parts, origin = clip(faces, *flat, np.zeros(count * tangents, dtype=np.int64), lists, tol)
    starts, sizes = parts.vertex_starts, counts_of(parts.vertex_starts)
    return {
        int(face): parts.vertices[spans(starts[k : k + 1], sizes[k : k + 1])]
        for k, face in enumerate(origin)
    }
