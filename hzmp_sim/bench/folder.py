"""The folder that a benchmark writes to, and the two files that each writes there."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hzmp_sim.output.artifacts import OutputError, check_directory, to_json, whole_file


def prepare_folder(folder: Path, names: Iterable[str]) -> None:
    """Make the folder, and take away what an older run left there.

    Args:
        folder: it may exist.
        names: of the files that a run writes, the one that completes it first.

    Raises:
        OutputError: it cannot be made or written.
    """
    check_directory(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in names:
            (folder / name).unlink(missing_ok=True)
        trial = folder / ".trial"
        trial.touch()
        trial.unlink()
    except OSError as error:
        raise OutputError(
            f"folder {folder} cannot be written ({error.strerror or error}); "
            "name one in which you may create files"
        ) from error


def write_page_and_data(page: Path, text: str, data: dict[str, Any]) -> list[Path]:
    """Write a Markdown page, then its data beside it: a folder with these is complete.

    Args:
        page: its name ends with ".md"; the data's ends with ".json".
        text: of the page.
        data: JSON-ready.

    Returns:
        Both paths.
    """
    page.write_text(text, encoding="utf-8")
    complete = page.with_suffix(".json")
    with whole_file(complete) as partial:
        partial.write_text(to_json(data), encoding="utf-8")
    return [page, complete]
