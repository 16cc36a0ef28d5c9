"""A motion script survives being written and read."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import hzmp_sim as hz
from hzmp_sim.motion.reading import read_motion
from hzmp_sim.motion.writing import motion_text
from hzmp_sim.worlds import models_dir


def again(script: hz.MotionScript, tmp_path: Path) -> hz.MotionScript:
    file = tmp_path / "motion.toml"
    file.write_text(motion_text(script, 4.0), encoding="utf-8")
    return read_motion(file)


@pytest.mark.parametrize("file", sorted(models_dir().glob("*/motion.toml")), ids=str)
def test_scripts_of_bundled_worlds(file: Path, tmp_path: Path) -> None:
    script = read_motion(file)
    for one in (script, script.with_phases(3)):
        two = again(one, tmp_path)
        assert len(two.motions) == len(one.motions)
        for a, b in zip(one.motions, two.motions, strict=True):
            assert (a.kind, a.name, a.announced) == (b.kind, b.name, b.announced)
            for t in (0.0, 1.3, 17.9):
                assert np.allclose(a.at(t), b.at(t), atol=1e-12)


def test_goals_and_functions(tmp_path: Path) -> None:
    script = hz.MotionScript(
        motions=[
            hz.Motion(
                body="box",
                path=hz.Callback(lambda t: (math.sin(t), 0.0, 1.0)),
                announced=False,
                speed=2.0,
                offset=0.5,
            )
        ],
        goals=[hz.Goal(position=(1.0, 2.0), dwell=0.5), hz.Goal(position=(0.0, 2.0), time=3.0)],
        duration=20.0,
    )
    two = again(script, tmp_path)
    for one, other in zip(script.goals, two.goals, strict=True):
        assert (list(one.position), one.time, one.dwell) == (
            list(other.position), other.time, other.dwell,
        )  # fmt: skip
    assert two.duration == 20.0
    assert not two.motions[0].announced
    for t in np.linspace(0.0, 4.0, 41):
        assert np.allclose(two.motions[0].at(t), script.motions[0].at(t), atol=1e-3)
