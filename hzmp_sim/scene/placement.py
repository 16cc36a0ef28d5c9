"""Where the body may be, starts, and is to go: from the file, overridden by the caller."""

from __future__ import annotations

from dataclasses import dataclass

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
        point = self.site if self.given is None else self.given
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


def read_workspace(
    model: mujoco.MjModel, data: mujoco.MjData, given: tuple[ArrayLike, ArrayLike] | None
) -> tuple[Bounds, tuple[str, ...]]:
    """Workspace (lo, hi) of 2 or 3 coordinates each [m], and a warning when it was guessed.

    The caller's, else `<custom><numeric name="workspace" data="x0 y0 z0 x1 y1 z1"/>`, else the box
    of the static geoms (planes only bound it from below).

    Raises:
        SceneError, ShapeError: it is not a box, or nothing says what it is.
    """
    if given is not None:
        try:
            low, high = given
        except (TypeError, ValueError) as error:
            raise SceneError("workspace must be a pair (lo, hi) of corners") from error
        return _box(as_floats(low, "workspace lo", 1), as_floats(high, "workspace hi", 1)), ()
    number = mujoco.mj_name2id(model, int(mujoco.mjtObj.mjOBJ_NUMERIC), "workspace")
    if number >= 0:
        start, size = int(model.numeric_adr[number]), int(model.numeric_size[number])
        data_ = as_floats(model.numeric_data[start : start + size], "numeric workspace", 1)
        if size not in (4, 6):
            raise SceneError(
                f"numeric workspace has {size} entries; valid are x0 y0 z0 x1 y1 z1 (or 4, planar)"
            )
        return _box(data_[: size // 2], data_[size // 2 :]), ()
    low, high = _static_box(model, data)
    warning = (
        f"no workspace given: taken as the box of the static geoms, {_text(low)} to {_text(high)}"
    )
    return _box(low, high), (warning,)


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


def _static_box(model: mujoco.MjModel, data: mujoco.MjData) -> Bounds:
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
            'name="workspace" data="x0 y0 z0 x1 y1 z1"/></custom> or give a workspace'
        )
    low[2] = max(low[2], floor)
    return low, high


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
    return "(" + ", ".join(f"{value:.6g}" for value in point) + ")"
