"""Where the body may be, starts, and is to go: from the file, overridden by the caller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import Floats, as_floats
from hzmp_planners.errors import QueryError, SceneError
from hzmp_sim.scene.body_shape import BodyShape
from hzmp_sim.scene.constants import MAX_COORDINATE
from hzmp_sim.scene.geoms import HalfSpace, geom_shape

Bounds = tuple[Floats, Floats]


@dataclass(frozen=True, eq=False)
class Endpoint:
    """A start or goal as far as it was said: 2 or 3 coordinates, and the site of that name."""

    label: str
    given: Floats | None
    """The caller's coordinates, shape (2,) or (3,) [m]."""
    site: Floats | None
    """Position of the site in the world, shape (3,) [m]."""

    @property
    def is_planar(self) -> bool:
        """The caller gave two coordinates."""
        return self.given is not None and self.given.size == 2

    @property
    def known(self) -> Floats | None:
        """The coordinates that were said, shape (2,) or (3,) [m]; None: the body says."""
        return self.site if self.given is None else self.given

    @property
    def height(self) -> float | None:
        """Z as far as it is known [m]."""
        if self.given is not None and self.given.size == 3:
            return float(self.given[2])
        return None if self.site is None else float(self.site[2])

    def position(self, height: float | None) -> Floats:
        """World position (3,) [m]; `height` fills in when no z was said.

        Raises:
            SceneError: nothing says where it is.
            QueryError: it is further away than anything can be.
        """
        point = self.known
        if point is None:
            raise SceneError(
                f'no {self.label}: put <site name="{self.label}" pos="x y z"/> into the world, '
                f"or give --{self.label} X Y [Z]"
            )
        if np.abs(point).max() > MAX_COORDINATE:
            raise QueryError(f"{self.label} {_text(point)} is beyond {MAX_COORDINATE:g} m")
        z = self.height if self.height is not None else height
        if z is None:
            raise SceneError(f"{self.label} {_text(point)} has no height: give three coordinates")
        return np.array([point[0], point[1], z])


def read_endpoint(
    model: mujoco.MjModel, data: mujoco.MjData, label: str, given: ArrayLike | None
) -> Endpoint:
    """The start or goal as said by the caller and by the site `label`.

    Raises:
        ShapeError: not finite, or not a vector.
        QueryError: not two or three coordinates.
    """
    point = None if given is None else as_floats(given, label, 1)
    if point is not None and point.size not in (2, 3):
        raise QueryError(f"{label} must have 2 or 3 coordinates, got {point.size}")
    site = mujoco.mj_name2id(model, int(mujoco.mjtObj.mjOBJ_SITE), label)
    return Endpoint(label, point, None if site < 0 else np.array(data.site_xpos[site]))


@dataclass(frozen=True, eq=False)
class Workspace:
    """The box that bounds the whole body, as said or as guessed."""

    bounds: Bounds
    """Its corners (lo, hi), 2 or 3 coordinates each [m]; 3 when guessed."""
    guessed: bool
    """Nobody said it: it is the box of the static geoms, and may grow."""
    floor: float = -np.inf
    """Height of the highest level plane [m], below which a guess does not grow."""

    def with_room(self, points: Sequence[Floats | None], room: float) -> Workspace:
        """A guess grown to hold points of 2 or 3 coordinates too, and by `room` all around [m]."""
        if not self.guessed:
            return self
        low, high = self.bounds[0].copy(), self.bounds[1].copy()
        for point in points:
            if point is not None:
                low[: point.size] = np.minimum(low[: point.size], point)
                high[: point.size] = np.maximum(high[: point.size], point)
        low, high = low - room, high + room
        low[2] = max(low[2], self.floor)
        return replace(self, bounds=(low, high))

    def warnings(self, n: int) -> tuple[str, ...]:
        """That it was guessed, and what it is in the first n coordinates."""
        if not self.guessed:
            return ()
        low, high = (_text(corner[:n]) for corner in self.bounds)
        return (
            "no workspace given: taken as the box of the static geoms, start and goal with room "
            f"around, {low} to {high}",
        )


