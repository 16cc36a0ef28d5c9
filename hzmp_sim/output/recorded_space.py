"""Free spaces as rerun shapes, and a recording of a scene before anything is planned in it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from hzmp_planners._polygons import counter_clockwise, counter_clockwise_rows, facet_corners
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.free_space.plot import leaf_colours, shrunk
from hzmp_planners.sets import Polytope
from hzmp_sim.output import palette
from hzmp_sim.output.artifacts import whole_file
from hzmp_sim.output.blueprint import EXPLODE, space_blueprint
from hzmp_sim.output.framing import workspace_box
from hzmp_sim.output.meshes import hull_triangles, outline_rows
from hzmp_sim.output.recorded_geoms import log_world

if TYPE_CHECKING:
    from hzmp_planners._arrays import Floats, Ints
    from hzmp_sim.scene import Scene

EXPLODE_PERCENT = tuple(range(0, 101, 5))
"""Steps of the timeline that moves the leaves apart [%]."""

Segments = NDArray[np.float32]
"""Lines with two ends each, shape (k, 2, 3) [m]."""


def write_space(scene: Scene, space: FreeSpace, path: Path) -> None:
    """Write a recording (.rrd) of a scene and its leaves, which the timeline `explode` separates.

    It needs neither viewer nor network. The timeline counts percent: see `plot_leaves`.

    Raises:
        OutputError: the file cannot be written.
    """
    recording = rr.RecordingStream("hzmp_sim", recording_id=scene.path.as_posix())
    recording.set_log_tick_enabled(False)  # only our timeline: recordings are reproducible
    recording.set_log_time_enabled(False)
    with whole_file(path) as partial:
        recording.save(partial, default_blueprint=space_blueprint(scene))
        recording.send_recording_name(scene.path.parent.name or scene.path.stem)
        line = line_radius(scene)
        log_world(recording, scene, moving=False)
        log_space(recording, scene, space, line, explode=True)
        log_ends(recording, scene, line)
        recording.flush()
        recording.disconnect()


def line_radius(scene: Scene) -> float:
    """Half the width of lines that suits the size of a scene [m]."""
    return 0.0015 * float(np.linalg.norm(np.subtract(*workspace_box(scene))))


def log_ends(recording: rr.RecordingStream, scene: Scene, line: float) -> None:
    """Log start and goal."""
    ends = rr.Points3D(
        scene.to_world(np.array([scene.start, scene.goal])),
        colors=[palette.rgba8(palette.START), palette.rgba8(palette.GOAL)],
        labels=["start", "goal"],
        radii=4 * line,
    )
    recording.log("plan/ends", ends, static=True)


def log_space(
    recording: rr.RecordingStream, scene: Scene, space: FreeSpace, line: float, *, explode: bool
) -> None:
    """Log leaves, shared faces and grown obstacles below `space`.

    Args:
        recording: where to.
        scene: says where in the world the space is.
        space: of the scene.
        line: half the width of lines [m].
        explode: on a timeline that moves coloured leaves apart; if not, leaves are the background
            of a run: static and of one colour.
    """
    log = log_exploding_leaves if explode else log_leaves
    log(recording, "space", space, line, scene.to_world)
    faces = [face.vertices for face in space.graph.faces]
    rings = [scene.to_world(np.vstack([corners, corners[:1]])) for corners in faces]
    log_strips(recording, "space/faces", rings, palette.FACE, line / 2)
    grown = []
    for obstacle in scene.obstacles:
        if scene.n == 2:
            ring = scene.to_world(counter_clockwise(obstacle.vertices()))
            grown.append((ring, _fan(np.arange(len(ring)))))
        else:
            grown.append(hull_triangles(obstacle.vertices()))
    _log_triangles(recording, "space/grown_obstacles", grown, palette.GROWN, 0.35)


def log_leaves(
    recording: rr.RecordingStream,
    root: str,
    space: FreeSpace,
    line: float,
    to_world: Callable[[Floats], Floats],
) -> None:
    """Log the leaves: a mesh of all of them as `root`/cells, their edges as `root`/leaves.

    Args:
        recording: where to.
        root: entity.
        space: of which the leaves are.
        line: half the width of lines [m].
        to_world: from points (k, n) of the space to the world (k, 3).
    """
    shapes = _Shapes(space)
    vertices = [to_world(leaf.vertices()) for leaf in space.leaves]
    parts = [
        (points[corners], triangles)
        for points, corners, triangles in zip(
            vertices, shapes.corners, shapes.triangles, strict=True
        )
    ]
    _log_triangles(recording, f"{root}/cells", parts, palette.LEAF, 0.25)
    log_strips(recording, f"{root}/leaves", shapes.strips(vertices), palette.LEAF, line / 2)


def log_exploding_leaves(
    recording: rr.RecordingStream,
    root: str,
    space: FreeSpace,
    line: float,
    to_world: Callable[[Floats], Floats],
) -> None:
    """Log the leaves as `log_leaves` does, coloured, on a timeline that moves them apart.

    See `plot_leaves` for what its steps, EXPLODE_PERCENT, do.
    """
    if not len(space):
        return
    shapes = _Shapes(space)
    counts = [len(corners) for corners in shapes.corners]
    starts = np.cumsum([0, *counts])[:-1]
    fills = np.round(255 * np.array(leaf_colours(space))).astype(np.uint8)
    mesh = rr.Mesh3D.from_fields(
        triangle_indices=np.vstack(
            [rows + start for rows, start in zip(shapes.triangles, starts, strict=True)]
        ),
        vertex_normals=np.vstack(shapes.normals),
        vertex_colors=fills.repeat(counts, axis=0),
    )
    recording.log(f"{root}/cells", mesh, static=True)
    look = rr.LineStrips3D.from_fields(colors=[palette.rgba8(palette.INK)], radii=[line / 4])
    recording.log(f"{root}/leaves", look, static=True)
    for percent in EXPLODE_PERCENT:
        recording.set_time(EXPLODE, sequence=percent)
        vertices = [to_world(shrunk(leaf.vertices(), percent / 100)) for leaf in space.leaves]
        points = np.vstack(
            [at[corners] for at, corners in zip(vertices, shapes.corners, strict=True)]
        )
        recording.log(f"{root}/cells", rr.Mesh3D.from_fields(vertex_positions=points))
        strips = rr.LineStrips3D.from_fields(strips=shapes.strips(vertices))
        recording.log(f"{root}/leaves", strips)
    recording.reset_time()


class _Shapes:
    """Which vertices of each leaf to draw: corners of its facets end to end, triangles, edges."""

    def __init__(self, space: FreeSpace) -> None:
        self.corners: list[Ints] = []
        self.triangles: list[Ints] = []
        self.normals: list[Floats] = []
        """At the corners, in the world."""
        self.edges: list[list[Ints]] = []
        self._segments = space.n == 3 and len(space) > 0
        for leaf in space.leaves:
            self._add(leaf)

    def _add(self, leaf: Polytope) -> None:
        vertices = leaf.vertices()
        if leaf.n == 2:
            facets = [counter_clockwise_rows(vertices)]
            normals = np.array([[0.0, 0.0, 1.0]])
        else:
            found = facet_corners(vertices, leaf.A, leaf.incidence)
            facets = [corners for _, corners in found]
            normals = leaf.A[[row for row, _ in found]]
        counts = [len(corners) for corners in facets]
        starts = np.cumsum([0, *counts])[:-1]
        self.corners.append(np.concatenate(facets))
        fans = [_fan(np.arange(k) + start) for k, start in zip(counts, starts, strict=True)]
        self.triangles.append(np.vstack(fans))
        self.normals.append(normals.repeat(counts, axis=0))
        self.edges.append(outline_rows(leaf))

    def strips(self, vertices: list[Floats]) -> list[Floats] | Segments:
        """The edges, given the vertices of each leaf in the world; (k, 2, 3) if all have two ends.

        rerun takes an array a hundred times as fast as a list of arrays.
        """
        if self._segments:
            pairs = zip(vertices, self.edges, strict=True)
            ends = np.concatenate([at[np.asarray(edges)] for at, edges in pairs])
            return ends.astype(np.float32)
        return [at[rows] for at, edges in zip(vertices, self.edges, strict=True) for rows in edges]


def log_strips(
    recording: rr.RecordingStream,
    entity: str,
    strips: list[Floats] | Segments,
    colour: str,
    radius: float,
    *,
    static: bool = True,
) -> None:
    """Log lines that do not change, or from the time set on."""
    lines = rr.LineStrips3D(strips, colors=[palette.rgba8(colour)], radii=radius)
    recording.log(entity, lines, static=static)


def _fan(ring: Ints) -> Ints:
    """Triangles of a convex polygon whose corners are given in order."""
    return np.column_stack([np.full(len(ring) - 2, ring[0]), ring[1:-1], ring[2:]])


def _log_triangles(
    recording: rr.RecordingStream,
    entity: str,
    parts: list[tuple[Floats, Ints]],
    colour: str,
    alpha: float,
) -> None:
    if not parts:
        return
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    mesh = rr.Mesh3D(
        vertex_positions=np.vstack([vertices for vertices, _ in parts]),
        triangle_indices=np.vstack(
            [triangles + start for (_, triangles), start in zip(parts, starts, strict=True)]
        ),
        albedo_factor=palette.rgba8(colour, alpha),
    )
    recording.log(entity, mesh, static=True)
