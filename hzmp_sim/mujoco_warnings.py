"""MuJoCo's warnings as text, instead of on the screen and in a file of the working folder."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco


@contextmanager
def mujoco_warnings() -> Iterator[list[str]]:
    """Collect MuJoCo's warnings, which it would print, log into the working folder, or raise."""
    notes: list[str] = []

    def note(text: str) -> None:
        line = " ".join(text.split())
        if line not in notes:
            notes.append(line)

    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(note)
    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        try:
            yield notes
        finally:
            mujoco.set_mju_user_warning(before)
            for warning in raised:
                note(str(warning.message))
