"""One self-contained HTML report of a run."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
import matplotlib.image

import hzmp_sim  # the module: its version is only there once it is fully imported
from hzmp_sim.output.claims import claims
from hzmp_sim.output.headline import Figure, headline_figures, number, percent, verdict
from hzmp_sim.output.plans import plan_rows, reason_rows
from hzmp_sim.output.video import playback_speed

if TYPE_CHECKING:
    from hzmp_sim.output.opengl import Image
    from hzmp_sim.run import Run

_MOST_PLANS = 60
"""Lines of the table of what was planned in flight."""

_CAPTIONS = {
    "path": "Path among the obstacles.",
    "search": "Search: length of the best path and proved lower bound; the band is the gap.",
    "trajectory": "Reference trajectory; limits dashed.",
    "flight": "Measured clearance and tracking error.",
    "replanning": "Above: path to the goal as planned in flight, and its lower bound; gaps where "
    "no way was open; red while nothing proved was flown. Below: time that each plan took to "
    "compute on this machine; it took effect in simulated time after what is dashed.",
}


def write_report(
    run: Run,
    path: Path,
    *,
    figures: Sequence[Path] = (),
    video: Path | None = None,
    picture: Image | None = None,
    note: str = "",
    command: str = "",
) -> None:
    """Write report.html: nothing in it is fetched from elsewhere.

    Args:
        run: what to report on.
        path: file to write.
        figures: PNG files of `write_figures`; each is put in its section.
        video: MP4 file to embed.
        picture: still picture (h, w, 3), shown before the video plays or in its place.
        note: why there is no video.
        command: how to make this run again.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("hzmp_sim.output"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    speed = playback_speed(run)
    plans = [] if run.flight_plan is None else plan_rows(run.flight_plan)
    page = environment.get_template("report.html.j2").render(
        title=run.scene.path.parent.name or run.scene.path.stem,
        scene=run.scene,
        warnings=run.metrics.get("warnings", run.scene.warnings),
        verdict=verdict(run),
        headline=headline_figures(run),
        claims=claims(run),
        figures={
            file.stem: (_data_uri("image/png", file.read_bytes()), _CAPTIONS.get(file.stem, ""))
            for file in figures
        },
        video=None if video is None else _data_uri("video/mp4", video.read_bytes()),
        speed=f"{speed:.3g} times real time" if speed > 1.0 else "real time",
        picture=None if picture is None else _png(picture),
        note=note,
        command=command,
        plan_table=_plan_table(run),
        flight_table=_flight_table(run),
        contacts=run.metrics.get("contacts") or {},
        reasons=[] if run.flight_plan is None else reason_rows(run.flight_plan),
        plans=plans[:_MOST_PLANS],
        plans_left_out=max(0, len(plans) - _MOST_PLANS),
        planned=run.metrics if run.flight_plan is not None else None,
        timings=_timings(run.metrics.get("timings_s") or {}),
        versions=run.metrics.get("versions") or {},
        seed=run.metrics.get("seed"),
        version=hzmp_sim.__version__,
    )
    path.write_text(page, encoding="utf-8")


def _plan_table(run: Run) -> list[Figure]:
    m, plan = run.metrics, run.plan
    rows = [
        Figure("Verdict of the planner", plan.status.name, plan.status.value),
        Figure("Obstacles", f"{m.get('obstacles', len(run.scene.obstacles))}"),
        Figure("Leaves", f"{m.get('leaves', len(run.space))}", "convex, interiors disjoint"),
        Figure("Shared faces", f"{m.get('faces', len(run.space.graph))}"),
    ]
    if len(plan.waypoints):
        first = next(seconds for seconds, cost, _ in plan.history if cost < float("inf"))
        rows += [
            Figure("Path length", number(plan.cost), "m"),
            Figure("Lower bound", number(plan.lower_bound), "m"),
            Figure("Optimality gap", percent(plan.gap), "%"),
            Figure("Segments", f"{len(plan.leaves)}"),
            Figure("First path after", f"{1e3 * first:.2f}", "ms"),
        ]
    return rows


def _flight_table(run: Run) -> list[Figure]:
    m = run.metrics
    latency = m.get("replan_latency_ms") or {}
    rows = [
        ("Trajectory duration", m.get("trajectory_duration_s"), "s"),
        ("Containment", m.get("containment_m"), "m"),
        ("Smallest clearance", m.get("min_clearance_m"), "m"),
        ("Tracking error, largest", m.get("tracking_error_max_m"), "m"),
        ("Tracking error, rms", m.get("tracking_error_rms_m"), "m"),
        ("Off by more than the clearance for", m.get("beyond_clearance_s"), "s"),
        ("Collision steps", m.get("collision_steps"), ""),
        ("Simulation speed", m.get("realtime_factor"), "times real time"),
        ("Replans", m.get("replans"), ""),
        ("Replan latency, median", latency.get("median"), "ms"),
        ("Replan latency, largest", latency.get("max"), "ms"),
    ]
    return [Figure(name, number(value), unit) for name, value, unit in rows if value is not None]


def _timings(timings: dict[str, Any]) -> list[tuple[str, str, float]]:
    """Stage, time, and share of the longest stage in percent."""
    known = {name: float(value) for name, value in timings.items() if value is not None}
    longest = max(known.values(), default=0.0) or 1.0
    return [
        (name.replace("_", " "), f"{1e3 * s:.1f}", 100 * s / longest) for name, s in known.items()
    ]


def _data_uri(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def _png(picture: Image) -> str:
    buffer = io.BytesIO()
    matplotlib.image.imsave(buffer, picture, format="png")
    return _data_uri("image/png", buffer.getvalue())
