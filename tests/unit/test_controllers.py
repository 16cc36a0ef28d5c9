import math
from typing import Any

import numpy as np
import pytest

from hzmp_planners.errors import QueryError, ShapeError
from hzmp_tracking.controllers import (
    BodyState,
    Mixer,
    PointController,
    QuadrotorController,
    Reference,
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
    lag, lead, present = 0.03, 0.01, [1.3, 1.4, 1.5, 1.6]
    state = BodyState((0.0,) * 3, (0.0,) * 3, rotor_thrusts=present)
    inputs = quadrotor(motor_lag=lag, lead_time=lead).command(state, Reference((0.0,) * 3))
    after = np.array(inputs) + (np.array(present) - inputs) * math.exp(-lead / lag)
    assert after == pytest.approx([HOVER] * 4)


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
