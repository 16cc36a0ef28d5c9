"""The colliding non-convex meshes of a world, cut into convex pieces that take their place."""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.progress import busy
from hzmp_sim.scene.decomposition.cache import cache_file, cached_pieces, keep_pieces
from hzmp_sim.scene.decomposition.coacd_process import run_coacd
from hzmp_sim.scene.decomposition.cover import cover_surface
from hzmp_sim.scene.decomposition.settings import ConvexDecomposition
from hzmp_sim.scene.meshes import MeshReport, mesh_name, mesh_surface, read_meshes

if TYPE_CHECKING:
    import trimesh

    from hzmp_sim.scene.scene import GeomReport

_COPIED = (
    "contype", "conaffinity", "condim", "priority", "friction", "solmix", "solref", "solimp",
    "margin", "gap", "surfacevel", "adhesion", "rgba",
)  # fmt: skip
_COPIED_PAIR = ("condim", "friction", "solref", "solreffriction", "solimp", "margin", "gap",
                "adhesion")  # fmt: skip
_COLLISION_GROUP = 3
"""MuJoCo's habit for collision shapes: not drawn unless asked. The mesh itself stays in sight."""


@dataclass(frozen=True)
class PieceReport:
    """What the decomposition of one mesh gained, and how its pieces were made to cover it."""

    mesh: MeshReport
    pieces: int
    volume: float
    """Sum of the pieces' volumes, at least that of their union [m^3]."""
    leak: float
    """See `Cover` [m]."""
    growth: float
    """See `Cover` [m]."""
    seconds: float
    """Of CoACD, or of reading its pieces from the cache [s]."""
    cached: bool
    note: str
    """Why the pieces could not be kept in the cache, or ""."""

    def describe(self) -> str:
        """In one line."""
        had = "unknown" if self.mesh.volume is None else f"{self.mesh.volume:.3g}"
        return (
            f"mesh {self.mesh.name!r} cut into {self.pieces} convex pieces: {self.volume:.3g} m^3 "
            f"where its hull has {self.mesh.hull_volume:.3g} and itself {had}; surface stood out "
            f"{1e3 * self.leak:.2g} mm, pieces grown by {1e3 * self.growth:.2g} mm"
        )


@dataclass(frozen=True, eq=False)
class Decomposition:
    """Pieces for some geoms of a world, and how to put them into it."""

    reports: tuple[PieceReport, ...] = ()
    _pieces: Mapping[str, tuple[Floats, ...]] = field(default_factory=dict)
    """For each mesh asset that is cut, the corners of its pieces in the frame of its geoms."""
    _poses: Mapping[int, tuple[Floats, Floats]] = field(default_factory=dict)
    """For the place of each such geom in `spec.geoms`, its compiled position and quaternion."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Why pieces could not be kept for the next time, once."""
        return tuple(dict.fromkeys(report.note for report in self.reports if report.note))

    def explained(
        self, reports: Sequence[GeomReport], model: mujoco.MjModel
    ) -> tuple[GeomReport, ...]:
        """The reports on the geoms of the changed world, saying where the meshes' part went."""
        cut = {report.mesh.name for report in self.reports}
        return tuple(
            replace(report, reason="its convex pieces collide in its place")
            if report.role == "ignored"
            and report.type == "mesh"
            and mesh_name(model, int(model.geom_dataid[report.geom])) in cut
            else report
            for report in reports
        )

    def put_into(self, spec: mujoco.MjSpec) -> None:
        """Let the pieces collide in place of their meshes, which stay visible.

        `spec` is as read from the file of the model that was decomposed, nothing added or removed.
        """
        assets = {name: _add_meshes(spec, name, parts) for name, parts in self._pieces.items()}
        geoms = list(spec.geoms)
        for place, (position, quaternion) in self._poses.items():
            geom = geoms[place]
            names = _unused(
                geom.name or geom.meshname, len(assets[geom.meshname]), [g.name for g in spec.geoms]
            )
            for name, asset in zip(names, assets[geom.meshname], strict=True):
                piece = geom.parent.add_geom(
                    name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=asset,
                    pos=position, quat=quaternion, group=_COLLISION_GROUP, mass=0.0,
                )  # fmt: skip
                # Default classes may turn geoms by Euler angles or the like, which would win.
                piece.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
                for attribute in _COPIED:
                    setattr(piece, attribute, getattr(geom, attribute))
            _copy_pairs(spec, geom.name, names)
            geom.contype = geom.conaffinity = 0


