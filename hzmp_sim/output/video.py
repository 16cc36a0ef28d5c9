"""The flight as an MP4, and still pictures of it."""

from __future__ import annotations

import copy
import itertools
import math
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, NamedTuple

import imageio_ffmpeg
import mujoco
import numpy as np

from hzmp_planners.errors import HzmpError
from hzmp_sim.output import palette
from hzmp_sim.output.framing import camera, chase_cameras, workspace_box
from hzmp_sim.output.opengl import Image, OffscreenRenderer
from hzmp_sim.output.poses import pose_at, pose_at_start
from hzmp_sim.output.scenery import hide_scenery

if TYPE_CHECKING:
    from hzmp_planners._arrays import Floats
    from hzmp_sim.run import Run

LONGEST_S = 20.0
"""A video is never longer [s]; longer flights are shown faster."""
FPS = 25.0


_MARKS = ("start", "goal")  # sites
_CHASE_LINE = 0.008  # [m] thickness of lines seen from close by


class _Quality(NamedTuple):
    """What a frame costs in software OpenGL."""

    samples: int
    """Of multisampling."""
    shadows: int
    """Texels of the shadow map along a side."""
    facets: tuple[int, int]
    """Slices and stacks of round geoms."""
    trail: int
    """Pieces of the way flown."""


# A frame of the film is 6 to 13 times cheaper than with MuJoCo's defaults (4, 4096, (28, 16)).
_FILM = _Quality(samples=0, shadows=1024, facets=(16, 8), trail=60)
_STILL = _Quality(samples=4, shadows=2048, facets=(28, 16), trail=400)


class VideoError(HzmpError, RuntimeError):
    """The video could not be encoded."""


def playback_speed(run: Run) -> float:
    """How many simulated seconds one second of video shows: 1, or as much as LONGEST_S asks for."""
    return 1.0 if run.log is None else max(1.0, float(np.ptp(run.log.time)) / LONGEST_S)


def write_video(
    run: Run,
    path: Path,
    *,
    width: int = 640,
    height: int = 480,
    fps: float = FPS,
    progress: Callable[[float], None] | None = None,
) -> int:
    """Render the flight of `run` to an H.264 MP4 at `playback_speed(run)`; returns its frames.

    Two views side by side: the whole world (the model's camera `overview`, or one that frames the
    workspace), and the body from behind. Drawn on top: the path (of a flight with the planner in
    the loop: as it was planned at that moment), the way flown so far, start and goal.

    Args:
        run: a run with a flight log.
        path: file to write.
        width: of one view, in pixels, even; a frame is twice as wide.
        height: likewise.
        fps: frames a second.
        progress: called with 1 after each frame; see `frame_count` for how many will come.

    Raises:
        RenderingUnavailable: no OpenGL on this machine.
        VideoError: the run was not flown, or the encoder failed.
    """
    if run.log is None:
        raise VideoError("a video needs a flight, but this run was not flown")
    times = np.linspace(run.log.time[0], run.log.time[-1], frame_count(run, fps))
    rows = np.searchsorted(run.log.time, times - 1e-9).clip(max=len(run.log.time) - 1)
    overview, behind = camera(run.scene, width / height), chase_cameras(run.log, rows)
    with (
        _Stage(run, width, height, _FILM) as stage,
        _Encoder(path, 2 * width, height, fps) as encoder,
    ):
        for row, chase in zip(rows.tolist(), behind, strict=True):
            views = [
                stage.render(view, row, line)
                for view, line in ((overview, stage.line), (chase, _CHASE_LINE))
            ]
            encoder.write(np.hstack(views))
            if progress is not None:
                progress(1.0)
    return len(rows)


def frame_count(run: Run, fps: float = FPS) -> int:
    """Frames of the video of a flown run."""
    if run.log is None:
        return 0
    return max(2, math.ceil(float(np.ptp(run.log.time)) / playback_speed(run) * fps) + 1)


def render_frame(run: Run, row: int | None = None, *, width: int = 960, height: int = 720) -> Image:
    """One picture, shape (height, width, 3): row `row` of the flight log, or the start when None.

    Raises:
        RenderingUnavailable: no OpenGL on this machine.
    """
    with _Stage(run, width, height, _STILL) as stage:
        return stage.render(camera(run.scene, width / height), row, stage.line)


