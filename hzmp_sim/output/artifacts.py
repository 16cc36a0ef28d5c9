"""The run directory: all of a run's files appear together, or none of them."""

from __future__ import annotations

import json
import math
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from hzmp_planners._files import written_whole
from hzmp_planners.errors import HzmpError

METRICS = "metrics.json"
_FILES = (
    METRICS,
    "trajectory.parquet",
    "run.rrd",
    "run.mp4",
    "report.html",
    "scene.xml",
    "motion.toml",
    "plans.json",
)
_FIGURES = "figures"


class OutputError(HzmpError, OSError):
    """A run directory or a file in it cannot be written."""


def check_directory(directory: str | Path) -> None:
    """Refuse what cannot become a run directory.

    Raises:
        OutputError: it is a file.
    """
    if Path(directory).exists() and not Path(directory).is_dir():
        raise OutputError(f"run directory {directory} is a file; name a directory")


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Where to write a file that appears under its name when the block ends normally, or never.

    Raises:
        OutputError: the file cannot be written.
    """
    target = Path(path)
    if target.is_dir():
        raise OutputError(f"{path} is a directory; name a file")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(target) as partial:
            partial.touch()
            yield partial
    except OSError as error:
        reason = error.strerror or error
        raise OutputError(
            f"{path} cannot be written ({reason}); name a file where you may create files"
        ) from error


class RunDirectory:
    """Context manager that publishes a run's files in one go.

    Inside the block, files are written to a hidden sibling folder. When the block ends normally
    they move to their place, metrics.json last, and whatever an older run left under the names of
    a run is removed. When it ends by an exception or Ctrl-C nothing was touched; when the process
    is killed only the hidden folder stays behind.

        with RunDirectory("runs/x") as files:
            write_recording(run, files.path("run.rrd"))
            files.write_metrics(run.metrics)
    """

    def __init__(self, directory: str | Path) -> None:
        self.directory = Path(directory)

    def __enter__(self) -> Self:
        """Make the hidden folder.

        Raises:
            OutputError: the directory is a file, or cannot be made or written.
        """
        check_directory(self.directory)
        target = self.directory.absolute()
        self._staging = target.parent / f".{target.name}.{secrets.token_hex(4)}.partial"
        try:
            self._staging.mkdir(parents=True)
        except OSError as error:
            reason = error.strerror or error
            raise OutputError(
                f"run directory {self.directory} cannot be written ({reason}); "
                "name a directory in which you may create files"
            ) from error
        return self

    def path(self, name: str) -> Path:
        """Where to write the artefact `name` ("run.rrd", "figures/path.png") for now.

        Raises:
            OutputError: not the name of an artefact of a run.
        """
        parts = Path(name).parts
        figure = len(parts) == 2 and parts[0] == _FIGURES and parts[1].endswith(".png")
        if name not in _FILES and not figure:
            raise OutputError(
                f"{name!r} is not an artefact of a run; valid: {', '.join(_FILES)}, figures/*.png"
            )
        path = self._staging / name
        path.parent.mkdir(exist_ok=True)
        return path

    def write_metrics(self, metrics: dict[str, Any]) -> None:
        """Write metrics.json: strict JSON, keys sorted, null for what is not a finite number."""
        self.path(METRICS).write_text(to_json(metrics), encoding="utf-8")

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Publish, or on an exception drop the hidden folder.

        Raises:
            OutputError: the files could not be moved to their place.
        """
        try:
            if kind is None:
                self._publish(self.directory.absolute())
        except OSError as failure:
            raise OutputError(
                f"run directory {self.directory} could not be completed: {failure}"
            ) from failure
        finally:
            shutil.rmtree(self._staging, ignore_errors=True)

    def _publish(self, target: Path) -> None:
        if not target.exists():
            self._staging.rename(target)  # one atomic step
            return
        # metrics.json goes first and comes last: without it a directory is no finished run.
        for old in [*(target / name for name in _FILES), *target.glob(f"{_FIGURES}/*.png")]:
            old.unlink(missing_ok=True)
        staged = [path for path in self._staging.rglob("*") if path.is_file()]
        for path in sorted(staged, key=lambda path: path.name == METRICS):
            place = target / path.relative_to(self._staging)
            place.parent.mkdir(exist_ok=True)
            path.replace(place)


def to_json(value: dict[str, Any]) -> str:
    """Strict, stable JSON of a metrics dictionary: numpy scalars as numbers, NaN and inf as null.

    Raises:
        TypeError: a value that JSON has no form for.
    """
    return json.dumps(_plain(value), allow_nan=False, indent=2, sort_keys=True) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
