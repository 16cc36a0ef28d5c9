"""Predictions hold: at no instant is the body near a geom at a place that they call free."""

from functools import cache

import mujoco
import numpy as np
import pytest

import hzmp_sim as hz
from hzmp_planners._arrays import Floats
from hzmp_sim.scene.bodies import read_body
from hzmp_sim.scene.geoms import HalfSpace, Part, geom_shape
from hzmp_sim.scene.grown import grown_obstacle
from hzmp_sim.scene.planar import slice_support, vertical_range
from moving_worlds import SCRIPT, WORLD, flown, hold

QUERIES = {
    "planar": ("point", (-3.5, -3.5)),
    "spatial": ("point", None),
    "free": ("quadrotor", None),
}
END = 3.2


@cache
def scene_of(query: str) -> hz.Scene:
    body, start = QUERIES[query]
    goal = None if start is None else (3.5, 3.5)
    return hz.load_scene(mujoco.MjSpec.from_string(WORLD), body, start, goal, motion=SCRIPT)


def cart(path: hz.Waypoints, *, announced: bool = True) -> hz.Scene:
    """The world with nothing but its cart driven."""
    motion = hz.Motion(body="cart", path=path, announced=announced)
    spec, script = mujoco.MjSpec.from_string(WORLD), hz.MotionScript(motions=[motion])
    return hz.load_scene(spec, "point", motion=script)


class Truth:
    """Where the geoms of a scene are: MuJoCo runs, and scripts are asked between its steps, too."""

    def __init__(self, scene: hz.Scene) -> None:
        self.scene, self.model = scene, scene.model
        self.data, self.drives = flown(scene), hz.Drives(scene.model, scene.motion)
        rest = mujoco.MjData(scene.model)
        mujoco.mj_kinematics(scene.model, rest)
        self.body = read_body(scene.model, rest, scene.body)
        self.steps = 0

    @property
    def time(self) -> float:
        return self.steps * self.model.opt.timestep

    def step(self) -> None:
        mujoco.mj_step(self.model, self.data)
        hold(self.scene, self.data)
        self.steps += 1
        self.drives.apply(self.data, self.time)
        mujoco.mj_fwdPosition(self.model, self.data)

    def between(self, share: float) -> tuple[float, mujoco.MjData]:
        """What scripts drive kinematically, a share of a step later."""
        later = mujoco.MjData(self.model)
        later.qpos[:] = self.data.qpos
        t = self.time + share * self.model.opt.timestep
        self.drives.apply(later, t)
        mujoco.mj_kinematics(self.model, later)
        return t, later

    def supports(self, data: mujoco.MjData, geom: int, margin: float, normals: Floats) -> Floats:
        """Exact supports (k,) of the grown geom for normals (k, n); -inf beside the heights."""
        scene, shape = self.scene, geom_shape(self.model, data, geom)
        assert not isinstance(shape, HalfSpace)
        grow = scene.shape.radius + scene.clearance + margin
        body = scene.shape.core.support(-normals) + grow
        if scene.heights is None:
            return shape.support(normals) + body
        low, high = scene.heights
        bottom, top = vertical_range(shape)
        if top <= low + 1e-6 or bottom >= high - 1e-6:
            return np.full(len(normals), -np.inf)
        keep = scene.clearance
        return slice_support(shape, normals, low - keep, high + keep) + body

    def is_obstacle(self, data: mujoco.MjData, item: int) -> bool:
        scene, moving = self.scene, self.scene.moving[item]
        part = Part(geom_shape(self.model, data, moving.geom))
        shape, keep, tol = scene.shape, scene.clearance, scene.tolerance
        args = (self.body, shape, scene.bounds, keep, moving.margin, tol)
        return grown_obstacle(part, *args)[0] is not None


KINEMATIC = ("cart", "mast", "truck", "drone", "hook", "ghost", "tool", "door")


def check(truth: Truth, data: mujoco.MjData, item: int, A: Floats, b: Floats) -> float:
    """How far inside {A x <= b} everything is that is in the way of the body now [m].

    b may be -inf, and less than that is asked for what is not in the way at all: all the planner
    wants to know is where in its bounds the body would touch the geom.
    """
    moving = truth.scene.moving[item]
    support = truth.supports(data, moving.geom, moving.margin, A)
    slack = float((b - support).min()) if np.isfinite(b).all() else -np.inf
    if slack < -1e-7:
        assert not truth.is_obstacle(data, item), (moving.name, truth.time, slack)
        return np.inf
    return slack


