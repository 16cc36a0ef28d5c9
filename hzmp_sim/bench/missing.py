"""What to install for a library that a benchmark measures beside this one."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence


def missing_line(name: str, modules: Sequence[str], packages: str) -> str | None:
    """A line that says what to install, None when nothing is missing.

    Args:
        name: what is not measured without them.
        modules: what must be importable.
        packages: what to install for that.
    """
    absent = [module for module in modules if importlib.util.find_spec(module) is None]
    if not absent:
        return None
    return (
        f"{name}: not measured, {' and '.join(absent)} not importable; "
        f"pip install {packages} (or 'hzmp-sim[bench]')"
    )
