"""Offscreen OpenGL: which backend works here, and a renderer that uses it.

MuJoCo picks its backend from MUJOCO_GL when it is first imported, and that import fails when the
library is missing. So the backend is chosen here, only when something is to be rendered.
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from functools import cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from hzmp_planners.errors import HzmpError

Image = NDArray[np.uint8]

_CANDIDATES = ("cgl",) if sys.platform == "darwin" else ("egl", "osmesa", "glfw")
_PROBE_TIMEOUT_S = 30.0
_OFF = ("disable", "disabled", "off", "false", "0")
_ANY = ("", "enable", "enabled", "on", "true", "1")
_MODULES = {"egl": "egl", "osmesa": "osmesa", "glfw": "glfw", "glx": "glfw", "cgl": "cgl"}
_HOW_TO = (
    "install a system OpenGL (Debian/Ubuntu: 'apt-get install libegl1 libgl1', "
    "or 'apt-get install libosmesa6')"
)


class RenderingUnavailable(HzmpError, RuntimeError):  # noqa: N818 - a state of the machine
    """There is no OpenGL on this machine to render with."""


@cache
def backend() -> str:
    """Module of `mujoco` that makes an OpenGL context here: "egl", "osmesa", "glfw" or "cgl".

    MUJOCO_GL decides when it is set. Otherwise each is tried in a process of its own: a driver
    may print, or take its process down.

    Raises:
        RenderingUnavailable: none works, or MUJOCO_GL says not to render.
    """
    chosen = os.environ.get("MUJOCO_GL", "").lower().strip()
    if chosen in _MODULES:
        return _MODULES[chosen]
    if chosen in _OFF:
        raise RenderingUnavailable(f"rendering is switched off by MUJOCO_GL={chosen}; unset it")
    if chosen not in _ANY:
        raise RenderingUnavailable(
            f"MUJOCO_GL={chosen} names no backend; valid: {', '.join(_MODULES)}, or unset"
        )
    for name in _CANDIDATES:
        if _works(name):
            return name
    raise RenderingUnavailable(f"no OpenGL to render with; {_HOW_TO}")


def _works(name: str) -> bool:
    program = f"from mujoco.{name} import GLContext; GLContext(8, 8).make_current()"
    command = [sys.executable, "-c", program]
    try:
        subprocess.run(command, capture_output=True, timeout=_PROBE_TIMEOUT_S, check=True)
    except (subprocess.SubprocessError, OSError):
        return False
    return True


class OffscreenRenderer:
    """Renders scenes of one model into images; use as a context manager.

    Args:
        model: compiled model; its visual settings say shadows and multisampling.
        width: of the image, in pixels, at most `model.vis.global_.offwidth`.
        height: likewise.

    Raises:
        RenderingUnavailable: no OpenGL context could be made.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        name = backend()
        self._context: Any = None
        try:
            self._gl: Any = importlib.import_module(f"mujoco.{name}").GLContext(width, height)
            self._gl.make_current()
            self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        except Exception as error:  # the bindings raise whatever the missing symbol leads to
            reason = str(error).strip().splitlines()[-1:] or [type(error).__name__]
            raise RenderingUnavailable(
                f"OpenGL backend {name!r} does not work here ({reason[0]}); {_HOW_TO}"
            ) from error
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._viewport = mujoco.MjrRect(0, 0, width, height)
        self._pixels: Image = np.empty((height, width, 3), np.uint8)

    def render(self, scene: mujoco.MjvScene) -> Image:
        """Image of `scene`, shape (height, width, 3), first row at the top."""
        mujoco.mjr_render(self._viewport, scene, self._context)
        mujoco.mjr_readPixels(self._pixels, None, self._viewport, self._context)
        return self._pixels[::-1].copy()  # OpenGL counts rows from below

    def __enter__(self) -> OffscreenRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        self._context.free()
        self._gl.free()
