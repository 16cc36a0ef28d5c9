"""The flight log as a Parquet table, one row a physics step."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import hzmp_sim  # the module: its version is only there once it is fully imported

if TYPE_CHECKING:
    from hzmp_planners._arrays import Floats
    from hzmp_sim.run import FlightLog
    from hzmp_sim.scene import Scene

_UNITS = (("_m_s", "m/s"), ("_m", "m"), ("_s", "s"))


def write_log(log: FlightLog, scene: Scene, path: Path) -> None:
    """Write `log` to `path` (trajectory.parquet).

    Columns: time_s; x_m y_m z_m; qw qx qy qz (wxyz); vx_m_s ...; reference_x_m ...;
    tracking_error_m; clearance_m (null without obstacles); nearest_geom and contact_geom (names,
    null if none); collision; ctrl_0 ... in the units of the actuators; where something moves, qpos
    of the whole model and, if there are mocap bodies, mocap (x y z, quaternion wxyz of each).
    Units are in the metadata.
    """
    columns: dict[str, pa.Array] = {"time_s": pa.array(log.time)}
    columns |= _components(log.position, "xyz", "{}_m")
    columns |= _components(log.quaternion, "wxyz", "q{}")
    columns |= _components(log.velocity, "xyz", "v{}_m_s")
    columns |= _components(log.reference, "xyz", "reference_{}_m")
    columns["tracking_error_m"] = pa.array(log.tracking_error)
    columns["clearance_m"] = pa.array(log.clearance, mask=~np.isfinite(log.clearance))
    names = pa.array([scene.geom_name(geom) for geom in range(scene.model.ngeom)], type=pa.string())
    for column, geoms in (("nearest_geom", log.nearest), ("contact_geom", log.contact)):
        index = pa.array(geoms.astype(np.int32), mask=geoms < 0)
        columns[column] = pa.DictionaryArray.from_arrays(index, names)
    columns["collision"] = pa.array(log.collision)
    columns |= {f"ctrl_{i}": pa.array(log.control[:, i]) for i in range(log.control.shape[1])}
    if scene.moving:
        columns["qpos"] = _lists(log.qpos)
    if scene.moving and log.mocap.size:
        columns["mocap"] = _lists(log.mocap.reshape(len(log.time), -1))
    fields = [pa.field(name, values.type, metadata=_unit(name)) for name, values in columns.items()]
    metadata = {
        "hzmp_sim.version": hzmp_sim.__version__,
        "hzmp_sim.body": scene.body,
        "hzmp_sim.frame": "world, right-handed, z up; quaternions wxyz",
    }
    table = pa.Table.from_arrays(list(columns.values()), schema=pa.schema(fields, metadata))
    pq.write_table(table, path, compression="zstd")


def _components(values: Floats, axes: str, form: str) -> dict[str, pa.Array]:
    return {form.format(axis): pa.array(values[:, i]) for i, axis in enumerate(axes)}


def _lists(rows: Floats) -> pa.Array:
    """A column of which each entry is a row (k,) of an array (T, k)."""
    return pa.FixedSizeListArray.from_arrays(pa.array(rows.ravel()), rows.shape[1])


def _unit(name: str) -> dict[str, str] | None:
    return next(({"unit": unit} for end, unit in _UNITS if name.endswith(end)), None)
