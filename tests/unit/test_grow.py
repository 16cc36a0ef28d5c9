from __future__ import annotations

import numpy as np
import pytest

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.free_space.grow import grow_leaves
from hzmp_planners.sets import Polytope
from oracles import halfspace_volume, overlap, random_world


@pytest.mark.parametrize(
    ("kind", "n", "size"),
    [
        ("grid", 2, 1.0), ("rotated", 2, 1e3), ("slivers", 2, 1.0), ("hulls", 2, 1e-2),
        ("grid", 3, 1.0), ("rotated", 3, 1.0), ("hulls", 3, 1e2),
    ],
)  # fmt: skip
def test_grown_leaves_contain_their_leaf_and_no_obstacle(kind: str, n: int, size: float) -> None:
    rng = np.random.default_rng(n)
    world = random_world(rng, kind, n, 5, size)
    space = world.free_space()
    tol = 1e-8 * world.scale
    larger = 0
    for leaf in range(len(space.leaves)):
        faces = [space.graph.faces[f].leaves for f in space.graph.faces_of[leaf]]
        toward = [j if i == leaf else i for i, j in faces]
        (grown,) = grow_leaves(space, [leaf], [toward[:2]])
        assert grown.violation(space.leaves[leaf].vertices()).max() <= tol
        assert (grown.vertices() >= world.lo - tol).all()
        assert (grown.vertices() <= world.hi + tol).all()
        assert max(overlap(grown, block) for block in space.obstacles) <= tol
        assert grown.violation(grown.vertices()).max() <= tol
        assert halfspace_volume(grown.A, grown.b) == pytest.approx(grown.volume(), rel=1e-6)
        larger += grown.volume() > 1.01 * space.leaves[leaf].volume()
    assert larger > 0


def test_growth_goes_first_where_it_is_asked_to() -> None:
    # A notch: the lower slab is one leaf, the two columns beside the block are the others.
    space = FreeSpace.decompose(([0, 0], [3, 2]), [Polytope.from_box([1, 1], [2, 2])])
    assert len(space.leaves) == 3
    for leaf, body in enumerate(space.leaves):
        (alone,) = grow_leaves(space, [leaf], [[]])
        assert alone.volume() >= body.volume()
        for face in space.graph.faces_of[leaf].tolist():
            pair = space.graph.faces[face]
            other = pair.leaves[0] if pair.leaves[1] == leaf else pair.leaves[1]
            grown, back = grow_leaves(space, [leaf, other], [[other], [leaf]])
            # It now reaches into the neighbour: room to turn from one into the other.
            if overlap(body, space.leaves[other]) <= 1e-9:
                assert overlap(grown, back) > 0.1


def test_an_empty_workspace_cannot_grow() -> None:
    space = FreeSpace.decompose(([0, 0, 0], [1, 2, 3]))
    (grown,) = grow_leaves(space, [0], [[]])
    assert grown.volume() == pytest.approx(6.0)
    assert len(grown.A) == 6
