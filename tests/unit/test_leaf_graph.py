from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from hzmp_planners.free_space import FreeSpace, SharedFace
from hzmp_planners.sets import ConstrainedZonotope, Polytope
from oracles import Floats, contact_dimension, minimum, random_world

TOL = 1e-9


def slack(one: Polytope, two: Polytope) -> float:
    """The paper's adjacency criterion on compact constrained zonotopes: t* in factor space.

    max t with |xi_1| <= 1 - t, |xi_2| <= 1 - t, both equalities, c1 + G1 xi_1 = c2 + G2 xi_2:
    positive for overlapping interiors, 0 for contact, negative for sets that are apart.
    """
    Z, W = (ConstrainedZonotope.from_vertices(p.vertices()) for p in (one, two))
    k = Z.ng + W.ng
    equal = np.zeros((Z.n + 2, k + 1))
    equal[: Z.n, : Z.ng], equal[: Z.n, Z.ng : k] = Z.G, -W.G
    equal[Z.n, : Z.ng], equal[Z.n + 1, Z.ng : k] = Z.A, W.A
    bound = np.hstack([np.vstack([np.eye(k), -np.eye(k)]), np.ones((2 * k, 1))])
    found = minimum(
        np.append(np.zeros(k), -1.0),
        bound,
        np.ones(2 * k),
        (equal, np.concatenate([W.c - Z.c, Z.b, W.b])),
    )
    return -np.inf if found is None else -found[0]


def by_leaves(space: FreeSpace) -> dict[tuple[int, int], SharedFace]:
    faces = {tuple(sorted(face.leaves)): face for face in space.graph.faces}
    assert len(faces) == len(space.graph.faces)  # two convex leaves share one face at the most
    return {(i, j): face for (i, j), face in faces.items()}


def measure(points: Floats) -> float:
    """Length of a segment, or area of a polygon in space from the hull of its own coordinates."""
    if points.shape[1] == 2:
        return float(np.linalg.norm(points[1] - points[0]))
    flat = (points - points[0]) @ np.linalg.svd(points - points[0])[2][:2].T
    return float(ConvexHull(flat).volume)


WORLDS = [
    (kind, n, seed)
    for kind, n, seed in [
        ("grid", 2, 0), ("grid", 2, 1), ("grid", 2, 2), ("rotated", 2, 3), ("hulls", 2, 4),
        ("slivers", 2, 5), ("grid", 3, 6), ("grid", 3, 7), ("rotated", 3, 8), ("hulls", 3, 9),
    ]
]  # fmt: skip


@pytest.mark.parametrize(("kind", "n", "seed"), WORLDS)
def test_shared_faces_are_all_contacts_of_full_dimension(kind: str, n: int, seed: int) -> None:
    """Every pair of leaves against linear programs: contact, its dimension, and its extent."""
    rng = np.random.default_rng(seed)
    space = random_world(rng, kind, n, 5 if n == 2 else 2).free_space()
    faces = by_leaves(space)
    hulls = [leaf.interval_hull() for leaf in space.leaves]
    lesser = 0
    for i, j in combinations(range(len(space.leaves)), 2):
        if (hulls[i][0] > hulls[j][1] + TOL).any() or (hulls[j][0] > hulls[i][1] + TOL).any():
            assert (i, j) not in faces
            continue
        one, two = space.leaves[i], space.leaves[j]
        dimension = contact_dimension(one, two, TOL)
        assert dimension < n
        assert ((i, j) in faces) == (dimension == n - 1), (i, j, dimension)
        lesser += 0 <= dimension < n - 1
        # t* is in factor space, where a wide gap may look small: compare verdicts.
        t = slack(one, two)
        assert t <= 1e-7
        assert (t >= -1e-7) == (dimension >= 0), (i, j, t)
    if (kind, n) == ("hulls", 3):
        assert lesser > 0  # contacts in a corner or along an edge did occur