def decompose_meshes(
    model: mujoco.MjModel,
    spec: mujoco.MjSpec,
    settings: ConvexDecomposition,
    spared: Collection[int] = (),
) -> Decomposition:
    """Cut every non-convex mesh that a geom collides with.

    Args:
        model: the compiled world.
        spec: what it was compiled from.
        settings: of CoACD.
        spared: ids of geoms to leave alone, such as those of the moving body.

    Raises:
        SceneError: CoACD takes too long, crashes, or finds nothing.
    """
    paired = {int(g) for pair in (model.pair_geom1, model.pair_geom2) for g in pair}
    colliding = [
        geom
        for geom in range(model.ngeom)
        if geom not in spared
        and (model.geom_contype[geom] or model.geom_conaffinity[geom] or geom in paired)
    ]
    dented = [report for report in read_meshes(model, colliding) if not report.convex]
    pieces, reports = {}, []
    for number, report in enumerate(dented, start=1):
        count = f" ({number} of {len(dented)})" if len(dented) > 1 else ""
        with busy(f"Cutting mesh {report.name!r} into convex pieces{count}"):
            surface = mesh_surface(model, int(model.geom_dataid[report.geoms[0]]))[0]
            pieces[report.name], made = _decompose(report, surface, settings)
        reports.append(made)
    wanted = {geom for report in dented for geom in report.geoms}
    poses = {
        place: (np.array(model.geom_pos[geom.id]), np.array(model.geom_quat[geom.id]))
        for place, geom in enumerate(spec.geoms)
        if geom.id in wanted
    }
    return Decomposition(tuple(reports), pieces, poses)


def _decompose(
    report: MeshReport, surface: trimesh.Trimesh, settings: ConvexDecomposition
) -> tuple[tuple[Floats, ...], PieceReport]:
    began = time.perf_counter()
    vertices, faces = np.array(surface.vertices), np.array(surface.faces)
    file = cache_file(vertices, faces, settings)
    found, note = cached_pieces(file), ""
    cached = found is not None
    if found is None:
        found = run_coacd(report.name, vertices, faces, settings)
        note = keep_pieces(file, found)
    seconds = time.perf_counter() - began
    cover = cover_surface(surface, found, report.hull_volume)
    made = PieceReport(
        mesh=report,
        pieces=len(cover.pieces),
        volume=cover.volume,
        leak=cover.leak,
        growth=cover.growth,
        seconds=seconds,
        cached=cached,
        note=note,
    )
    return cover.pieces, made


def _add_meshes(spec: mujoco.MjSpec, mesh: str, pieces: Sequence[Floats]) -> list[str]:
    """Add a mesh asset a piece; returns their names."""
    names = _unused(mesh, len(pieces), [item.name for item in spec.meshes])
    for name, corners in zip(names, pieces, strict=True):
        spec.add_mesh(name=name, uservert=corners.ravel())
    return names


def _copy_pairs(spec: mujoco.MjSpec, geom: str, pieces: Sequence[str]) -> None:
    """Explicit contact pairs of a geom become those of its pieces."""
    pairs = [pair for pair in spec.pairs if geom and geom in (pair.geomname1, pair.geomname2)]
    for pair in pairs:
        for piece in pieces:
            ends = [piece if end == geom else end for end in (pair.geomname1, pair.geomname2)]
            copy = spec.add_pair(geomname1=ends[0], geomname2=ends[1])
            for attribute in _COPIED_PAIR:
                setattr(copy, attribute, getattr(pair, attribute))
        spec.delete(pair)


def _unused(stem: str, count: int, taken: Collection[str]) -> list[str]:
    """Names stem_piece_1, ..., with underscores added until none is taken."""
    while any(f"{stem}_piece_{i}" in taken for i in range(1, count + 1)):
        stem += "_"
    return [f"{stem}_piece_{i}" for i in range(1, count + 1)]
