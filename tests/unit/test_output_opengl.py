"""Choosing an OpenGL backend, and saying so when there is none."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest

from hzmp_sim.output import opengl
from hzmp_sim.output.opengl import RenderingUnavailable

Python = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(autouse=True)
def forget() -> Iterator[None]:
    """The choice is cached for a process; each test starts without one."""
    opengl.backend.cache_clear()
    yield
    opengl.backend.cache_clear()


def test_switched_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "disabled")
    with pytest.raises(RenderingUnavailable, match="MUJOCO_GL=disabled"):
        opengl.backend()


def test_a_machine_without_opengl_is_told_which_packages_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(opengl, "_CANDIDATES", ("no_such_backend",))
    with pytest.raises(RenderingUnavailable, match=r"libegl1 libgl1.*libosmesa6") as error:
        opengl.backend()
    assert "\n" not in str(error.value)


def test_a_missing_library_gives_one_line_and_nothing_on_the_screen(
    tmp_path: Path, python: Python
) -> None:
    """PyOpenGL finds no library when the loader has none: as on a machine without OpenGL."""
    program = """
import ctypes, ctypes.util
ctypes.util.find_library = lambda name: None
real = ctypes.CDLL.__init__
def refuse(self, name, *rest, **more):
    if name and any(part in str(name) for part in ("GL", "OSMesa")):
        raise OSError(f"{name}: not there")
    real(self, name, *rest, **more)
ctypes.CDLL.__init__ = refuse
import mujoco, os
from hzmp_sim.output import opengl
os.environ["MUJOCO_GL"] = "egl"
model = mujoco.MjModel.from_xml_string("<mujoco/>")
try:
    opengl.OffscreenRenderer(model, 32, 32)
except opengl.RenderingUnavailable as error:
    print(error)
"""
    said = python("-c", program, cwd=tmp_path, timeout=60)
    assert said.returncode == 0, said.stderr
    assert said.stderr == ""
    assert said.stdout.count("\n") == 1
    assert "libegl1" in said.stdout


def test_an_unusable_name_in_the_variable_is_not_silently_replaced(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "vulkan")
    with pytest.raises(RenderingUnavailable, match="MUJOCO_GL=vulkan"):
        opengl.backend()


@pytest.mark.render
def test_rows_start_at_the_top() -> None:
    """A world that is dark above the horizon and red below it."""
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom type='plane' size='50 50 1' rgba='1 0 0 1'/></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (0.0, 0.0, 1.0)
    camera.distance, camera.elevation = 3.0, -5.0
    scene = mujoco.MjvScene(model, 10)
    every = mujoco.mjtCatBit.mjCAT_ALL.value
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, every, scene)
    with opengl.OffscreenRenderer(model, 64, 48) as renderer:
        image = renderer.render(scene)
    assert image.shape == (48, 64, 3)
    assert image.dtype == np.uint8
    assert image[-8:, :, 0].mean() > 3.0 * image[:8, :, 0].mean()
