import math
from typing import Any

import numpy as np
import pytest

from hzmp_planners.errors import QueryError, ShapeError
from hzmp_tracking.controllers import (
    BodyState,
    DisturbanceObserver,
    Mixer,
    PointController,
    QuadrotorController,
    Reference,
    rotor_limits,
)

ARM, DRAG, MASS = 0.09, 0.016, 0.6
ALLOCATION = np.array(
    [[1, 1, 1, 1], [-ARM, -ARM, ARM, ARM], [-ARM, ARM, ARM, -ARM], [-DRAG, DRAG, -DRAG, DRAG]]
)
LOW, HIGH = [0.0] * 4, [4.5] * 4
INERTIA = np.diag([0.0016, 0.0018, 0.0029])
HOVER = MASS * 9.81 / 4


def quadrotor(**changes: Any) -> QuadrotorController:
    settings: dict[str, Any] = {"mass": MASS, "inertia": INERTIA, "allocation": ALLOCATION,
                "thrust_limits": (LOW, HIGH)} | changes  # fmt: skip
    return QuadrotorController(**settings)


def test_point_feeds_forward_and_back() -> None:
    controller = PointController([2.0] * 3, [(-50.0, 50.0)] * 3, natural_frequency=3.0)
    state = BodyState((1.0, 0.0, 0.0), (0.0, 0.5, 0.0))
    force = controller.command(state, Reference((2.0, 0.0, 0.0), acceleration=(0.0, 0.0, 1.5)))
    assert force == pytest.approx([2.0 * 9.0, -2.0 * 6.0 * 0.5, 3.0])


