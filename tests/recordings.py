"""Recordings, read back."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from rerun.chunk import RrdReader


def verify_recording(path: Path) -> None:
    """Rerun's own check; it says 0 files, and no error, about a file that is no recording."""
    rerun = Path(sys.executable).with_name("rerun")
    said = subprocess.run([rerun, "rrd", "verify", path], capture_output=True, text=True)
    assert said.returncode == 0
    assert "1 file verified" in said.stderr


def recorded(path: Path, entity: str, component: str) -> list[Any]:
    """All values of one component of an entity, in the order of the file."""
    values: list[Any] = []
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == entity and component in batch.schema.names:
            values += batch.column(batch.schema.names.index(component)).to_pylist()
    return values
