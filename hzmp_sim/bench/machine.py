"""What a benchmark ran on: figures of two machines are not to be compared without it."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hzmp_sim import __version__


def machine(libraries: Sequence[str]) -> dict[str, Any]:
    """Processor, cores, load, system, and the versions of libraries (distribution names)."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load": round(os.getloadavg()[0], 2),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "versions": {"hzmp-sim": __version__} | {name: version(name) for name in libraries},
    }


def version(distribution: str) -> str | None:
    """Installed version of a distribution, None without one."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        text = ""
    found = re.search(r"^model name\s*: (.+)$", text, re.MULTILINE)
    return found[1] if found else platform.processor() or platform.machine()