def test_point_forces_are_clipped_and_axes_left_out() -> None:
    controller = PointController(
        [1.0, 1.0, math.inf], [(-2.0, 5.0), (-2.0, 5.0), (0.0, 0.0)], loads=[0.0, 1.0, 0.0]
    )
    state = BodyState((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert controller.command(state, Reference((9.0, -9.0, 9.0))) == (5.0, -2.0, 0.0)
    assert controller.command(state, Reference((0.0, 0.0, 9.0))) == (0.0, 1.0, 0.0)


@pytest.mark.parametrize("change", [{"masses": [0.0, 1.0, 1.0]}, {"natural_frequency": 0.0},
                                    {"masses": [math.nan, 1.0, 1.0]}])  # fmt: skip
def test_point_refuses_nonsense(change: dict[str, Any]) -> None:
    settings: dict[str, Any] = {"masses": [1.0] * 3, "force_limits": [(-1.0, 1.0)] * 3} | change
    with pytest.raises(QueryError, match="positive"):
        PointController(**settings)


def test_mixer_gives_the_wrench_when_it_can() -> None:
    wrench = (6.0, 0.05, -0.08, 0.01)
    thrusts = Mixer(ALLOCATION).allocate(wrench, LOW, HIGH)
    assert ALLOCATION @ thrusts == pytest.approx(wrench)


def test_mixer_gives_up_yaw_before_anything_else() -> None:
    rng = np.random.default_rng(5)
    mixer, inverse = Mixer(ALLOCATION), np.linalg.inv(ALLOCATION)
    kept = 0
    for _ in range(500):
        wrench = rng.uniform([2.0, -0.4, -0.4, -0.3], [16.0, 0.4, 0.4, 0.3])
        thrusts = np.array(mixer.allocate(tuple(wrench), LOW, HIGH))
        assert (thrusts >= 0.0).all()
        assert (thrusts <= 4.5).all()
        without_yaw = inverse @ (wrench * [1, 1, 1, 0])
        got = ALLOCATION @ thrusts
        if without_yaw.min() >= 0.0 and without_yaw.max() <= 4.5:
            kept += 1
            assert got[:3] == pytest.approx(wrench[:3], abs=1e-9)
            assert abs(got[3]) <= abs(wrench[3]) + 1e-12
        elif np.ptp(inverse @ (wrench * [0, 1, 1, 0])) <= 4.5:
            assert got[1:3] == pytest.approx(wrench[1:3], abs=1e-9)  # thrust gives way
    assert kept > 50


def test_mixer_of_rank_three_is_refused() -> None:
    flat = ALLOCATION.copy()
    flat[3] = [-DRAG, -DRAG, DRAG, DRAG]  # yaw in step with roll: as in a well-known model
    with pytest.raises(QueryError, match="only 3 of the 4"):
        Mixer(flat)
    with pytest.raises(ShapeError):
        Mixer(np.eye(3))


def test_hover_needs_no_correction() -> None:
    controller = quadrotor()
    state = BodyState((1.0, 2.0, 3.0), (0.0, 0.0, 0.0))
    thrusts = controller.command(state, Reference((1.0, 2.0, 3.0)))
    assert thrusts == pytest.approx([HOVER] * 4)
    assert controller.hover == pytest.approx([HOVER] * 4)


@pytest.mark.parametrize(("offset", "torque_row", "sign"), [((1, 0, 0), 2, 1), ((0, 1, 0), 1, -1)])
def test_leans_towards_the_reference(offset: tuple[float, ...], torque_row: int, sign: int) -> None:
    state = BodyState((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    thrusts = quadrotor().command(state, Reference(tuple(0.01 * x for x in offset)))
    assert sign * (ALLOCATION @ thrusts)[torque_row] > 0.0


def test_jerk_becomes_body_rate() -> None:
    # At hover, body y rate = j_x / g: that rate with that jerk needs no torque.
    rate = 2.0 / 9.81
    state = BodyState((0.0,) * 3, (0.0,) * 3, angular_velocity=(0.0, rate, 0.0))
    thrusts = quadrotor().command(state, Reference((0.0,) * 3, jerk=(2.0, 0.0, 0.0)))
    assert (ALLOCATION @ thrusts)[1:] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_heading_is_restored_about_the_vertical() -> None:
    half = math.radians(10.0)
    state = BodyState((0.0,) * 3, (0.0,) * 3, (math.cos(half), 0.0, 0.0, math.sin(half)))
    wrench = ALLOCATION @ quadrotor().command(state, Reference((0.0,) * 3))
    assert wrench[3] < 0.0
    assert wrench[:3] == pytest.approx([MASS * 9.81, 0.0, 0.0], abs=1e-9)


def test_lead_reaches_the_wanted_thrust_after_the_lead_time() -> None:
    lag, lead = 0.03, 0.01
    state = BodyState((0.0,) * 3, (0.0,) * 3)
    controller = quadrotor(motor_lag=lag, lead_time=lead, time_step=0.002, observer_frequency=0.0)
    # A step of tilting first, so that the rotors are not at rest; their model goes on from it.
    tilting = controller.command(state, Reference((0.3, -0.1, 0.2)))
    present = HOVER + (np.array(tilting) - HOVER) * (1.0 - math.exp(-0.002 / lag))
    inputs = controller.command(state, Reference((0.0,) * 3))
    after = np.array(inputs) + (present - inputs) * math.exp(-lead / lag)
    assert after == pytest.approx([HOVER] * 4)


def test_snap_becomes_angular_acceleration() -> None:
    state = BodyState((0.0,) * 3, (0.0,) * 3)
    wrench = ALLOCATION @ quadrotor().command(state, Reference((0.0,) * 3, snap=(20.0, -10.0, 0.0)))
    assert wrench[1:] == pytest.approx(INERTIA @ [10.0 / 9.81, 20.0 / 9.81, 0.0], abs=1e-12)


def test_what_is_unknown_is_held_against_and_forgotten_by_reset() -> None:
    controller, dt, wind = quadrotor(time_step=0.002), 0.002, 1.5
    thrusts: tuple[float, ...] = ()
    at, velocity = Reference((0.0,) * 3), 0.0
    for _ in range(1000):  # pushed along z, held in place by nothing: only its velocity tells
        thrusts = controller.command(BodyState((0.0,) * 3, (0.0, 0.0, velocity)), at)
        velocity += dt * (sum(thrusts) / MASS - 9.81 + wind)
    assert sum(thrusts) / MASS == pytest.approx(9.81 - wind, abs=1e-3)
    assert velocity == pytest.approx(0.0, abs=1e-3)
    controller.reset()
    assert controller.command(BodyState((0.0,) * 3, (0.0,) * 3), at) == pytest.approx([HOVER] * 4)


def test_observer_finds_a_constant_push_and_believes_no_more_than_told() -> None:
    dt = 0.002
    for push, found in (([0.5, -1.0, 0.2], [0.5, -1.0, 0.2]), ([0.0, 9.0, 0.0], [0.0, 3.0, 0.0])):
        observer, velocity = DisturbanceObserver(15.0, dt, 3.0), np.zeros(3)
        seen: list[float] = []
        for k in range(1500):
            thrust = np.array([math.sin(k * dt), 0.3, -0.1])
            _, seen = observer.update(velocity.tolist(), thrust.tolist())
            velocity = velocity + dt * (thrust + push)
        assert seen == pytest.approx(found, abs=1e-3)


def test_observed_velocity_is_less_noisy_than_measured() -> None:
    rng, dt = np.random.default_rng(1), 0.002
    observer, velocity, errors = DisturbanceObserver(15.0, dt, 3.0), 0.0, []
    for k in range(5000):
        acceleration = math.cos(k * dt)
        measured = velocity + 0.1 * float(rng.standard_normal())
        known, _ = observer.update([measured, 0.0, 0.0], [acceleration, 0.0, 0.0])
        errors.append(known[0] - velocity)
        velocity += dt * acceleration
    assert np.std(errors[1000:]) < 0.1 / 3.0


@pytest.mark.parametrize("wrong", [(-1.0, 0.002, 1.0), (600.0, 0.002, 1.0), (5.0, 0.0, 1.0)])
def test_observer_refuses_nonsense(wrong: tuple[float, float, float]) -> None:
    with pytest.raises(QueryError, match="frequency"):
        DisturbanceObserver(*wrong)


def test_rotors_that_follow_from_the_body_reach_as_far_as_its_torque() -> None:
    window, tilt = 0.08, 0.6
    rotors = rotor_limits(MASS, INERTIA, ALLOCATION, (LOW, HIGH), (0, 0, -9.81), tilt, window)
    assert rotors.most_thrust == pytest.approx(18.0 / MASS)
    assert rotors.acceleration == pytest.approx(9.81 * math.sin(tilt))
    # At the least a reference lets them carry, about the worst horizontal axis, one rotor stops.
    usual = rotors.scaled(0.8)
    mixer, lift = np.linalg.inv(ALLOCATION), MASS * (9.81 - usual.acceleration)
    least = math.inf
    for angle in np.linspace(0.0, 2.0 * math.pi, 721):
        alpha = 2.0 * rotors.body_rate / window * np.array([math.cos(angle), math.sin(angle), 0.0])
        least = min(least, (mixer @ [lift, *(INERTIA @ alpha)]).min())
    assert least == pytest.approx(0.0, abs=1e-4)
    assert usual.tilt == pytest.approx(0.8 * tilt)
    assert usual.body_rate == pytest.approx(0.8 * rotors.body_rate)
    assert usual.most_thrust - 9.81 == pytest.approx(0.8 * (rotors.most_thrust - 9.81))


def test_mixer_keeps_as_much_roll_and_pitch_as_fits() -> None:
    mixer = Mixer(ALLOCATION)
    for roll, pitch in ((1.2, 0.0), (0.9, -0.7), (0.1, 2.0)):
        got = ALLOCATION @ mixer.allocate((6.0, roll, pitch, 0.0), LOW, HIGH)
        turn = np.linalg.inv(ALLOCATION) @ [0.0, roll, pitch, 0.0]
        share = min(1.0, 4.5 / np.ptp(turn))
        assert got[1:3] == pytest.approx([share * roll, share * pitch], abs=1e-9)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"mass": 2.0}, QueryError, "thrust to weight is 0.917"),
        ({"mass": -1.0}, QueryError, "positive"),
        ({"gravity": (0.0, 0.0, 0.0)}, QueryError, "gravity"),
        ({"inertia": np.eye(2)}, ShapeError, "inertia"),
        ({"thrust_limits": (LOW, [4.5] * 3)}, ShapeError, "thrust_limits"),
        ({"motor_lag": -0.1}, QueryError, "motor_lag"),
    ],
)
def test_quadrotor_refuses_nonsense(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        quadrotor(**change)
