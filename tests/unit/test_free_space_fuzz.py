"""Free spaces of 2,000 random worlds, and of those that were wrong once."""

from __future__ import annotations

from collections.abc import Sequence
from math import fsum

import numpy as np
import pytest

from free_space_checks import check_space
from fuzz_worlds import KINDS, fuzz_world
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from oracles import Floats, rotation, union_volume

WORLDS, BATCH = 2000, 100


def check_seed(seed: int) -> None:
    try:
        check_space(fuzz_world(seed).free_space(), np.random.default_rng(seed))
    except Exception as failure:
        kind, n = list(KINDS)[seed % len(KINDS)], 2 + seed // len(KINDS) % 2
        raise AssertionError(f"seed {seed} ({kind}, {n}-D): {failure}") from failure


@pytest.mark.parametrize("first", range(0, WORLDS, BATCH))
def test_random_worlds(first: int) -> None:
    for seed in range(first, first + BATCH):
        check_seed(seed)


def test_leaves_and_obstacles_fill_the_box() -> None:
    """Volumes by inclusion and exclusion, where there are few obstacles."""
    compared = 0
    for seed in range(0, WORLDS, 6):
        world = fuzz_world(seed)
        if not 1 <= len(world.obstacles) <= 2:
            continue
        space = world.free_space()
        whole = float(np.prod(world.hi - world.lo))
        # What planes within 1e-9 of each other may enclose, and the oracle's own 1e-8.
        room = 2e-8 * space.scale * float((whole / (world.hi - world.lo)).sum())
        volume = fsum(leaf.volume() for leaf in space.leaves)
        assert volume + union_volume(world) == pytest.approx(whole, rel=1e-9, abs=room), seed
        compared += 1
    assert compared > 40


def twin_boxes(seed: int, low: Sequence[float], high: Sequence[float]) -> FreeSpace:
    """A turned box in the unit cube, and a copy whose corners are off by 1e-9 to 1e-8."""
    n, rng = len(low), np.random.default_rng(seed)
    unit = np.array(np.meshgrid(*[[0.0, 1.0]] * n)).reshape(n, -1).T
    body = (np.array(low) + np.subtract(high, low) * unit) @ rotation(rng, n).T + 0.5
    loose = float(rng.choice([1e-9, 2e-9, 3e-9, 5e-9, 1e-8]))
    twin = body + loose * rng.uniform(-1.0, 1.0, body.shape)
    return FreeSpace.decompose(
        (np.zeros(n), np.ones(n)), [Polytope.from_vertices(each) for each in (body, twin)]
    )


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_doors_on_diagonals(sign: float) -> None:
    """Both axes of the plane are the longest of such a segment: faces on them were lost."""
    diamond = [[sign, 0.0], [0.0, sign], [-sign, 0.0], [0.0, -sign]]
    space = FreeSpace.decompose(([-2, -2], [2, 2]), [Polytope.from_vertices(diamond)])
    assert len(space) == len(space.graph) == 4
    assert len(set(space.graph.components.tolist())) == 1


@pytest.mark.parametrize("seed", [27, 28, 108, 141, 167, 179, 219])
def test_two_nearly_equal_facets_of_a_polygon_are_one(seed: int) -> None:
    """Its side held four vertices: faces outside their leaves, and updates that failed."""
    space = twin_boxes(seed, [-0.3, -0.2], [0.3, 0.2])
    check_space(space, np.random.default_rng(seed))
    smaller = space.with_obstacles([Polytope.from_box([0.01, 0.01], [0.99, 0.99])])
    check_space(smaller, np.random.default_rng(seed))
    assert smaller.volume == pytest.approx(1.0 - 0.98**2, abs=1e-7)


FAR_FROM_LEAVES: list[tuple[int, Floats]] = [
    (0, np.array([0.7525508569318542, 0.560986173814164, -0.04279668648650941])),
    (4, np.array([-0.06932869611081864, 0.3520746632268622, 0.40125335343097723])),
]


@pytest.mark.parametrize(("seed", "x"), FAR_FROM_LEAVES)
def test_half_spaces_of_a_splinter_end_where_it_does(seed: int, x: Floats) -> None:
    """Splinters between nearly equal facets lost a wall: points centimetres away were inside."""
    space = twin_boxes(seed, [-0.3, -0.2, -0.25], [0.3, 0.9, 0.25])
    assert not space.contains(x).any()


ONCE_WRONG = {
    "a door on a diagonal was lost": [11, 16, 84, 118, 152, 254, 288],
    "a face lay outside its leaves": [43],
    "a point beyond the wall was in a splinter": [1351],
    "a body barely thicker than a flat one had no vertices": [1526],
}


@pytest.mark.parametrize("what", ONCE_WRONG)
def test_worlds_that_were_wrong_once(what: str) -> None:
    for seed in ONCE_WRONG[what]:
        check_seed(seed)