@pytest.mark.parametrize("query", QUERIES)
def test_slabs_and_hulls_hold_the_geoms_at_every_instant(query: str) -> None:
    scene = scene_of(query)
    assert scene.n == (2 if query == "planar" else 3)
    count = len(scene.moving)
    assert count == 11
    truth = Truth(scene)
    prediction = hz.Predictor(scene).predict(truth.data, 0.0)
    rng = np.random.default_rng(3)
    slabs = prediction.slabs(0.013, 0.05, 64)
    start = rng.uniform(0.0, 2.0, count)
    end = start + rng.uniform(0.0, 1.2, count)
    windows = [(start, end), (end, end + 0.1), (np.zeros(count), np.full(count, END))]
    hulls = [prediction.hulls(*window) for window in windows]
    slack = []
    while truth.time < END:
        moments = [(truth.time, truth.data, list(range(count)))]
        if truth.steps % 3 == 0:  # between two steps
            t, data = truth.between(rng.uniform())
            scripted = [i for i in range(count) if scene.moving[i].name in KINEMATIC]
            moments.append((t, data, scripted))
        for t, data, items in moments:
            k = int((t - slabs.start) // slabs.step)
            for i in items:
                if t >= slabs.start:
                    slack.append(check(truth, data, i, slabs.A[i], slabs.b[k, i]))
                for (begin, finish), found in zip(windows, hulls, strict=True):
                    if not begin[i] <= t <= finish[i]:
                        continue
                    if (hull := found[i]) is None:
                        assert not truth.is_obstacle(data, i)
                    else:
                        slack.append(check(truth, data, i, hull.A, hull.b))
        for _ in range(5):
            truth.step()
    assert sum(np.isfinite(slack)) > 4000
    assert sum(np.isinf(slack)) > 100  # the ghost, most of the time
    assert min(slack) < 1e-3  # bounds are bounds, not guesses


def test_a_hull_cuts_little_more_than_the_geom_sweeps() -> None:
    scene = cart(hz.Waypoints(times=[0, 2], positions=[[-3, -3, 1], [1, 1, 1]]))
    data = flown(scene)
    row = [item.name for item in scene.moving].index("cart")
    start, end = np.zeros(len(scene.moving)), np.full(len(scene.moving), 2.0)
    hull = hz.Predictor(scene).predict(data, 0.0).hulls(start, end)[row]
    assert hull is not None
    assert len(hull.b) <= 12
    # A box of 0.8 x 0.4 x 1 m goes 4 sqrt(2) m along its diagonal, seen from above.
    keep = scene.radius + scene.clearance
    size = np.array([0.8, 0.4, 1.0]) + 2.0 * keep
    assert hull.volume() <= 1.01 * (size.prod() + 4.0 * size[2] * (size[0] + size[1]))


def test_the_same_hulls_whatever_was_asked_before() -> None:
    scene = scene_of("spatial")
    data, count = flown(scene), len(scene.moving)
    early, late = hz.Predictor(scene), hz.Predictor(scene)
    late.predict(data, 0.0).slabs(0.0, 0.5, 14)
    window = np.full(count, 1.1), np.full(count, 1.9)
    for one, two in zip(*(p.predict(data, 0.0).hulls(*window) for p in (early, late)), strict=True):
        assert (one is None) == (two is None)
        if one is not None and two is not None:
            np.testing.assert_allclose(one.b, two.b, atol=1e-12)


@pytest.mark.parametrize("query", ["planar", "spatial"])
def test_unannounced_motions_are_predicted_from_what_is_seen(query: str) -> None:
    """Bounds hold as long as no point is accelerated by more than was assumed."""
    path = hz.Circle(centre=[0, 0, 1], radius=1.5, period=4.0)  # 3.7 m/s^2
    motions = [
        hz.Motion(body="cart", path=path, announced=False),
        hz.Motion(joint="door", path=hz.Swing(amplitude=1.0, period=6.0), announced=False),
    ]
    body, start = QUERIES[query]
    goal = None if start is None else (3.5, 3.5)
    spec = mujoco.MjSpec.from_string(WORLD)
    script = hz.MotionScript(motions=motions)
    scene = hz.load_scene(spec, body, start, goal, motion=script)
    truth = Truth(scene)
    predictor = hz.Predictor(scene, acceleration=5.0)
    predictor.observe(truth.data, 0.0)
    while truth.time < 0.05:
        truth.step()
    prediction = predictor.predict(truth.data, truth.time)
    secret = {scene.geom_name(g) for g in np.array(prediction.geoms)[~prediction.known]}
    assert secret == {"cart", "mast", "door"}
    items = np.flatnonzero(~prediction.known).tolist()
    now, count = truth.time, len(scene.moving)
    hulls = prediction.hulls(np.full(count, now), np.full(count, now + 1.0))
    slabs = prediction.slabs(now, 0.05, 20)
    assert (np.diff(slabs.b[:, items[0], :4].sum(axis=1)) > 0.0).all()  # ever less is known
    while truth.time < now + 1.0 - 1e-9:
        k = min(19, int((truth.time - now) / 0.05))
        for i in items:
            assert check(truth, truth.data, i, slabs.A[i], slabs.b[k, i]) >= -1e-7
            hull = hulls[i]
            assert hull is not None
            assert check(truth, truth.data, i, hull.A, hull.b) >= -1e-7
        assert prediction.broken(truth.data, truth.time) == []
        truth.step()


def test_what_breaks_its_prediction_is_told_by_name_and_not_trusted_again() -> None:
    scene = scene_of("spatial")
    data, predictor = flown(scene), hz.Predictor(scene)
    prediction = predictor.predict(data, 0.0)
    assert prediction.known.all()
    hz.Drives(scene.model, scene.motion).apply(data, 0.002)
    data.mocap_pos[scene.model.body_mocapid[scene.model.body("truck").id]] += [0.0, 0.3, 0.0]
    mujoco.mj_kinematics(scene.model, data)
    (found,) = prediction.broken(data, 0.002)
    assert (found.name, found.time) == ("truck", 0.002)
    assert found.distance == pytest.approx(0.3, abs=0.01)
    after = predictor.predict(data, 0.002)
    assert [scene.geom_name(after.geoms[i]) for i in np.flatnonzero(~after.known)] == ["truck"]


def test_the_tape_is_what_a_flight_meets() -> None:
    scene = scene_of("spatial")
    truth, predictor = Truth(scene), hz.Predictor(scene)
    while truth.time < 2.0:
        seen = predictor.observe(truth.data, truth.time)
        assert predictor.tape_error(seen).max() < 1e-6
        truth.step()
    prediction = predictor.predict(truth.data, truth.time)
    assert prediction.known.all()
    assert prediction.broken(truth.data, truth.time) == []


def test_what_changes_its_speed_by_little_is_known_for_longer() -> None:
    """Bounds hold for points whose velocity changes by 0.3 m/s at once, and no more."""
    places = [[-3.0, -3.0, 1.0], [-2.0, -3.0, 1.0], [0.6, -3.0, 1.0]]  # 1, then 1.3 m/s
    scene = cart(hz.Waypoints(times=[0.0, 1.0, 3.0], positions=places), announced=False)
    truth, predictor = Truth(scene), hz.Predictor(scene, 1e6, speed_change=0.3001)
    assert not predictor.ready(truth.data, 0.0)  # nothing is known of its velocity
    while truth.time < 0.998:
        truth.step()
    assert predictor.ready(truth.data, truth.time)
    prediction = predictor.predict(truth.data, truth.time)
    row = [item.name for item in scene.moving].index("cart")
    slabs = prediction.slabs(truth.time, 0.05, 40)
    more = hz.Predictor(scene)
    more.observe(flown(scene), 0.0)
    looser = more.predict(truth.data, truth.time).slabs(truth.time, 0.05, 40)
    width = (slabs.b[-1, row, :2].sum(), looser.b[-1, row, :2].sum())
    assert width[1] - width[0] > 4.0  # 1.2 m and not 6 m on both sides, after 2 s
    while truth.time < 2.9:
        k = int((truth.time - slabs.start) / slabs.step)
        assert check(truth, truth.data, row, slabs.A[row], slabs.b[k, row]) >= -1e-7
        assert prediction.broken(truth.data, truth.time) == []
        truth.step()


def test_what_jumps_goes_on_as_before_its_jump() -> None:
    places = [[-3.0, -3.0, 1.0], [-1.99, -3.0, 1.0], [3.0, 3.0, 1.0], [3.0, 2.0, 1.0]]
    path = hz.Waypoints(times=[0.0, 1.01, 1.01, 2.0], positions=places)
    scene = cart(path, announced=False)
    truth, predictor = Truth(scene), hz.Predictor(scene)
    row = [item.name for item in scene.moving].index("cart")
    while truth.time < 1.02:
        if truth.steps % 25 == 0:
            predictor.observe(truth.data, truth.time)
        truth.step()
    while truth.steps % 25:
        truth.step()
    seen = predictor.observe(truth.data, truth.time)
    np.testing.assert_allclose(seen.velocity[row].mean(axis=0), [1.0, 0.0, 0.0], atol=1e-9)