class _Stage:
    """A run's model and overlays, ready to be rendered in any state from any camera."""

    def __init__(self, run: Run, width: int, height: int, quality: _Quality) -> None:
        self._run = run
        self._model = copy.copy(run.scene.model)  # the scene's own model stays as it is
        visual = self._model.vis
        visual.quality.shadowsize, visual.quality.offsamples = quality.shadows, quality.samples
        visual.quality.numslices, visual.quality.numstacks = quality.facets
        if self._model.nlight == 0:  # MuJoCo's own headlight alone leaves a world in the dark
            light = visual.headlight
            light.ambient[:] = np.maximum(light.ambient, 0.35)
            light.diffuse[:] = np.maximum(light.diffuse, 0.6)
        for name in _MARKS:  # what is drawn on top says where they are
            site = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_SITE.value, name)
            if site >= 0:
                self._model.site_matid[site], self._model.site_rgba[site] = -1, 0.0
        self._trail = quality.trail
        visual.global_.offwidth = max(visual.global_.offwidth, width)
        visual.global_.offheight = max(visual.global_.offheight, height)
        self._data = mujoco.MjData(self._model)
        self._option = mujoco.MjvOption()
        self._scene = mujoco.MjvScene(self._model, self._model.ngeom * 2 + 1000)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION.value] = 0
        lo, hi = workspace_box(run.scene)
        self.line = 0.002 * float(np.linalg.norm(hi - lo))
        self._path = run.scene.to_world(run.plan.waypoints) if len(run.plan.waypoints) else None
        pose_at_start(run.scene, self._data)
        mujoco.mj_forward(self._model, self._data)
        seen = run.scene.to_world(np.array([run.scene.start, run.scene.goal]))
        if self._path is not None:
            seen = np.vstack([seen, self._path])
        hide_scenery(self._model, self._data, run.scene, width / height, seen)
        self._renderer = OffscreenRenderer(self._model, width, height)

    def render(self, view: mujoco.MjvCamera, row: int | None, line: float) -> Image:
        """Picture at a row of the flight log, with the trail up to it; at the start when None.

        Lines are `line` [m] thick.
        """
        if row is None or self._run.log is None:
            pose_at_start(self._run.scene, self._data)
        else:
            pose_at(self._run.log, row, self._data)
        mujoco.mj_forward(self._model, self._data)
        mujoco.mjv_updateScene(
            self._model, self._data, self._option, None, view,
            mujoco.mjtCatBit.mjCAT_ALL.value, self._scene,
        )  # fmt: skip
        scene = self._run.scene
        path, goal = self._planned(row)
        ends = scene.to_world(np.array([scene.start, goal]))
        self._body(ends[0], palette.START)
        self._body(ends[1], palette.GOAL)
        if path is not None:
            self._line(path, palette.PATH, line)
        if row and self._run.log is not None:
            every = max(1, len(self._run.log.time) // self._trail)
            trail = np.vstack([self._run.log.position[:row:every], self._run.log.position[row]])
            self._line(trail, palette.FLOWN, 1.5 * line)
        return self._renderer.render(self._scene)

    def _planned(self, row: int | None) -> tuple[Floats | None, Floats]:
        """Path in the world (k, 3) [m], if there is any, and goal (n,) [m], as of a row."""
        log, planned, scene = self._run.log, self._run.flight_plan, self._run.scene
        if row is None or log is None or planned is None:
            return self._path, scene.goal
        record = planned.in_effect(float(log.time[row]))
        if record is None:
            return self._path, scene.goal
        return scene.to_world(record.waypoints) if len(record.waypoints) else None, record.goal

    def _body(self, centre: Floats, colour: str) -> None:
        """Mark a place of the centre by what stands for the body there; a disc by a ball."""
        geom, scene = self._next(), self._run.scene
        kind, size = mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, scene.radius)
        if scene.n == 3:
            low, high = scene.shape.extent
            centre, half = centre + 0.5 * (low + high), 0.5 * (high - low)
            if scene.shape.kind == "hull":
                kind, size = mujoco.mjtGeom.mjGEOM_BOX, half
            elif scene.shape.kind == "cylinder":
                kind, size = mujoco.mjtGeom.mjGEOM_CYLINDER, np.array([half[0], half[2], 0.0])
        size = np.maximum(size, 3.0 * self.line)  # however small, it is seen
        colours = np.array(palette.rgba(colour, 0.45), np.float32)
        mujoco.mjv_initGeom(geom, kind.value, size, centre, np.eye(3).ravel(), colours)

    def _line(self, points: Floats, colour: str, width: float) -> None:
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE.value
        colours = np.array(palette.rgba(colour), np.float32)
        for a, b in itertools.pairwise(points):
            geom = self._next()
            mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), colours)
            mujoco.mjv_connector(geom, kind, width, a, b)
            geom.emission = 0.4

    def _next(self) -> mujoco.MjvGeom:
        geom = self._scene.geoms[self._scene.ngeom]
        self._scene.ngeom += 1
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR.value  # casts no shadow
        return geom

    def __enter__(self) -> _Stage:
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.__exit__()


class _Encoder:
    """Raw frames in, H.264 out, through the ffmpeg that imageio-ffmpeg brings."""

    def __init__(self, path: Path, width: int, height: int, fps: float) -> None:
        command = [
            imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error",
            "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps}",
            "-i", "-", "-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", "23",
            "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(path),
        ]  # fmt: skip
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is for this process, which then ends the encoder
        )

    def write(self, frame: Image) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(frame.tobytes())
        except BrokenPipeError:
            self._finish()  # says why it went away

    def _finish(self) -> None:
        _, said = self._process.communicate()
        if self._process.returncode:
            lines = said.decode(errors="replace").strip().splitlines() or ["no reason given"]
            raise VideoError(f"ffmpeg could not write the video: {lines[-1]}")

    def __enter__(self) -> _Encoder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if kind is None:
            self._finish()
        else:
            self._process.kill()
            self._process.communicate()
