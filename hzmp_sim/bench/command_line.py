"""The command line that settings stand for: a result says how to measure it again."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def command_line(
    command: Sequence[str], settings: DataclassInstance, more: Sequence[str] = ()
) -> str:
    """A command with those settings that are not the default, quoted for a shell.

    Args:
        command: its words.
        settings: a dataclass whose fields are its options.
        more: words that follow.
    """
    words = list(command)
    for field in fields(settings):
        value, name = getattr(settings, field.name), field.name.replace("_", "-")
        if value == field.default:
            continue
        if isinstance(value, bool):
            words.append(f"--{name}" if value else f"--no-{name}")
        else:
            words += [f"--{name}", *map(str, value if isinstance(value, tuple) else [value])]
    return shlex.join([*words, *more])
