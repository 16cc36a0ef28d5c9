"""The bundled worlds: they compile, are what they claim to be, and can be flown."""

import itertools

import mujoco
import numpy as np
import pytest

import hzmp_sim as hz
from hzmp_planners._arrays import Floats
from hzmp_sim.scene import Scene, load_scene
from hzmp_sim.worlds import body_path, models_dir, world_names, world_path

WORLDS = ("enclosure", "maze", "narrow_passage")
MOVING = {"crossing_traffic": 2, "pendulum_gallery": 3, "sliding_doors": 2, "warehouse": 3}
"""Worlds in which things move, and the dimension that the point is planned in."""


def compiled(name: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(str(world_path(name)))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def box(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> tuple[Floats, Floats]:
    """Corners of an upright box geom."""
    geom = model.geom(name).id
    half = np.abs(data.geom_xmat[geom].reshape(3, 3)) @ model.geom_size[geom]
    return data.geom_xpos[geom] - half, data.geom_xpos[geom] + half


def gap(model: mujoco.MjModel, data: mujoco.MjData, one: str, two: str) -> float:
    """MuJoCo's distance between two geoms [m]."""
    ids = model.geom(one).id, model.geom(two).id
    return mujoco.mj_geomDistance(model, data, *ids, 20.0, None)


def test_every_world_is_bundled_and_every_body_exists() -> None:
    assert world_names() == tuple(sorted([*WORLDS, "mesh_room", *MOVING]))
    assert models_dir().is_dir()
    for file in (body_path("quadrotor"), body_path("point"), body_path("point", planar=True)):
        assert mujoco.MjModel.from_xml_path(str(file)).nu >= 2


@pytest.mark.parametrize("name", [*WORLDS, "mesh_room", *MOVING])
def test_world_has_what_a_scene_needs(name: str) -> None:
    model, _ = compiled(name)
    assert model.opt.timestep == 0.002
    assert model.opt.jacobian == 0  # dense: MuJoCo 4.0.0 is wrong with sparse ones
    assert (model.vis.global_.offwidth, model.vis.global_.offheight) == (1280, 720)
    assert model.vis.quality.shadowsize == 1024
    for kind, item in (("site", "start"), ("site", "goal"), ("numeric", "workspace")):
        assert (
            mujoco.mj_name2id(model, int(getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")), item)
            >= 0
        )
    assert mujoco.mj_name2id(model, int(mujoco.mjtObj.mjOBJ_CAMERA), "overview") >= 0


@pytest.mark.parametrize(("name", "n"), [("enclosure", 2), ("maze", 2), ("narrow_passage", 3)])
@pytest.mark.parametrize("body", [None, "quadrotor"])
def test_start_and_goal_are_free_and_connected(name: str, n: int, body: str | None) -> None:
    scene = load_scene(name, body)
    assert scene.n == (3 if body else n)
    assert scene.warnings == ()
    space = scene.free_space()
    assert space.contains(np.vstack([scene.start, scene.goal])).all()
    labels = space.graph.components
    assert set(labels[space.leaves_at(scene.start)]) & set(labels[space.leaves_at(scene.goal)])
    assert not sees(scene)  # the straight way is blocked


def sees(scene: Scene) -> bool:
    line = np.linspace(scene.start, scene.goal, 400)
    return not any(obstacle.contains(line).any() for obstacle in scene.obstacles)


def test_enclosure_is_a_room_with_one_opening_of_80_cm() -> None:
    model, data = compiled("enclosure")
    walls = ("wall_right", "wall_back", "wall_front", "wall_left_front", "wall_left_back")
    for wall in walls:
        low, high = box(model, data, wall)
        assert min(high - low) == pytest.approx(0.3)  # thick
        assert (low[2], high[2]) == (0.0, 2.0)  # from floor to ceiling of the workspace
    assert gap(model, data, "wall_left_front", "wall_left_back") == pytest.approx(0.8)
    ring = ("wall_left_back", "wall_back", "wall_right", "wall_front", "wall_left_front")
    for one, two in itertools.pairwise(ring):  # closed but for the opening
        assert gap(model, data, one, two) <= 1e-9
    inside_low = np.array(
        [box(model, data, "wall_left_back")[1][0], box(model, data, "wall_front")[1][1]]
    )
    inside_high = np.array(
        [box(model, data, "wall_right")[0][0], box(model, data, "wall_back")[0][1]]
    )
    np.testing.assert_allclose(inside_high - inside_low, [6.0, 4.0])
    goal, start = (data.site_xpos[model.site(name).id, :2] for name in ("goal", "start"))
    assert (inside_low < goal).all()
    assert (goal < inside_high).all()
    assert start[0] > inside_high[0]  # outside, on the side away from the opening


def test_narrow_passage_spans_13_m_with_passages_of_1_m() -> None:
    model, data = compiled("narrow_passage")
    passages = []
    for wall in ("wall_a", "wall_b"):
        parts = {
            side: box(model, data, f"{wall}_{side}") for side in ("below", "above", "left", "right")
        }
        for low, high in parts.values():
            assert high[0] - low[0] == pytest.approx(0.3)
        low = np.min([part[0] for part in parts.values()], axis=0)
        high = np.max([part[1] for part in parts.values()], axis=0)
        np.testing.assert_allclose([low[1:], high[1:]], [[-3.0, 0.0], [3.0, 13.0]])
        passage = (
            np.array([parts["right"][1][1], parts["below"][1][2]]),
            np.array([parts["left"][0][1], parts["above"][0][2]]),
        )
        np.testing.assert_allclose(passage[1] - passage[0], [1.0, 1.0])
        area = sum(float(np.prod(high[1:] - low[1:])) for low, high in parts.values())
        assert area == pytest.approx(6.0 * 13.0 - 1.0)  # the one passage is all that is open
        passages.append(0.5 * (passage[0] + passage[1]))
    np.testing.assert_allclose(np.abs(passages[0] - passages[1]), [3.0, 3.0])


def test_maze_has_13_obstacles_and_passages_of_60_cm() -> None:
    model, data = compiled("maze")
    names = [model.body(i).name for i in range(1, model.nbody)]
    kinds = {
        kind: sum(name.startswith(kind) for name in names)
        for kind in ("bar", "circle", "u", "star")
    }
    assert kinds == {"bar": 5, "circle": 3, "u": 3, "star": 2}
    assert len(names) == 13
    passages = [
        ("bar_1", "bar_2"),
        ("bar_1", "bar_3"),
        ("bar_4", "bar_5"),
        ("u_1_back_arm", "bar_3"),
        ("u_2_back_arm", "circle_2"),
        ("circle_2", "bar_5"),
        ("u_3_left_arm", "bar_5"),
    ]
    for one, two in passages:
        assert gap(model, data, one, two) == pytest.approx(0.6, abs=1e-5)
    solids = [g for g in range(model.ngeom) if model.geom_contype[g] and model.geom_bodyid[g] > 0]
    for a, b in itertools.combinations(solids, 2):  # nothing is narrower
        if model.geom_bodyid[a] != model.geom_bodyid[b]:
            assert mujoco.mj_geomDistance(model, data, a, b, 20.0, None) > 0.6 - 1e-5
    for name in ("bar_1", "u_1_back", "u_2_back_arm", "u_3_left_arm"):
        low, high = box(model, data, name)
        assert min(high - low) == pytest.approx(0.3)
        assert (low[2], high[2]) == (0.0, 2.0)


@pytest.mark.parametrize("name", MOVING)
@pytest.mark.parametrize("body", ["point", "quadrotor"])
def test_worlds_that_move_have_a_script_and_a_way_past_what_stands(name: str, body: str) -> None:
    scene = load_scene(name, body)
    assert scene.n == (3 if body == "quadrotor" else MOVING[name])
    assert scene.warnings == ()
    assert scene.motion is not None
    space = scene.free_space()
    labels = space.graph.components
    assert set(labels[space.leaves_at(scene.start)]) & set(labels[space.leaves_at(scene.goal)])
    driven = {motion.name for motion in scene.motion.motions}
    bodies = {scene.model.body(scene.model.geom_bodyid[item.geom]).name for item in scene.moving}
    assert driven <= bodies
    assert bodies - driven == ({"pendulum_2", "pendulum_4"} if "pendulum" in name else set())


@pytest.mark.parametrize("name", MOVING)
def test_what_moves_comes_in_the_way_and_leaves_start_and_goal_alone(name: str) -> None:
    scene = load_scene(name, "quadrotor")
    sweep = hz.Predictor(scene).sweep
    sweep.intervals(np.array([0.0]), np.array([30.0]))
    corners = sweep.corners(0, 7500)
    low, high = corners.min(axis=2), corners.max(axis=2)
    radii = np.array([item.radius for item in scene.moving])[:, None]
    for point in (scene.start, scene.goal):
        apart = np.maximum(low - radii - point, point - high - radii).max(axis=2)
        assert apart.min() > scene.radius + scene.clearance
    # Its boxes meet the middle of the way now and then, and now and then they do not.
    across = np.linspace(scene.start, scene.goal, 50)[:, None, None]
    meets = ((low - radii <= across) & (across <= high + radii)).all(axis=3).any(axis=(0, 2))
    assert meets.any()
    assert not meets.all()