def read_workspace(
    model: mujoco.MjModel, data: mujoco.MjData, given: tuple[ArrayLike, ArrayLike] | None
) -> Workspace:
    """The box that bounds the whole body.

    The caller's, else `<custom><numeric name="workspace" data="x0 y0 z0 x1 y1 z1"/>`, else a guess:
    the box of the static geoms (planes only bound it from below).

    Raises:
        SceneError, ShapeError: it is not a box, or nothing says what it is.
    """
    if given is not None:
        try:
            low, high = given
        except (TypeError, ValueError) as error:
            raise SceneError("workspace must be a pair (lo, hi) of corners") from error
        said = _box(as_floats(low, "workspace lo", 1), as_floats(high, "workspace hi", 1))
        return Workspace(said, guessed=False)
    number = mujoco.mj_name2id(model, int(mujoco.mjtObj.mjOBJ_NUMERIC), "workspace")
    if number >= 0:
        start, size = int(model.numeric_adr[number]), int(model.numeric_size[number])
        data_ = as_floats(model.numeric_data[start : start + size], "numeric workspace", 1)
        if size not in (4, 6):
            raise SceneError(
                f"numeric workspace has {size} entries; valid are x0 y0 z0 x1 y1 z1 (or 4, planar)"
            )
        return Workspace(_box(data_[: size // 2], data_[size // 2 :]), guessed=False)
    return _static_box(model, data)


def _box(low: Floats, high: Floats) -> Bounds:
    if low.size != high.size or low.size not in (2, 3):
        raise SceneError(
            f"workspace corners must have 2 or 3 coordinates each, got {low.size} and {high.size}"
        )
    if (low >= high).any():
        axis = "xyz"[int(np.argmax(low >= high))]
        raise SceneError(
            f"workspace {_text(low)} to {_text(high)} is empty along {axis}: lo must be below hi"
        )
    if max(np.abs(low).max(), np.abs(high).max()) > MAX_COORDINATE:
        raise SceneError(f"workspace {_text(low)} to {_text(high)} is beyond {MAX_COORDINATE:g} m")
    return low, high


def _static_box(model: mujoco.MjModel, data: mujoco.MjData) -> Workspace:
    low, high, floor = np.full(3, np.inf), np.full(3, -np.inf), -np.inf
    for geom in range(model.ngeom):
        collides = model.geom_contype[geom] or model.geom_conaffinity[geom]
        if not collides or model.body_weldid[model.geom_bodyid[geom]] != 0:
            continue
        shape = geom_shape(model, data, geom)
        if isinstance(shape, HalfSpace):
            if shape.normal[2] > 1.0 - 1e-9:
                floor = max(floor, shape.offset)
            continue
        low = np.minimum(low, -shape.support(-np.eye(3)))
        high = np.maximum(high, shape.support(np.eye(3)))
    if not np.isfinite(low).all():
        raise SceneError(
            "the world has no static geom to take a workspace from; add <custom><numeric "
            'name="workspace" data="x0 y0 z0 x1 y1 z1"/></custom> or give '
            "--workspace X0 Y0 Z0 X1 Y1 Z1"
        )
    low[2] = max(low[2], floor)
    return Workspace((low, high), guessed=True, floor=floor)


def centre_bounds(space: Bounds, shape: BodyShape, reach: Bounds) -> Bounds:
    """Box of the centre (lo, hi): the workspace shrunk by the body's shape, within its `reach`.

    Raises:
        SceneError: the body does not fit in.
    """
    low_end, high_end = shape.extent
    n = low_end.size
    low = np.maximum(space[0][:n] - low_end, reach[0][:n])
    high = np.minimum(space[1][:n] - high_end, reach[1][:n])
    if (low >= high).any():
        axis = int(np.argmax(low >= high))
        raise SceneError(
            f"the workspace is {space[1][axis] - space[0][axis]:.4g} m wide along {'xyz'[axis]}, "
            f"the body {high_end[axis] - low_end[axis]:.4g} m: it does not fit in"
        )
    return low, high


def check_inside(label: str, point: Floats, bounds: Bounds) -> None:
    """Raise QueryError unless the point (n,) lies in the box of the centre (lo, hi)."""
    low, high = bounds
    if (point < low - 1e-9).any() or (point > high + 1e-9).any():
        raise QueryError(
            f"{label} {_text(point)} is outside the workspace: the body's centre may be from "
            f"{_text(low)} to {_text(high)} (workspace shrunk by the body's shape, and the ranges "
            "of its slide joints)"
        )


def _text(point: Floats) -> str:
    # Six decimals: a wall's foot at -5e-9, by its rounded rotation, is at 0; + 0.0 makes -0 plain.
    return "(" + ", ".join(f"{round(float(value), 6) + 0.0:.6g}" for value in point) + ")"
