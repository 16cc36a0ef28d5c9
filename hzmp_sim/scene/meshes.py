"""Meshes as surfaces: repair, measures, and what is wrong with them.

MuJoCo collides with the convex hull of a mesh, so an open or inverted one is safe to plan around;
what it costs is the room inside its hull.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from hzmp_planners._arrays import Floats
from hzmp_sim.scene.geoms import mesh_arrays, mesh_points

if TYPE_CHECKING:
    import trimesh

CONVEX_SHARE = 0.98
"""A mesh that fills this share of its hull is as good as convex."""

DENT_SHARE = 1e-3
"""So is one without a known volume whose faces are all within this share of its size of the hull's
surface."""

_LOOKED_AT = 2_000  # faces whose distance to the hull's surface is measured: the largest ones
_NAMED = 4  # meshes or bodies that a warning names


@dataclass(frozen=True)
class MeshReport:
    """One mesh that the body could touch, as it was read."""

    name: str
    geoms: tuple[int, ...]
    """Ids of the colliding geoms that show it."""
    faces: int
    volume: float | None
    """What its surface encloses [m^3]; None when that is not known: it is open, or its faces are
    turned both ways."""
    hull_volume: float
    """Of the convex hull that MuJoCo collides [m^3]."""
    convex: bool
    """As good as its hull."""
    flaws: tuple[str, ...]
    """Some of "open", "inside out", "turned both ways", "with faces of no area"."""

    @property
    def loss(self) -> str:
        """What its hull costs, in words."""
        if self.volume is None:
            return f"hull {self.hull_volume:.3g} m^3, volume of the mesh unknown"
        return f"hull {self.hull_volume:.3g} m^3, mesh {self.volume:.3g} m^3"


def read_meshes(model: mujoco.MjModel, geoms: Iterable[int]) -> tuple[MeshReport, ...]:
    """Measure the meshes that some geoms collide with, one report a mesh, in the order of ids."""
    users: dict[int, list[int]] = {}
    for geom in geoms:
        if int(model.geom_type[geom]) == mujoco.mjtGeom.mjGEOM_MESH:
            users.setdefault(int(model.geom_dataid[geom]), []).append(geom)
    return tuple(_report(model, mesh, tuple(users[mesh])) for mesh in sorted(users))


def mesh_surface(model: mujoco.MjModel, mesh: int) -> tuple[trimesh.Trimesh, tuple[str, ...]]:
    """Surface of a compiled mesh in the frame of its geoms, repaired, and the flaws it had.

    Points that coincide become one, faces without area or twice there are dropped, and a closed
    surface that is inside out is turned.
    """
    import trimesh  # half a second: only for worlds with meshes

    surface = trimesh.Trimesh(*mesh_arrays(model, mesh), process=False)
    surface.merge_vertices(merge_tex=True, merge_norm=True)
    flaws = []
    solid = surface.nondegenerate_faces()
    if not solid.all():
        flaws.append("with faces of no area")
        surface.update_faces(solid)
    surface.update_faces(surface.unique_faces())
    surface.remove_unreferenced_vertices()
    if not surface.is_watertight:
        flaws.append("open")
    elif not surface.is_winding_consistent:
        flaws.append("turned both ways")
    elif _volume(surface) < 0.0:
        flaws.append("inside out")
        surface.invert()
    return surface, tuple(flaws)


def mesh_warnings(reports: Sequence[MeshReport]) -> tuple[str, ...]:
    """What to know of the meshes of a world, in at most one line a matter."""
    found = []
    for flaw, means in (
        ("open", "their volume is not known"),
        ("turned both ways", "their volume is not known"),
        ("inside out", "they are taken as if turned"),
    ):
        names = [report.name for report in reports if flaw in report.flaws]
        if names:
            found.append(
                f"meshes that are {flaw}: {listed(names)}; {means}, and MuJoCo collides with "
                "their convex hulls, which hold them all the same"
            )
    dented = [report for report in reports if not report.convex]
    if dented:
        names = [f"{report.name!r} ({report.loss})" for report in dented]
        found.append(
            f"treated as convex hulls, as MuJoCo does: {'mesh' if len(dented) == 1 else 'meshes'} "
            f"{listed(names)}; --convex-decomposition cuts them into convex pieces"
        )
    return tuple(found)


def hull_note(model: mujoco.MjModel, geom: int) -> str:
    """Why a geom may block more than is seen of it; "" unless it is a non-convex mesh."""
    for report in read_meshes(model, [geom]):
        if not report.convex:
            return (
                f"mesh {report.name!r} is treated as its convex hull, as MuJoCo does "
                f"({report.loss}); --convex-decomposition cuts it into convex pieces"
            )
    return ""


def mesh_name(model: mujoco.MjModel, mesh: int) -> str:
    """Name of a mesh asset."""
    return mujoco.mj_id2name(model, int(mujoco.mjtObj.mjOBJ_MESH), mesh) or f"#{mesh}"


def known_volume(surface: trimesh.Trimesh) -> float | None:
    """What a surface encloses [m^3]; None unless it is closed and its faces agree."""
    closed = surface.is_watertight and surface.is_winding_consistent
    return _volume(surface) if closed else None


def is_convex(surface: trimesh.Trimesh, hull: ConvexHull) -> bool:
    """Whether a surface is as good as its convex hull."""
    volume = known_volume(surface)
    if volume is not None:
        return volume >= CONVEX_SHARE * float(hull.volume)
    largest = np.argsort(-surface.area_faces)[:_LOOKED_AT]
    middles: Floats = surface.triangles_center[largest]
    depth = -(middles @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    return float(depth.max()) <= DENT_SHARE * float(np.ptp(hull.points, axis=0).max())


def _report(model: mujoco.MjModel, mesh: int, geoms: tuple[int, ...]) -> MeshReport:
    surface, flaws = mesh_surface(model, mesh)
    hull = ConvexHull(mesh_points(model, geoms[0]))
    return MeshReport(
        name=mesh_name(model, mesh),
        geoms=geoms,
        faces=int(model.mesh_facenum[mesh]),
        volume=known_volume(surface),
        hull_volume=float(hull.volume),
        convex=is_convex(surface, hull),
        flaws=flaws,
    )


def _volume(surface: trimesh.Trimesh) -> float:
    with np.errstate(all="ignore"):  # trimesh divides by the volume for the centre of mass
        return float(surface.volume)


def listed(names: Sequence[str]) -> str:
    """The first few names, and how many more there are."""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more
