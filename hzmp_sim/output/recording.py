"""The run as a rerun recording (.rrd), with a blueprint that lays the views out.

Entities: `world` (geoms that do not move), `bodies/<name>` (geoms of each moving body under its
transform), `space` (leaves, shared faces, grown obstacles), `plan`, `trajectory`, `flight`
(scalars), `replanning` (paths, reasons; latency, cost and bound of each) and `summary`. Timelines:
`sim_time` for the flight, `plan_time` for the search.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np
import rerun as rr

from hzmp_sim.output import palette
from hzmp_sim.output.blueprint import PLAN_TIME, SIM_TIME, blueprint
from hzmp_sim.output.headline import informed_times, summary_markdown
from hzmp_sim.output.poses import pose_at
from hzmp_sim.output.recorded_geoms import body_entity, log_world, xyzw
from hzmp_sim.output.recorded_space import line_radius, log_ends, log_space, log_strips

if TYPE_CHECKING:
    from hzmp_planners._arrays import Floats, Ints
    from hzmp_sim.replanning import FlightPlan
    from hzmp_sim.run import FlightLog, Run

POSE_RATE_HZ = 100.0
"""Poses of bodies are recorded at most this often [Hz]."""
_TRAJECTORY_POINTS = 600


def write_recording(run: Run, path: Path) -> None:
    """Write everything known about `run` to `path` (run.rrd); needs neither viewer nor network."""
    recording = rr.RecordingStream("hzmp_sim", recording_id=run.scene.path.as_posix())
    recording.set_log_tick_enabled(False)  # only our timelines: recordings are reproducible
    recording.set_log_time_enabled(False)
    recording.save(path, default_blueprint=blueprint(run))
    recording.send_recording_name(run.scene.path.parent.name or run.scene.path.stem)
    line = line_radius(run.scene)
    log_world(recording, run.scene, moving=run.log is not None)
    log_space(recording, run.scene, run.space, line, explode=False)
    _log_plan(recording, run, line)
    if run.log is not None:
        _log_flight(recording, run, run.log, line)
    document = rr.TextDocument(summary_markdown(run), media_type=rr.MediaType.MARKDOWN)
    recording.log("summary", document, static=True)
    recording.flush()
    recording.disconnect()


def _log_plan(recording: rr.RecordingStream, run: Run, line: float) -> None:
    scene, plan = run.scene, run.plan
    log_ends(recording, scene, line)
    if len(plan.samples):
        points = rr.Points3D(
            scene.to_world(plan.samples), colors=[palette.rgba8(palette.SAMPLE)], radii=line
        )
        recording.log("plan/samples", points, static=True)
    if len(plan.waypoints):
        log_strips(recording, "plan/path", [scene.to_world(plan.waypoints)], palette.PATH, 2 * line)
    recording.reset_time()
    for seconds, informed in zip(informed_times(plan), plan.informed, strict=True):
        recording.set_time(PLAN_TIME, duration=seconds)
        recording.log("plan/informed_sets", _ellipsotope(run, informed.c, informed.G, line))
    recording.reset_time()
    if plan.informed:
        last = plan.informed[-1]
        recording.log("plan/informed_set", _ellipsotope(run, last.c, last.G, line), static=True)
    series = (("cost", 1, palette.PATH), ("lower_bound", 2, palette.BOUND))
    for name, column, colour in series:
        values = np.array([row[column] for row in plan.history], dtype=np.float64)
        known = np.isfinite(values)
        times = np.array([row[0] for row in plan.history], dtype=np.float64)[known]
        _scalars(
            recording, f"plan/{name}", PLAN_TIME, times, values[known], [f"{name} [m]"], [colour]
        )


def _log_flight(recording: rr.RecordingStream, run: Run, log: FlightLog, line: float) -> None:
    scene = run.scene
    if run.trajectory is not None:
        times = np.linspace(0.0, run.trajectory.duration, _TRAJECTORY_POINTS)
        way = scene.to_world(run.trajectory.sample(times).position)
        log_strips(recording, "trajectory/reference", [way], palette.BOUND, line)
    every = max(1, len(log.time) // _TRAJECTORY_POINTS)
    flown = np.vstack([log.position[::every], log.position[-1:]])
    log_strips(recording, "trajectory/flown", [flown], palette.FLOWN, line)
    speed = np.linalg.norm(log.velocity, axis=1)
    clear = np.isfinite(log.clearance)
    for name, rows, values, unit, colour in (
        ("clearance", clear, log.clearance, "m", palette.BOUND),
        ("tracking_error", slice(None), log.tracking_error, "m", palette.FLOWN),
        ("speed", slice(None), speed, "m/s", palette.PATH),
    ):
        label = f"{name.replace('_', ' ')} [{unit}]"
        _scalars(
            recording, f"flight/{name}", SIM_TIME, log.time[rows], values[rows], [label], [colour]
        )
    if log.control.shape[1]:
        names = [f"control {i}" for i in range(log.control.shape[1])]
        _scalars(recording, "flight/control", SIM_TIME, log.time, log.control, names, None)
    _log_poses(recording, run, log)
    if run.flight_plan is not None:
        _log_plans(recording, run, run.flight_plan, line)


def _log_plans(recording: rr.RecordingStream, run: Run, planned: FlightPlan, line: float) -> None:
    """Each decision from when it takes effect: the path to the goal, and why it was made."""
    for record in planned.records:
        recording.set_time(SIM_TIME, duration=record.effect)
        if len(record.waypoints):
            way = run.scene.to_world(record.waypoints)
            log_strips(recording, "replanning/path", [way], palette.PATH, line, static=False)
        else:
            recording.log("replanning/path", rr.Clear(recursive=False))
        if record.taken or record.reason == "wait":
            told = f"{record.reason}; trajectory at rest at {record.ends:.2f} s"
            told += f"; {record.conflict} in the way" if record.conflict else ""
            level = rr.TextLogLevel.INFO if record.proved else rr.TextLogLevel.WARN
            recording.log("replanning/log", rr.TextLog(told, level=level))
    recording.reset_time()
    times = np.array([record.effect for record in planned.records])
    found = np.isfinite([record.cost for record in planned.records])
    for name, rows, values, unit, colour in (
        ("latency", slice(None), [1e3 * r.latency for r in planned.records], "ms", palette.INK),
        ("cost", found, [r.cost for r in planned.records], "m", palette.PATH),
        ("lower_bound", found, [r.lower_bound for r in planned.records], "m", palette.BOUND),
    ):
        label = f"{name.replace('_', ' ')} [{unit}]"
        _scalars(
            recording, f"replanning/{name}", SIM_TIME, times[rows], np.array(values)[rows],
            [label], [colour],
        )  # fmt: skip


def _log_poses(recording: rr.RecordingStream, run: Run, log: FlightLog) -> None:
    """Transforms of all moving bodies that carry geoms, at most POSE_RATE_HZ."""
    model = run.scene.model
    rows = pose_rows(log.time)
    carriers = {int(body) for body in model.geom_bodyid if model.body_weldid[body] != 0}
    bodies = np.array(sorted(carriers), dtype=np.int64)
    positions, quaternions = (
        np.empty((len(rows), len(bodies), 3)),
        np.empty((len(rows), len(bodies), 4)),
    )
    data = mujoco.MjData(model)
    for i, row in enumerate(rows):
        pose_at(log, int(row), data)
        mujoco.mj_kinematics(model, data)
        positions[i], quaternions[i] = data.xpos[bodies], data.xquat[bodies]
    for k, body in enumerate(bodies):
        recording.send_columns(
            body_entity(model, int(body)),
            indexes=[rr.TimeColumn(SIM_TIME, duration=log.time[rows])],
            columns=rr.Transform3D.columns(
                translation=positions[:, k], quaternion=xyzw(quaternions[:, k])
            ),
        )


def pose_rows(times: Floats) -> Ints:
    """Rows of a log, at least 1 / POSE_RATE_HZ apart, with the first and the last."""
    if len(times) < 2:
        return np.arange(len(times))
    every = max(1, round(1.0 / POSE_RATE_HZ / float(times[1] - times[0])))
    return np.unique(np.append(np.arange(0, len(times), every), len(times) - 1))


def _ellipsotope(run: Run, c: Floats, G: Floats, line: float) -> rr.AsComponents:
    colour = palette.rgba8(palette.INFORMED)
    if run.scene.n == 2:
        angle = np.linspace(0.0, 2.0 * np.pi, 121)
        ring = c + np.column_stack([np.cos(angle), np.sin(angle)]) @ G.T
        return rr.LineStrips3D([run.scene.to_world(ring)], colors=[colour], radii=line)
    axes, lengths, _ = np.linalg.svd(G)
    axes[:, 2] *= np.linalg.det(axes)  # a rotation, not a reflection
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(axes).ravel())
    return rr.Ellipsoids3D(
        centers=[c],
        half_sizes=[lengths],
        quaternions=[rr.Quaternion(xyzw=xyzw(quaternion))],
        colors=[colour],
        line_radii=line / 2,
        fill_mode="majorwireframe",
    )


def _scalars(
    recording: rr.RecordingStream,
    entity: str,
    timeline: str,
    times: Floats,
    values: Floats,
    names: list[str],
    colours: list[str] | None,
) -> None:
    if not len(times):
        return
    colors = None if colours is None else [palette.rgba8(colour) for colour in colours]
    recording.log(entity, rr.SeriesLines(names=names, colors=colors), static=True)
    recording.send_columns(
        entity,
        indexes=[rr.TimeColumn(timeline, duration=times)],
        columns=rr.Scalars.columns(scalars=values),
    )
