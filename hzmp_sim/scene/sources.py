"""Where a world comes from: MJCF file, zip with assets, compiled model, or editable model."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import mujoco

from hzmp_planners.errors import SceneError
from hzmp_sim.mujoco_warnings import mujoco_warnings
from hzmp_sim.scene.constants import MAX_ZIP_BYTES
from hzmp_sim.scene.decompiled import decompiled
from hzmp_sim.scene.embed import embed_assets
from hzmp_sim.scene.mesh_size import refuse_enormous
from hzmp_sim.scene.mjcf import compile_spec, one_line, read_spec
from hzmp_sim.worlds import world_names, world_path


@dataclass(frozen=True, eq=False)
class Source:
    """A world as an editable model that needs no other files, textures of files apart."""

    path: Path
    """The file; for a MjSpec the name of its model."""
    spec: mujoco.MjSpec
    """Compiled once; copy it before changing it."""
    model: mujoco.MjModel
    data: mujoco.MjData
    """At the initial state, with all poses computed."""
    warnings: tuple[str, ...]


def open_world(world: str | Path | mujoco.MjSpec) -> Source:
    """The world of a file (.xml, .zip, .mjb), of a bundled name, or of an editable model.

    Raises:
        SceneError: there is no such file, or MuJoCo cannot read or compile it.
    """
    if isinstance(world, mujoco.MjSpec):
        with mujoco_warnings():
            spec = world.copy()
        path = Path(world.modelname or "MjSpec")
        return _compiled(path, spec, with_files=bool(spec.assets))
    file = find_world(world)
    if zipfile.is_zipfile(file):
        with TemporaryDirectory() as folder:
            return _compiled(file, read_spec(_unpacked(file, Path(folder)), file), with_files=True)
    if file.suffix.lower() == ".mjb":
        return _compiled(file, _read_compiled(file), with_files=False)
    return _compiled(file, read_spec(file, file), with_files=False)


def find_world(path: str | Path) -> Path:
    """The file at `path`, or of the bundled world of that name.

    Raises:
        SceneError: there is no such file, or it is a folder.
    """
    file = Path(path)
    if file.is_file():
        return file
    if str(path) in world_names():
        return world_path(str(path))
    what = "a folder, not a file" if file.is_dir() else "no such file"
    raise SceneError(
        f"{path}: {what}; give an MJCF file (.xml, .zip, .mjb) or one of the bundled worlds: "
        + ", ".join(world_names())
    )


def _compiled(path: Path, spec: mujoco.MjSpec, *, with_files: bool) -> Source:
    refuse_enormous(spec, path)
    model, data = compile_spec(spec, path)
    changed, warnings = embed_assets(spec, model, with_files=with_files)
    if changed:
        model, data = compile_spec(spec, path)
    return Source(path, spec, model, data, warnings)


def _unpacked(file: Path, folder: Path) -> Path:
    """The MJCF file of a zip, unpacked with everything beside it."""
    try:
        with zipfile.ZipFile(file) as archive:
            size = sum(item.file_size for item in archive.infolist())
            if size > MAX_ZIP_BYTES:
                raise SceneError(f"{file} unpacks to {size} bytes, beyond {MAX_ZIP_BYTES}")
            archive.extractall(folder)
    except (zipfile.BadZipFile, OSError, RuntimeError, NotImplementedError) as error:
        raise SceneError(f"{file} cannot be unpacked: {one_line(error)}") from error
    found = sorted(folder.rglob("*.xml"))
    for name in (file.with_suffix(".xml").name, "scene.xml"):
        named = [path for path in found if path.name == name]
        found = named if len(named) == 1 else found
    if len(found) != 1:
        names = ", ".join(str(path.relative_to(folder)) for path in found) or "none"
        raise SceneError(
            f"{file} must hold one MJCF file, or one named scene.xml or like itself; it has {names}"
        )
    return found[0]


def _read_compiled(file: Path) -> mujoco.MjSpec:
    with mujoco_warnings() as notes:
        try:
            model = mujoco.MjModel.from_binary_path(str(file))
        except (ValueError, mujoco.FatalError, OSError, TypeError) as error:
            reason = "; ".join([one_line(error), *notes])
            raise SceneError(
                f"{file} is no model compiled by MuJoCo {mujoco.__version__}: {reason}"
            ) from error
    try:
        return decompiled(model)
    except SceneError as error:
        raise SceneError(f"{file}: {error}") from error
