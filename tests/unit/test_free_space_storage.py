from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hzmp_planners.errors import ShapeError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import plan
from hzmp_planners.sets import Polytope
from oracles import load_scene, random_world


@pytest.mark.parametrize("kind", ["grid", "hulls"])
@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("overlapping", [False, True])
def test_a_loaded_space_is_the_saved_one(
    kind: str, n: int, overlapping: bool, tmp_path: Path
) -> None:
    rng = np.random.default_rng(n)
    world = random_world(rng, kind, n, 6, 3.0)
    space = world.free_space().with_obstacles({0: world.obstacles[1]})
    space = space.overlapping() if overlapping else space
    space.save(tmp_path / "space.npz")
    again = FreeSpace.load(tmp_path / "space.npz")
    assert again.disjoint is space.disjoint
    assert again.scale == space.scale
    assert np.array_equal(again.vertices, space.vertices)
    assert np.array_equal(again.incidence.toarray(), space.incidence.toarray())
    assert np.array_equal(again.bounds, space.bounds)
    for one, two in zip(
        again.obstacles + again.leaves, space.obstacles + space.leaves, strict=True
    ):
        assert np.array_equal(one.A, two.A)
        assert np.array_equal(one.b, two.b)
        assert np.array_equal(one.vertices(), two.vertices())
    for name in ("ends", "corners", "sizes", "normals", "offsets", "pairs", "components"):
        assert np.array_equal(getattr(again.graph, name), getattr(space.graph, name))
    points = 3.0 * rng.random((200, n))
    assert np.array_equal(again.leaf_of(points), space.leaf_of(points))
    moved = {1: world.obstacles[2]}
    assert np.array_equal(
        again.with_obstacles(moved).vertices, space.with_obstacles(moved).vertices
    )
    assert not again.vertices.flags.writeable


def test_plans_in_a_loaded_space_are_the_same(tmp_path: Path) -> None:
    scene = load_scene("random_2d_s000")
    space = scene.free_space()
    space.save(str(tmp_path / "space.npz"))
    again = FreeSpace.load(str(tmp_path / "space.npz"))
    one, two = (plan(s, scene.start, scene.goal, time_limit=20.0) for s in (space, again))
    assert np.array_equal(one.waypoints, two.waypoints)


def test_empty_spaces_survive(tmp_path: Path) -> None:
    box = Polytope.from_box([0, 0, 0], [1, 1, 1])
    for obstacles in ([], [box]):
        space = FreeSpace.decompose(([0, 0, 0], [1, 1, 1]), obstacles)
        space.save(tmp_path / "space.npz")
        again = FreeSpace.load(tmp_path / "space.npz")
        assert len(again) == len(space)
        assert again.contains([0.5, 0.5, 0.5])[0] == space.contains([0.5, 0.5, 0.5])[0]


def test_what_is_not_a_saved_space_is_refused_in_one_line(tmp_path: Path) -> None:
    text, other = tmp_path / "text.npz", tmp_path / "other.npz"
    text.write_text("nothing")
    np.savez(other, a=np.zeros(3))
    good, cut, odd = (tmp_path / f"{name}.npz" for name in ("good", "cut", "odd"))
    FreeSpace.decompose(([0, 0], [1, 1])).save(good)
    cut.write_bytes(good.read_bytes()[:-400])
    with np.load(good) as file:
        held = dict(file)
    del held["world.table"]
    np.savez(odd, **held)  # pyright: ignore[reportArgumentType]
    for path in (text, other, cut, odd):
        with pytest.raises(ShapeError, match="is not a saved free space") as caught:
            FreeSpace.load(path)
        assert "\n" not in str(caught.value)
    held["format"] = np.array("hzmp free space 999")
    np.savez(odd, **held)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ShapeError, match="has format"):
        FreeSpace.load(odd)
    with pytest.raises(FileNotFoundError):
        FreeSpace.load(tmp_path / "nowhere.npz")


def test_a_failed_save_leaves_nothing_behind(tmp_path: Path) -> None:
    space = FreeSpace.decompose(([0, 0], [1, 1]))
    with pytest.raises(OSError, match="nowhere"):
        space.save(tmp_path / "nowhere" / "space.npz")
    assert list(tmp_path.iterdir()) == []
