from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]
SOURCES = [ROOT, ROOT / "planners", ROOT / "tracking"]

os.environ["MPLBACKEND"] = "Agg"  # figures go to files: no test may ask for a window

# The same examples on every run, and no judgement on the speed of a shared machine.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what must render where nothing can, except under CI: there it has to be able to."""
    drawing = [item for item in items if item.get_closest_marker("render")]
    if not drawing or os.environ.get("CI"):
        return
    from hzmp_sim.output.opengl import RenderingUnavailable, backend

    try:
        backend()
    except RenderingUnavailable as error:
        for item in drawing:
            item.add_marker(pytest.mark.skip(reason=str(error)))


@pytest.fixture(scope="session")
def root() -> Path:
    """Folder of the checkout."""
    return ROOT


@pytest.fixture(scope="session")
def python() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run this interpreter with the sources of the checkout, without a display or a terminal."""

    def run(*arguments: str | Path, cwd: Path, timeout: float) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, SOURCES))}
        for name in ("DISPLAY", "WAYLAND_DISPLAY"):
            environment.pop(name, None)
        return subprocess.run(
            [sys.executable, *map(str, arguments)],
            cwd=cwd,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )

    return run
