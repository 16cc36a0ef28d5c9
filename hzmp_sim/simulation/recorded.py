"""A run directory as what it records: the scene, and the way the body flew."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import QueryError
from hzmp_sim.motion.reading import read_motion
from hzmp_sim.motion.script import MotionScript
from hzmp_sim.scene import Scene, load_scene
from hzmp_sim.simulation.motion import Motion


def read_run(directory: str | Path) -> tuple[Scene, Motion]:
    """The scene that was flown, read as it was then, and the poses of the flight.

    Raises:
        QueryError: no run directory, one without a flight, or with files that are not of a run.
        SceneError: its world cannot be read.
    """
    folder = Path(directory)
    metrics = _metrics(folder)
    try:
        query, body, status = metrics["query"], metrics["body"], metrics["status"]
        names = ("start", "goal", "clearance", "tolerance", "shape", "max_tilt")
        corners, arguments = query["workspace"], {name: query[name] for name in names}
    except (KeyError, TypeError) as error:
        raise QueryError(
            f"{folder}/metrics.json does not say {error}: it is not of a run of this version; "
            "run it again"
        ) from error
    if not (folder / "trajectory.parquet").is_file():
        raise QueryError(f"{folder}: nothing was flown ({status}), so there is nothing to audit")
    script = folder / "motion.toml"
    motion = read_motion(script) if script.is_file() else MotionScript()
    scene = load_scene(
        folder / "scene.xml", body, motion=motion, workspace=tuple(corners), **arguments
    )
    return scene, _motion(folder / "trajectory.parquet")


def _metrics(folder: Path) -> dict[str, Any]:
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "does not exist"
        raise QueryError(f"{folder} {what}; give the directory of a run (hzmp-sim run --out DIR)")
    try:
        found = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise QueryError(
            f"{folder} has no metrics.json, so it is no finished run; give the directory of a run "
            "(hzmp-sim run --out DIR)"
        ) from error
    except (OSError, ValueError) as error:
        raise QueryError(f"{folder}/metrics.json cannot be read: {error}") from error
    if not isinstance(found, dict):
        raise QueryError(f"{folder}/metrics.json does not hold the metrics of a run")
    return found


def _world(table: pa.Table) -> tuple[Floats, Floats]:
    qpos = np.array(table.column("qpos").to_pylist())
    if "mocap" not in table.column_names:  # joints alone move this world
        return qpos, np.zeros((len(qpos), 0, 7))
    return qpos, np.array(table.column("mocap").to_pylist()).reshape(len(qpos), -1, 7)


def _motion(file: Path) -> Motion:
    def columns(*names: str) -> Floats:
        values = [table.column(name).to_numpy() for name in names]
        return np.column_stack(values).astype(np.float64)

    try:
        table = pq.read_table(file)
        motion = Motion(
            progress=columns("time_s")[:, 0],
            unit="s",
            position=columns("x_m", "y_m", "z_m"),
            quaternion=columns("qw", "qx", "qy", "qz"),
            error=columns("tracking_error_m")[:, 0],
            world=_world(table) if "qpos" in table.column_names else None,
        )
    except (OSError, KeyError, ValueError) as error:  # Arrow's own errors are ValueErrors
        raise QueryError(f"{file} is not the log of a flight: {error}") from error
    if not len(motion.progress) or not np.isfinite(motion.position).all():
        raise QueryError(f"{file} is not the log of a flight: no rows, or not finite")
    return motion
