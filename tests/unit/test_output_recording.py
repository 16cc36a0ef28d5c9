"""The recording and the log of a run, read back."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from rerun.chunk import RrdReader

from hzmp_sim.output.parquet import write_log
from hzmp_sim.output.recording import pose_rows, write_recording
from hzmp_sim.run import Run
from recordings import recorded, verify_recording


def test_recording_of_a_flight_in_space(yard_run: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    write_recording(yard_run, path)
    verify_recording(path)
    chunks = list(RrdReader(path).stream())
    entities = {chunk.entity_path for chunk in chunks}
    shapes = {"boxes", "spheres", "ellipsoids", "cylinders", "capsules", "ground", "chip"}
    assert {f"/world/{shape}" for shape in shapes} <= entities
    assert {"/bodies/drone/boxes", "/space/leaves", "/space/faces", "/summary"} <= entities
    assert {"/plan/path", "/plan/samples", "/trajectory/reference", "/plan/cost"} <= entities
    timelines = {
        name
        for chunk in chunks
        for name in chunk.to_record_batch().schema.names
        if name in ("log_tick", "log_time", "sim_time", "plan_time")
    }
    assert timelines == {"sim_time", "plan_time"}

    log = yard_run.log
    assert log is not None
    rows = pose_rows(log.time)
    moved = recorded(path, "/bodies/drone", "Transform3D:translation")
    np.testing.assert_allclose(np.array(moved).reshape(-1, 3), log.position[rows], atol=1e-6)
    turned = np.array(recorded(path, "/bodies/drone", "Transform3D:quaternion")).reshape(-1, 4)
    np.testing.assert_allclose(turned, np.roll(log.quaternion[rows], -1, axis=1), atol=1e-6)
    clearance = np.array(recorded(path, "/flight/clearance", "Scalars:scalars")).ravel()
    np.testing.assert_array_equal(clearance, log.clearance)
    sets = recorded(path, "/plan/informed_sets", "Ellipsoids3D:half_sizes")
    assert len(sets) == len(yard_run.plan.informed)


def test_recording_of_a_planar_flight_lies_at_the_height_of_the_body(
    room_run: Run, tmp_path: Path
) -> None:
    path = tmp_path / "run.rrd"
    write_recording(room_run, path)
    verify_recording(path)
    (strips,) = recorded(path, "/plan/path", "LineStrips3D:strips")
    way = np.array(strips[0])
    np.testing.assert_allclose(way[:, :2], room_run.plan.waypoints, atol=1e-5)
    assert room_run.scene.height is not None
    np.testing.assert_allclose(way[:, 2], room_run.scene.height, atol=1e-6)
    cells = np.array(recorded(path, "/space/cells", "Mesh3D:vertex_positions")[0])
    assert len(cells) == sum(len(leaf.vertices()) for leaf in room_run.space.leaves)


def test_recording_without_a_flight(closed_run: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    write_recording(closed_run, path)
    verify_recording(path)
    entities = {chunk.entity_path for chunk in RrdReader(path).stream()}
    assert "/space/leaves" in entities
    assert not any(entity.startswith("/flight") for entity in entities)


def test_poses_are_recorded_at_most_a_hundred_times_a_second() -> None:
    rows = pose_rows(np.arange(0.0, 2.0, 0.002))
    assert rows[0] == 0
    assert rows[-1] == 999
    assert set(np.diff(rows)[:-1]) == {5}


def test_parquet_round_trip(yard_run: Run, tmp_path: Path) -> None:
    log, path = yard_run.log, tmp_path / "trajectory.parquet"
    assert log is not None
    write_log(log, yard_run.scene, path)
    table = pq.read_table(path)
    assert table.num_rows == len(log.time)
    for i, name in enumerate(("x_m", "y_m", "z_m")):
        np.testing.assert_array_equal(table.column(name).to_numpy(), log.position[:, i])
    np.testing.assert_array_equal(table.column("qw").to_numpy(), log.quaternion[:, 0])
    np.testing.assert_array_equal(table.column("vy_m_s").to_numpy(), log.velocity[:, 1])
    np.testing.assert_allclose(table.column("tracking_error_m").to_numpy(), 0.005)
    names = [yard_run.scene.geom_name(int(geom)) for geom in log.nearest]
    assert table.column("nearest_geom").to_pylist() == names
    assert table.column("collision").to_pylist() == log.collision.tolist()
    hit = yard_run.scene.geom_name(yard_run.scene.obstacle_geoms[0])
    contacts = [hit if row else None for row in log.collision]
    assert table.column("contact_geom").to_pylist() == contacts
    assert "ctrl_1" in table.column_names
    assert table.schema.field("vx_m_s").metadata == {b"unit": b"m/s"}
    assert table.schema.field("clearance_m").metadata == {b"unit": b"m"}


def test_parquet_says_null_where_there_is_no_obstacle(yard_run: Run, tmp_path: Path) -> None:
    log = yard_run.log
    assert log is not None
    none = np.full(len(log.time), -1)
    infinite = np.full(len(log.time), np.inf)
    alone = dataclasses.replace(log, clearance=infinite, nearest=none)
    write_log(alone, yard_run.scene, tmp_path / "log.parquet")
    table = pq.read_table(tmp_path / "log.parquet", columns=["clearance_m", "nearest_geom"])
    assert set(table.column("clearance_m").to_pylist()) == {None}
    assert set(table.column("nearest_geom").to_pylist()) == {None}
