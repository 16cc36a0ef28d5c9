"""Video, report and the whole directory of a run, read back with tools that did not write them."""

from __future__ import annotations

import dataclasses
import json
import re
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import imageio_ffmpeg
import mujoco
import numpy as np
import pytest

from hzmp_planners.planning import PlanStatus
from hzmp_sim.output import opengl
from hzmp_sim.output.figures import write_figures
from hzmp_sim.output.report import write_report
from hzmp_sim.output.video import VideoError, frame_count, playback_speed, render_frame, write_video
from hzmp_sim.output.write import write_run
from hzmp_sim.run import Run


@pytest.mark.render
def test_video_has_the_promised_frames_and_shows_the_flight(room_run: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.mp4"
    seen: list[float] = []
    count = write_video(room_run, path, width=320, height=240, progress=seen.append)
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-i", str(path)]
    raw = subprocess.run(
        [*command, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True
    ).stdout
    frames = np.frombuffer(raw, np.uint8).reshape(-1, 240, 640, 3)  # two views
    assert len(frames) == count == frame_count(room_run) == len(seen)
    assert frames.std(axis=(1, 2, 3)).min() > 10.0  # a picture, not one colour
    assert np.abs(frames[0].astype(int) - frames[-1]).max() > 50  # something moved
    assert path.read_bytes().index(b"moov") < path.read_bytes().index(b"mdat")  # faststart


@pytest.mark.render
def test_picture_shows_the_goal_marker(room_run: Run) -> None:
    picture = render_frame(room_run, width=320, height=240)
    assert picture.shape == (240, 320, 3)
    assert picture.std() > 10.0


def test_long_flights_are_shown_faster(room_run: Run) -> None:
    log = room_run.log
    assert log is not None
    assert playback_speed(room_run) == 1.0
    long = dataclasses.replace(log, time=log.time * 60.0)
    slow = Run(
        room_run.scene, room_run.space, room_run.plan, room_run.trajectory, long, room_run.metrics
    )
    assert playback_speed(slow) == pytest.approx(np.ptp(long.time) / 20.0)
    assert frame_count(slow) == 501


def test_a_run_without_a_flight_has_no_video(closed_run: Run, tmp_path: Path) -> None:
    with pytest.raises(VideoError, match="not flown"):
        write_video(closed_run, tmp_path / "run.mp4")


class Page(HTMLParser):
    """Text, addresses, and balance of the tags of a page."""

    VOID = frozenset({"meta", "img", "link", "br", "hr", "input"})

    def __init__(self, html: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.addresses: list[str] = []
        self.open: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.addresses += [
            value or "" for name, value in attrs if name in ("src", "href", "poster")
        ]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", "".join(self.words))


def test_report_is_self_contained_and_holds_the_numbers(yard_run: Run, tmp_path: Path) -> None:
    figures = write_figures(yard_run, tmp_path)
    assert [path.stem for path in figures] == ["path", "search", "trajectory", "flight"]
    film = tmp_path / "run.mp4"
    film.write_bytes(b"not a film")
    path = tmp_path / "report.html"
    write_report(yard_run, path, figures=figures, video=film, command="hzmp-sim run <x> --seed 7")
    html = path.read_text()
    page = Page(html)
    assert page.open == []
    assert len(page.addresses) == 5
    assert all(address.startswith("data:") for address in page.addresses)
    assert not re.search(r"https?://|@import|url\(", html)
    for said in (
        "Goal reached",
        "0.0712",
        f"{yard_run.plan.cost:.4g}",
        f"{yard_run.plan.lower_bound:.4g}",
        "hzmp-sim run <x> --seed 7",
        "Seed 7",
        "12.3",
        mujoco.__version__,
        "chip",
    ):
        assert said in page.text  # fmt: skip


def test_report_of_an_infeasible_run_gives_the_reason(closed_run: Run, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    write_report(closed_run, path, figures=write_figures(closed_run, tmp_path), note="no <OpenGL>")
    page = Page(path.read_text())
    assert page.open == []
    assert "Proved infeasible" in page.text
    assert PlanStatus.INFEASIBLE.value[8:] in page.text
    assert "no <OpenGL>" in page.text  # escaped, not a tag
    assert "Goal reached" not in page.text


@pytest.mark.render
def test_run_directory_is_complete(room_run: Run, tmp_path: Path) -> None:
    out = tmp_path / "runs" / "x"
    assert write_run(room_run, out, command="hzmp-sim run enclosure") == ""
    names = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert names == {
        "metrics.json", "trajectory.parquet", "run.rrd", "run.mp4", "report.html", "scene.xml",
        "figures/path.png", "figures/search.png", "figures/trajectory.png", "figures/flight.png",
    }  # fmt: skip
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics == room_run.metrics
    assert metrics["timings_s"]["record"] > 0.0
    assert metrics["video"] == "run.mp4"
    again = mujoco.MjModel.from_xml_string((out / "scene.xml").read_text())
    assert again.ngeom == room_run.scene.model.ngeom
    assert [path.name for path in out.parent.iterdir()] == ["x"]


def test_an_infeasible_run_has_its_directory_too(closed_run: Run, tmp_path: Path) -> None:
    assert write_run(closed_run, tmp_path / "x", video=False) == "nothing was flown"
    names = {path.name for path in (tmp_path / "x").iterdir()}
    assert names == {"metrics.json", "run.rrd", "report.html", "scene.xml", "figures"}


def test_without_opengl_everything_but_the_video_is_there(
    room_run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "off")
    opengl.backend.cache_clear()
    try:
        missing = write_run(room_run, tmp_path / "x")
    finally:
        opengl.backend.cache_clear()
    assert "MUJOCO_GL" in missing
    names = {path.name for path in (tmp_path / "x").iterdir()}
    assert "run.mp4" not in names
    assert {"metrics.json", "run.rrd", "report.html", "trajectory.parquet"} <= names
    assert "No video" in Page((tmp_path / "x" / "report.html").read_text()).text
