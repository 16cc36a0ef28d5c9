"""Distances of geoms of the body to geoms of the world, also where MuJoCo's are not to be trusted.

`mj_geomDistance` is exact for planes and convex geoms, but looks at 50 prisms of a height field at
most (and so says too much), and says nothing or too much for SDF geoms. Their convex parts, put as
meshes into a small model of their own beside a copy of the body, are convex geoms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.scene import Scene
from hzmp_sim.scene.constants import MERGE_SHARE
from hzmp_sim.scene.geoms import geom_parts, geom_type, mesh_points
from hzmp_sim.scene.shapes import Hull

_BY_PARTS = ("hfield", "sdf")


@dataclass(frozen=True)
class Pair:
    """A geom of the body and a geom of the world, or a convex part of one."""

    mine: int
    """Geom id."""
    other: int
    """Geom id."""
    part: int = -1
    """Number of the part among those of all geoms; -1: the whole geom."""


class PairDistances:
    """Signed distances of pairs at the poses that `data` holds."""

    def __init__(self, scene: Scene, data: mujoco.MjData) -> None:
        self._model, self._data = scene.model, data
        lo, hi = scene.to_world(np.array(scene.workspace))
        self._far = max(100.0, 2.0 * float(np.linalg.norm(hi - lo)))
        if scene.height is not None:  # a planar workspace says nothing of heights
            lo[2], hi[2] = lo[2] - self._far, hi[2] + self._far
        kinds = {geom: geom_type(scene.model, geom) for geom in scene.contact_geoms}
        pairs = [(geom, -1) for geom, kind in kinds.items() if kind not in _BY_PARTS]
        hulls: list[Floats] = []
        for geom, kind in kinds.items():
            if kind not in _BY_PARTS:
                continue
            tolerance = MERGE_SHARE * scene.tolerance
            for part in geom_parts(scene.model, data, geom, (lo, hi), tolerance):
                if isinstance(part.shape, Hull):
                    pairs.append((geom, len(hulls)))
                    hulls.append(part.shape.points)
        self._parts = _Parts(scene, data, hulls) if hulls else None
        self.pairs = tuple(
            Pair(mine, other, part) for other, part in pairs for mine in scene.body_geoms
        )

    def update(self) -> None:
        """Take over the pose of the body from `data`."""
        if self._parts is not None:
            self._parts.move(self._data)

    def distance(self, pair: Pair) -> float:
        """Signed distance of a pair [m]; of what is far away, that it is."""
        if pair.part >= 0 and self._parts is not None:
            return self._parts.distance(pair, self._far)
        return mujoco.mj_geomDistance(
            self._model, self._data, pair.mine, pair.other, self._far, None
        )


class _Parts:
    """A model of the body's geoms on a mocap body, and of convex hulls that stand still."""

    def __init__(self, scene: Scene, data: mujoco.MjData, hulls: Sequence[Floats]) -> None:
        self._body = scene.model.body(scene.body).id
        self._rows = {geom: row for row, geom in enumerate(scene.body_geoms)}
        spec = mujoco.MjSpec()
        mover = spec.worldbody.add_body(name="body", mocap=True)
        for geom in scene.body_geoms:
            _copy_geom(spec, mover, scene.model, data, self._body, geom)
        still = spec.worldbody.add_body(name="parts")
        for points in hulls:
            _add_hull(spec, still, points)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self.move(data)

    def move(self, data: mujoco.MjData) -> None:
        self._data.mocap_pos[0] = data.xpos[self._body]
        self._data.mocap_quat[0] = data.xquat[self._body]
        mujoco.mj_kinematics(self._model, self._data)

    def distance(self, pair: Pair, far: float) -> float:
        mine, part = self._rows[pair.mine], len(self._rows) + pair.part
        return mujoco.mj_geomDistance(self._model, self._data, mine, part, far, None)


def _copy_geom(
    spec: mujoco.MjSpec,
    mover: mujoco.MjsBody,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    body: int,
    geom: int,
) -> None:
    """Add what MuJoCo collides for a geom of the body, at its place in the body's frame."""
    turn = np.array(data.xmat[body]).reshape(3, 3).T
    position = turn @ (data.geom_xpos[geom] - data.xpos[body])
    axes = turn @ np.array(data.geom_xmat[geom]).reshape(3, 3)
    kind = geom_type(model, geom)
    if kind in ("mesh", "sdf"):
        _add_hull(spec, mover, mesh_points(model, geom) @ axes.T + position)
        return
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, axes.ravel())
    mover.add_geom(
        type=mujoco.mjtGeom(int(model.geom_type[geom])),
        size=model.geom_size[geom],
        pos=position,
        quat=quat,
    )


def _add_hull(spec: mujoco.MjSpec, body: mujoco.MjsBody, points: Floats) -> None:
    """Add the convex hull of points (k, 3), in the frame of the body, as a mesh geom."""
    name = f"hull{len(spec.meshes)}"
    # Of the surface: MuJoCo refuses thin solids, and nothing here has to move by its mass.
    shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    spec.add_mesh(name=name, uservert=points.ravel(), inertia=shell)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
