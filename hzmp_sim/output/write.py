"""All artefacts of a run, written in one go."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hzmp_sim.motion.writing import motion_text
from hzmp_sim.output.artifacts import RunDirectory
from hzmp_sim.output.figures import write_figures
from hzmp_sim.output.opengl import Image, RenderingUnavailable
from hzmp_sim.output.parquet import write_log
from hzmp_sim.output.plans import write_plans
from hzmp_sim.output.recording import write_recording
from hzmp_sim.output.report import write_report
from hzmp_sim.output.video import frame_count, render_frame, write_video
from hzmp_sim.progress import busy, progress

if TYPE_CHECKING:
    from hzmp_sim.run import Run


def write_run(run: Run, directory: str | Path, *, video: bool = True, command: str = "") -> str:
    """Write the run directory; returns why there is no video, or "" when there is one.

    metrics.json holds `run.metrics`, in which this sets `timings_s.record`, the time [s] it took
    to write the rest, and `video`: "run.mp4" or why there is none. Without OpenGL everything but
    the video and the picture is written.

    Args:
        run: a finished run.
        directory: the run directory; an older run in it is replaced as a whole.
        video: whether to render (the slowest artefact).
        command: for the report: how to make this run again.

    Raises:
        OutputError: the directory cannot be written.
        VideoError: the encoder failed.
    """
    begin = time.perf_counter()
    with RunDirectory(directory) as files:
        files.path("scene.xml").write_text(run.scene.xml, encoding="utf-8")
        if run.scene.motion is not None:
            seconds = 0.0 if run.log is None else float(run.log.time[-1])
            text = motion_text(run.scene.motion, seconds)
            files.path("motion.toml").write_text(text, encoding="utf-8")
        if run.flight_plan is not None:
            write_plans(run.flight_plan, files.path("plans.json"))
        with busy("Writing recording and figures"):
            write_recording(run, files.path("run.rrd"))
            if run.log is not None:
                write_log(run.log, run.scene, files.path("trajectory.parquet"))
            figures = write_figures(run, files.path("figures/path.png").parent)
        picture: Image | None = None
        film: Path | None = None
        missing = "" if video else "it was not asked for (--no-video)"
        if run.log is None:
            missing = "nothing was flown"
        if video:
            try:
                picture = render_frame(run, _telling_row(run))
                if run.log is not None:
                    film = files.path("run.mp4")
                    with progress("Rendering", frame_count(run)) as advance:
                        write_video(run, film, progress=advance)
            except RenderingUnavailable as error:
                missing = str(error)
        run.metrics.setdefault("timings_s", {})["record"] = time.perf_counter() - begin
        run.metrics["video"] = missing or "run.mp4"
        write_report(
            run,
            files.path("report.html"),
            figures=figures,
            video=film,
            picture=picture,
            note=missing,
            command=command,
        )
        files.write_metrics(run.metrics)
    return missing


def _telling_row(run: Run) -> int | None:
    """The moment of least clearance: the picture that shows most. None without a flight."""
    return None if run.log is None else max(1, int(np.argmin(run.log.clearance)))
