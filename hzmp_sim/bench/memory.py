"""How much memory this process uses."""

from __future__ import annotations

import re
import resource
import sys
from pathlib import Path


def peak_mb() -> float:
    """Largest resident memory of this process so far [MB].

    Read from the kernel's account of this process (VmHWM) where there is one: what getrusage
    reports on Linux may be the peak of the process that started this one.
    """
    return _account("VmHWM") or _usage_mb()


def resident_mb() -> float:
    """Resident memory of this process now [MB]; elsewhere than on Linux the largest so far."""
    return _account("VmRSS") or _usage_mb()


def _account(name: str) -> float | None:
    try:
        status = Path("/proc/self/status").read_text(encoding="utf-8")
    except OSError:
        return None
    found = re.search(rf"^{name}:\s*(\d+) kB$", status, re.MULTILINE)
    return int(found[1]) * 1024 / 1e6 if found else None


def _usage_mb() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return usage / 1e6 if sys.platform == "darwin" else usage * 1024 / 1e6
