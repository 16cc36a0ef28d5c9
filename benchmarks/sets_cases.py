"""Unions of cells, what a library is asked about them, and the answers known beforehand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.spatial import Delaunay

Floats = NDArray[np.float64]
Box = tuple[Floats, Floats]

Answer = tuple[float, bool]
"""A number or a verdict, and whether the library stands by it; nan when there is none."""

POINTS = 1000

SUPPORT_TOL = 1e-2
"""Of a union's size: a support that is off by more is wrong. Ten times zonoopt's tolerance."""


@dataclass(frozen=True)
class CellUnion:
    """Cells of about unit size around a hole, with questions and their answers."""

    name: str
    cells: Floats
    """Vertices of each cell, shape (N, k, n)."""
    V: Floats
    """Distinct vertices, shape (nv, n)."""
    M: csc_array[np.float64]
    """Vertices of each cell, shape (nv, N)."""
    inside: Floats
    """Points of the union, shape (POINTS, n)."""
    outside: Floats
    """Points well away from it: one in the hole, one beyond all cells, ...; shape (POINTS, n)."""
    directions: Floats
    """Unit vectors, shape (k, n)."""
    supports: Floats
    """Largest d.x for each direction, shape (k,)."""
    box: Box
    """A unit box that meets some cells, none of them by touching only."""
    met: int
    """Number of cells that the box meets."""
    hole: Box
    """A box that meets no cell."""
    shift: Floats
    """The union moved by this overlaps the union, shape (n,)."""

    @property
    def n(self) -> int:
        """Dimension of the space."""
        return int(self.cells.shape[2])


def grid(n: int, count: int, rng: np.random.Generator) -> CellUnion:
    """The first cells of a grid of unit cubes, without one amid them."""
    side = int(np.ceil((count + 1) ** (1.0 / n) - 1e-9))
    corners = np.array(list(product((0.0, 1.0), repeat=n)))
    low = np.array(list(np.ndindex(*[side] * n))[: count + 1], dtype=np.float64)
    cells = low[:, None] + corners
    return _with_hole(f"grid {n}-D", cells, low + 0.5, np.full(count + 1, 0.5), rng)


def triangles(count: int, rng: np.random.Generator) -> CellUnion:
    """Triangles of a Delaunay triangulation of random points, without a large one amid them."""
    sites = rng.uniform(0.0, 1.0, (count // 2 + 20, 2)) * np.sqrt(count // 2 + 20)
    cells = sites[Delaunay(sites).simplices]
    outward = np.linalg.norm(cells.mean(axis=1) - sites.mean(axis=0), axis=1)
    cells = cells[np.argsort(outward)[: count + 1]]
    sides = np.linalg.norm(cells[:, [1, 2, 0]] - cells[:, [2, 0, 1]], axis=2)
    rim = sides.sum(axis=1)
    centres = np.einsum("ij,ijk->ik", sides, cells) / rim[:, None]
    radii = 2.0 * _areas(cells) / rim
    return _with_hole("triangles", cells, centres, radii, rng)


Case = Callable[[int, np.random.Generator], CellUnion]
"""Makes a union of so many cells."""

CASES: tuple[Case, ...] = (partial(grid, 2), partial(grid, 3), triangles)


class Library(Protocol):
    """What a library must be able to do; a body is whatever its `build` returns."""

    points: int
    """How many points inside it is asked about, and as many outside."""
    block: int
    """Points that one call of `contains` takes."""

    def build(self, union: CellUnion) -> Any: ...
    def generators(self, body: Any) -> Answer: ...
    def leaf_count(self, body: Any) -> Answer: ...
    def is_empty(self, body: Any) -> Answer: ...
    def contains(self, body: Any, X: Floats) -> Sequence[Answer]: ...
    def support(self, body: Any, d: Floats) -> Answer: ...
    def in_box(self, body: Any, box: Box) -> Any: ...
    def in_moved(self, body: Any, v: Floats) -> Any: ...


@dataclass(frozen=True)
class Call:
    """One call that is timed, on a body that `build` has just made."""

    ask: Callable[[Any], Sequence[Answer]]
    known: Sequence[float]
    """The right answers."""
    tol: float = 0.5


def questions(lib: Library, u: CellUnion) -> dict[str, list[Call]]:
    """The calls of each operation."""

    def one(ask: Callable[[Any], Answer], known: float, tol: float = 0.5) -> Call:
        return Call(lambda body: [ask(body)], [known], tol)

    def holds(X: Floats, known: bool) -> list[Call]:
        blocks = [X[start : start + lib.block] for start in range(0, lib.points, lib.block)]
        return [Call(partial(_contains, lib, block), [known] * len(block)) for block in blocks]

    tol = SUPPORT_TOL * float(np.ptp(u.V, axis=0).max())
    ways = zip(u.directions, u.supports.tolist(), strict=True)
    return {
        "build": [one(lambda _: lib.generators(lib.build(u)), 2 * len(u.V))],
        "leaves": [one(lib.leaf_count, len(u.cells))],
        "empty?": [one(lib.is_empty, False)],
        "support": [one(partial(_support, lib, d), h, tol) for d, h in ways],
        "point inside?": holds(u.inside, True),
        "point outside?": holds(u.outside, False),
        "∩ box: empty?": [one(lambda body: lib.is_empty(lib.in_box(body, u.box)), False)],
        "∩ box: leaves": [one(lambda body: lib.leaf_count(lib.in_box(body, u.box)), u.met)],
        "∩ box in hole: empty?": [one(lambda body: lib.is_empty(lib.in_box(body, u.hole)), True)],
        "∩ moved copy: empty?": [
            one(lambda body: lib.is_empty(lib.in_moved(body, u.shift)), False)
        ],
    }


def _contains(lib: Library, X: Floats, body: Any) -> Sequence[Answer]:
    return lib.contains(body, X)


def _support(lib: Library, d: Floats, body: Any) -> Answer:
    return lib.support(body, d)


def _with_hole(
    name: str,
    cells: Floats,
    centres: Floats,
    radii: Floats,
    rng: np.random.Generator,
) -> CellUnion:
    """Takes out the roomiest of the inner cells; centres and radii are of inscribed balls."""
    outward = np.linalg.norm(centres - centres.mean(axis=0), axis=1)
    inner = np.argsort(outward, kind="stable")[: max(len(cells) // 3, 1)]
    gap = int(inner[np.argmax(radii[inner])])
    kept = np.arange(len(cells)) != gap
    middle, radius = centres[gap], radii[gap]
    cells, centres, n = cells[kept], centres[kept], cells.shape[2]
    V, rows = np.unique(cells.reshape(-1, n), axis=0, return_inverse=True)
    columns = np.repeat(np.arange(len(cells)), cells.shape[1])
    M = csc_array((np.ones(len(rows)), (rows.ravel(), columns)), shape=(len(V), len(cells)))

    weights = rng.dirichlet(np.ones(cells.shape[1]), POINTS)
    inside = np.einsum("ij,ijk->ik", weights, cells[rng.integers(len(cells), size=POINTS)])
    # A cube of half the inscribed ball's radius leaves room between itself and the cells.
    outside = middle + rng.uniform(-0.5, 0.5, (POINTS, n)) * radius
    lo, hi = V.min(axis=0), V.max(axis=0)
    beyond = rng.uniform(lo, hi, (POINTS, n))
    axes = rng.integers(n, size=POINTS)
    beyond[np.arange(POINTS), axes] = hi[axes] + rng.uniform(0.1, 1.0, POINTS)
    outside[1::2] = beyond[1::2]
    directions = np.vstack([np.eye(n), rng.standard_normal((2, n))])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    box = centres[len(cells) // 2], centres[len(cells) // 2] + 1.0
    return CellUnion(
        name,
        cells,
        V,
        M,
        inside,
        outside,
        directions,
        (V @ directions.T).max(axis=0),
        box,
        int(_meets(cells, box).sum()),
        (middle - radius / 2.0, middle + radius / 2.0),
        cells[0].mean(axis=0) - cells[0, 0],
    )


def _meets(cells: Floats, box: Box) -> NDArray[np.bool_]:
    """Which cells (boxes, or triangles) overlap a box: no axis separates them; shape (N,)."""
    N, _, n = cells.shape
    axes = np.broadcast_to(np.eye(n), (N, n, n))
    if cells.shape[1] == 3:
        edges = cells - np.roll(cells, 1, axis=1)
        axes = np.concatenate([axes, np.stack([-edges[:, :, 1], edges[:, :, 0]], axis=2)], axis=1)
    corners = np.array(list(product(*zip(*box, strict=True))))
    reach = np.einsum("iaj,icj->iac", axes, cells)
    other = np.einsum("iaj,cj->iac", axes, corners)
    apart = (reach.max(axis=2) < other.min(axis=2)) | (reach.min(axis=2) > other.max(axis=2))
    return np.asarray(~apart.any(axis=1))


def _areas(cells: Floats) -> Floats:
    edges = cells[:, 1:] - cells[:, :1]
    return np.asarray(np.abs(np.linalg.det(edges)) / 2.0)
