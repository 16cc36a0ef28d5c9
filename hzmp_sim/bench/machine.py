"""What a benchmark ran on: figures of two machines are not to be compared without it."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
from collections.abc import Mapping, Sequence
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


def hardware(facts: Mapping[str, Any]) -> str:
    """Processor, cores and load of a `machine`, for a sentence."""
    return (
        f"{facts['processor']}, {facts['cores']} cores, one thread used; load {facts['load']:g} "
        "before the run"
    )


def software(facts: Mapping[str, Any]) -> str:
    """System and versions of a `machine`, for a sentence."""
    known = sorted(facts["versions"].items())  # as in the JSON file, from which pages are made too
    versions = ", ".join(f"{name} {number}" for name, number in known)
    return f"{facts['system']}, Python {facts['python']}; {versions}"


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
