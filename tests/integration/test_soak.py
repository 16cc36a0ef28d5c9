"""A short version of the soak of `benchmarks/soak.py`, which is for ten million steps."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import pytest

from benchmarks.soak import patrol
from hzmp_sim.simulation.slide_actuation import SlideActuation
from hzmp_tracking.controllers import BodyState


@pytest.mark.parametrize("body", ["point", "quadrotor"])
def test_a_patrol_neither_drifts_nor_leaks(body: str) -> None:
    done = patrol("narrow_passage", body, 24_000, 12_000)  # two laps and more
    first, last = done.windows
    assert done.steps == 24_000
    assert done.laps >= 2
    assert first.contacts == last.contacts == 0
    assert last.error <= first.error + 1e-6
    assert last.energy <= 1e-6
    assert last.memory <= first.memory + 20.0


def test_a_patrol_that_blows_up_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    gentle = SlideActuation.apply

    def push(
        self: SlideActuation,
        data: mujoco.MjData,
        state: BodyState,
        *reference: Sequence[float],
    ) -> None:
        gentle(self, data, state, *reference)
        if data.time > 1.0:
            data.qfrc_applied[:] = 1e12

    monkeypatch.setattr(SlideActuation, "apply", push)
    mujoco.set_mju_user_warning(lambda text: None)  # MuJoCo would write a file
    try:
        done = patrol("enclosure", "point", 2_000, 500)
    finally:
        mujoco.set_mju_user_warning(None)
    assert 500 <= done.steps < 520
    assert len(done.windows) == 2
