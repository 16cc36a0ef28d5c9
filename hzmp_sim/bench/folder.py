"""The folder that a benchmark writes to."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hzmp_sim.output.artifacts import OutputError, check_directory


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
