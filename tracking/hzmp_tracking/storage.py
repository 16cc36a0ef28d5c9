"""Trajectories as files: JSON for people and other programs, npz, and Parquet for data tools.

All three hold every number exactly, so that what is loaded proves what was saved.
"""

from __future__ import annotations

import io
import json
import zipfile
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hzmp_planners._files import written_whole
from hzmp_planners.errors import QueryError, ShapeError
from hzmp_planners.sets import Polytope
from hzmp_tracking.limits import AXIS_LIMITS, NORM_LIMITS, Limits

if TYPE_CHECKING:
    from hzmp_tracking.trajectory import Trajectory

FORMAT = "hzmp trajectory 1"
_PIECES = ("breakpoints", "coefficients", "piece_cells")
_BROKEN = (KeyError, TypeError, ValueError, AttributeError, EOFError, zipfile.BadZipFile)


def to_json(trajectory: Trajectory, indent: int | None = None) -> str:
    """One JSON object; coefficients are in ascending powers of local time."""
    pieces = {name: getattr(trajectory, name).tolist() for name in _PIECES}
    return json.dumps(_header(trajectory) | pieces, indent=indent, allow_nan=False)


def fields_from_json(text: str) -> dict[str, Any]:
    """The arguments of the trajectory that `to_json` wrote.

    Raises:
        ShapeError: the text is no such trajectory.
    """
    try:
        held = json.loads(text)
        return _fields(held, {name: held[name] for name in _PIECES})
    except _BROKEN as error:
        raise ShapeError(f"not a saved trajectory: {error}") from error


def save(trajectory: Trajectory, path: str | PathLike[str]) -> None:
    """Write .json, .npz or .parquet; nothing is left behind when writing fails.

    Raises:
        QueryError: another suffix.
    """
    kind = _kind(path)
    with written_whole(path) as partial:
        if kind == ".json":
            partial.write_text(to_json(trajectory, indent=1), encoding="utf-8")
        elif kind == ".npz":
            arrays = {name: getattr(trajectory, name) for name in _PIECES}
            with partial.open("wb") as file:
                np.savez_compressed(file, header=json.dumps(_header(trajectory)), **arrays)
        else:
            _write_table(trajectory, partial)


def load_fields(path: str | PathLike[str]) -> dict[str, Any]:
    """The arguments of a saved trajectory.

    Raises:
        OSError: the file cannot be read.
        QueryError: another suffix.
        ShapeError: it is not a saved trajectory.
    """
    kind, content = _kind(path), Path(path).read_bytes()
    try:
        if kind == ".json":
            return fields_from_json(content.decode("utf-8"))
        if kind == ".npz":
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                return _fields(json.loads(str(file["header"])), {k: file[k] for k in _PIECES})
        return _read_table(path)
    except _BROKEN as error:
        raise ShapeError(f"{path} is not a saved trajectory: {error}") from error


def _kind(path: str | PathLike[str]) -> str:
    kind = Path(path).suffix.lower()
    if kind not in (".json", ".npz", ".parquet"):
        raise QueryError(f"{path} does not end in .json, .npz or .parquet")
    return kind


def _header(trajectory: Trajectory) -> dict[str, Any]:
    """Everything but the pieces, as JSON values."""
    bounds = trajectory.limits
    limits = {name: np.asarray(getattr(bounds, name)).tolist() for name in AXIS_LIMITS}
    limits |= {name: getattr(bounds, name) for name in NORM_LIMITS}
    cells = [{"A": cell.A.tolist(), "b": cell.b.tolist()} for cell in trajectory.cells]
    waypoints = trajectory.waypoints.tolist()
    return {"format": FORMAT, "limits": limits, "cells": cells, "waypoints": waypoints}


def _fields(header: dict[str, Any], pieces: dict[str, Any]) -> dict[str, Any]:
    if header["format"] != FORMAT:
        raise ShapeError(f"format {header['format']!r}, expected {FORMAT!r}")
    cells = [Polytope.from_halfspaces(cell["A"], cell["b"]) for cell in header["cells"]]
    return {
        "breakpoints": np.array(pieces["breakpoints"], dtype=np.float64),
        "coefficients": np.array(pieces["coefficients"], dtype=np.float64),
        "piece_cells": np.array(pieces["piece_cells"], dtype=np.int64),
        "cells": tuple(cells),
        "waypoints": np.array(header["waypoints"], dtype=np.float64),
        # Files from before norms were bounded do not name them.
        "limits": Limits(
            **{name: header["limits"][name] for name in AXIS_LIMITS},
            **{name: header["limits"].get(name) for name in NORM_LIMITS},
        ),
    }


def _write_table(trajectory: Trajectory, path: Path) -> None:
    """One row a piece: start_s, end_s, cell, and a column for each axis and power, such as x_2."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    times, n = trajectory.breakpoints, trajectory.n
    columns = {"start_s": times[:-1], "end_s": times[1:], "cell": trajectory.piece_cells}
    for axis, name in enumerate("xyz"[:n]):
        for power in range(4):
            columns[f"{name}_{power}"] = trajectory.coefficients[:, power, axis]
    arrays = [pa.array(values) for values in columns.values()]
    fields = [pa.field(name, array.type) for name, array in zip(columns, arrays, strict=True)]
    header = {"hzmp_tracking": json.dumps(_header(trajectory))}
    table = pa.Table.from_arrays(arrays, schema=pa.schema(fields, header))
    pq.write_table(table, path, compression="zstd")


def _read_table(path: str | PathLike[str]) -> dict[str, Any]:
    import pyarrow.parquet as pq

    table = pq.read_table(Path(path))
    header = json.loads((table.schema.metadata or {})[b"hzmp_tracking"])
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    axes = "xyz"[: (len(columns) - 3) // 4]
    coefficients = [[columns[f"{axis}_{power}"] for axis in axes] for power in range(4)]
    pieces = {
        "breakpoints": np.append(columns["start_s"], columns["end_s"][-1:]),
        "coefficients": np.moveaxis(np.array(coefficients), 2, 0),
        "piece_cells": columns["cell"],
    }
    return _fields(header, pieces)
