"""What MuJoCo or its bindings do not survive in MJCF files, refused before it reads them."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

from hzmp_planners.errors import SceneError

MAX_COPIES = 10_000
"""MuJoCo takes 13 s to read this many copies of a geom, and a hundred times that for ten times as
many."""

MAX_HEIGHTS = 25_000_000
"""A height field of more points than this takes MuJoCo gigabytes before it says anything."""

_COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
_MATTER = (b"<replicate", b"<hfield", b"<include", b"<model")


def check_files(file: Path, label: Path) -> None:
    """Look at an MJCF file and those it includes or attaches, as far as they can be parsed.

    Args:
        file: the MJCF file.
        label: what messages call it.

    Raises:
        SceneError: a file refers to itself, at which MuJoCo's stack overflows, or an element is to
            be copied more than `MAX_COPIES` times, nested ones multiplied, or a
            height field has more than `MAX_HEIGHTS` points, or entities are declared, or a text
            is not UTF-8: names in another encoding cannot be read back.
    """
    _check(file, label, (), set())


def _check(file: Path, label: Path, above: tuple[Path, ...], done: set[Path]) -> None:
    file = file.resolve()
    if file in above:
        way = " -> ".join(path.name for path in (*above[above.index(file) :], file))
        raise SceneError(f"{label}: {way}: a file cannot include or attach itself")
    if file in done:
        return
    done.add(file)
    try:
        text = file.read_bytes()
    except OSError:  # for MuJoCo to tell
        return
    try:
        plain = _COMMENT.sub(b"", text).decode()  # MuJoCo passes over comments in any encoding
    except UnicodeDecodeError as error:
        wrong = f"byte {error.object[error.start]:#x} after {error.start} others, comments aside"
        raise SceneError(
            f"{label}: {file.name} is not UTF-8 ({wrong}), the only encoding MuJoCo reads"
        ) from error
    if "<!ENTITY" in plain:
        raise SceneError(f"{label}: {file.name} declares entities, which MuJoCo does not read")
    try:
        root = ET.fromstring(text) if any(tag in text for tag in _MATTER) else None
    except (ET.ParseError, ValueError, LookupError):  # for MuJoCo to tell
        return
    waiting = [] if root is None else [(root, 1)]
    while waiting:
        element, copies = waiting.pop()
        if element.tag == "replicate":
            copies = _multiplied(copies, element.get("count", "").strip(), label)
        if element.tag == "hfield":
            _check_grid(element, label)
        if element.tag in ("include", "model") and (name := element.get("file")):
            for folder in {path.parent for path in (file, *above[:1])}:
                _check(folder / name, label, (*above, file), done)
        waiting += [(child, copies) for child in element]


def _check_grid(field: ET.Element, label: Path) -> None:
    rows, columns = (field.get(key, "").strip() for key in ("nrow", "ncol"))
    if rows.isdecimal() and columns.isdecimal() and int(rows) * int(columns) > MAX_HEIGHTS:
        raise SceneError(
            f"{label}: hfield {field.get('name')!r} has {rows} x {columns} points, more than "
            f"{MAX_HEIGHTS:,}: make it coarser"
        )


def _multiplied(copies: int, count: str, label: Path) -> int:
    copies *= int(count[:20]) if count.isdecimal() else 1
    if copies > MAX_COPIES:
        raise SceneError(
            f'{label}: <replicate count="{count}"> makes {copies} copies, more than {MAX_COPIES}: '
            "MuJoCo would take minutes to read them; use fewer, or one mesh"
        )
    return copies