@pytest.mark.parametrize(("kind", "n", "seed"), WORLDS)
def test_a_face_is_the_whole_intersection_of_its_leaves(kind: str, n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    space = random_world(rng, kind, n, 5 if n == 2 else 3).free_space()
    assert space.graph.faces
    for face in space.graph.faces:
        one, two = (space.leaves[leaf] for leaf in face.leaves)
        np.testing.assert_allclose(np.linalg.norm(face.normal), 1.0, atol=1e-12)
        np.testing.assert_allclose(face.vertices @ face.normal, face.offset, atol=TOL)
        assert (one.vertices() @ face.normal).max() <= face.offset + TOL
        assert (two.vertices() @ face.normal).min() >= face.offset - TOL
        for leaf in (one, two):
            assert leaf.violation(face.vertices).max() <= TOL
        # No common point is beyond the face in any direction.
        A, b = np.vstack([one.A, two.A]), np.concatenate([one.b, two.b]) + TOL
        for d in rng.standard_normal((3, n)):
            d -= (d @ face.normal) * face.normal
            farthest = minimum(-d, A, b)
            assert farthest is not None
            assert (face.vertices @ d).max() == pytest.approx(-farthest[0], abs=1e-6)
        if n == 3:
            # The corners are in order around the polygon: the fan has the area of the hull.
            spokes = face.vertices[1:] - face.vertices[0]
            fan = np.linalg.norm(np.cross(spokes[:-1], spokes[1:]).sum(axis=0)) / 2.0
            assert fan == pytest.approx(measure(face.vertices), rel=1e-9)


def test_partial_faces_corners_and_edges() -> None:
    # Two walls that leave a slit of 0.2 on the left and a corner contact in the middle.
    blocks = [Polytope.from_box([0.2, 0.4], [0.5, 0.5]), Polytope.from_box([0.5, 0.5], [1.0, 0.6])]
    space = FreeSpace.decompose(([0, 0], [1, 1]), blocks)
    touching = space.leaves_at([0.5, 0.5])
    assert len(touching) >= 2
    # The corner where the blocks touch is a contact of the free space, but no door in it.
    for face in space.graph.faces:
        inner = face.vertices.mean(axis=0)
        assert space.contains(inner).all()
        assert not np.allclose(face.vertices, [0.5, 0.5])
    assert len(set(space.graph.components)) == 1


def test_parts_are_those_of_a_flood_fill() -> None:
    rng = np.random.default_rng(11)
    several = 0
    for trial in range(20):
        n = 2 + trial % 2
        world = random_world(rng, "grid", n, 14 if n == 2 else 20)
        space = world.free_space()
        cells = 6
        centres = (np.stack(np.meshgrid(*[np.arange(cells)] * n, indexing="ij"), -1) + 0.5) / cells
        free = space.contains(centres.reshape(-1, n)).reshape(centres.shape[:-1])
        label = np.full(free.shape, -1)
        count = 0
        for seed in map(tuple, np.argwhere(free).tolist()):
            if label[seed] >= 0:
                continue
            stack = [seed]
            label[seed] = count
            while stack:
                cell = stack.pop()
                for axis in range(n):
                    for step in (-1, 1):
                        near = list(cell)
                        near[axis] += step
                        if 0 <= near[axis] < cells and free[tuple(near)] and label[tuple(near)] < 0:
                            label[tuple(near)] = count
                            stack.append(tuple(near))
            count += 1
        parts = space.graph.components
        assert len(set(parts.tolist())) == count
        several += count > 1
        pairs = {
            (int(label[tuple(c)]), int(parts[leaf]))
            for c in np.argwhere(free)
            for leaf in space.leaves_at(centres[tuple(c)])
        }
        assert len(pairs) == count
    assert several > 3


def test_views_of_the_graph_agree_with_its_faces() -> None:
    graph = random_world(np.random.default_rng(1), "rotated", 3, 4).free_space().graph
    assert graph.ends.tolist() == [list(face.leaves) for face in graph.faces]
    for index, face in enumerate(graph.faces):
        k = len(face.vertices)
        assert np.array_equal(graph.corners[index, :k], face.vertices)
        assert (graph.corners[index, k:] == face.vertices[-1]).all()
        for leaf in face.leaves:
            assert index in graph.faces_of[leaf]
    assert sum(len(faces) for faces in graph.faces_of) == 2 * len(graph.faces)
    listed = {tuple(row) for row in graph.pairs.tolist()}
    expected = {
        (int(i), int(j), leaf)
        for leaf, faces in enumerate(graph.faces_of)
        for i, j in combinations(sorted(faces), 2)
    }
    assert listed == expected
