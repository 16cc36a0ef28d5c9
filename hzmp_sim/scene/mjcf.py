"""Reading and compiling MJCF files; MuJoCo's messages become one line."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from hzmp_planners.errors import SceneError
from hzmp_sim.mujoco_warnings import mujoco_warnings
from hzmp_sim.worlds import world_names, world_path


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
        f"{path}: {what}; give an MJCF file or one of the bundled worlds: "
        + ", ".join(world_names())
    )


def read_spec(file: Path) -> mujoco.MjSpec:
    """The editable model of an MJCF file, its asset folders made absolute.

    Raises:
        SceneError: the file cannot be read or parsed.
    """
    with mujoco_warnings() as notes:
        try:
            spec = mujoco.MjSpec.from_file(str(file))
        except (ValueError, mujoco.FatalError, OSError, UnicodeError) as error:
            raise SceneError(f"{file}: {one_line(error)}") from error
    for note in notes:
        if "NaN" in note:  # MuJoCo only warns, and goes on with a default value
            raise SceneError(f"{file}: {note}")
    # The world of a run is written elsewhere and must still find its meshes and textures.
    folder = file.resolve().parent
    spec.meshdir = str(folder / spec.meshdir)
    spec.texturedir = str(folder / spec.texturedir)
    return spec


def compile_spec(spec: mujoco.MjSpec, file: Path) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The compiled model, and data at its initial state with all poses computed.

    Raises:
        SceneError: MuJoCo refuses the model.
    """
    try:
        with mujoco_warnings():  # told once, by `written_world`
            model = spec.compile()
    except (ValueError, mujoco.FatalError, OSError) as error:
        raise SceneError(f"{file}: {one_line(error)}") from error
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


@dataclass(frozen=True, eq=False)
class World:
    """A compiled world and the text it was compiled from."""

    model: mujoco.MjModel
    data: mujoco.MjData
    """At the initial state, with all poses computed."""
    xml: str
    warnings: tuple[str, ...]


def written_world(spec: mujoco.MjSpec, file: Path) -> World:
    """The world as one MJCF text, and the model compiled from that text.

    MuJoCo writes six digits, so the model of the text is not quite that of the spec: what is flown
    must be what is written. Meshes from files are written into the text, unless they carry texture
    coordinates, which MJCF text cannot hold: those stay files, by absolute path.
    If the text does not compile, the model is that of the spec, with a warning.
    """
    with mujoco_warnings() as notes:
        world = _written(spec, file)
    return replace(world, warnings=(*world.warnings, *notes))


def _written(spec: mujoco.MjSpec, file: Path) -> World:
    model, data = compile_spec(spec, file)
    if any(_embed(mesh, model) for mesh in spec.meshes):
        model, data = compile_spec(spec, file)
    text = spec.to_xml()
    try:
        written = mujoco.MjModel.from_xml_string(text)
    except (ValueError, mujoco.FatalError) as error:
        warning = f"MuJoCo cannot read back the world it wrote: {one_line(error)}"
        return World(model, data, text, (warning,))
    data = mujoco.MjData(written)
    mujoco.mj_kinematics(written, data)
    return World(written, data, text, ())


def _embed(mesh: mujoco.MjsMesh, model: mujoco.MjModel) -> bool:
    """Put the compiled vertices and faces of a mesh file into the spec; False if left alone."""
    number = mujoco.mj_name2id(model, int(mujoco.mjtObj.mjOBJ_MESH), mesh.name)
    if not mesh.file or number < 0 or model.mesh_texcoordadr[number] >= 0:
        return False
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[number])
    start, count = int(model.mesh_vertadr[number]), int(model.mesh_vertnum[number])
    vertices = np.array(model.mesh_vert[start : start + count], dtype=np.float64)
    first, faces = int(model.mesh_faceadr[number]), int(model.mesh_facenum[number])
    # Compilation centred and turned the mesh and applied scale and reference pose: undo the first.
    mesh.uservert = (vertices @ turn.reshape(3, 3).T + model.mesh_pos[number]).ravel()
    mesh.userface = np.array(model.mesh_face[first : first + faces]).ravel()
    mesh.file, mesh.scale, mesh.refpos, mesh.refquat = "", [1, 1, 1], [0, 0, 0], [1, 0, 0, 0]
    return True


def one_line(error: Exception) -> str:
    """A MuJoCo message without line breaks and repeated prefixes."""
    if broken := re.search(r"XML parse error.*Line number=(\d+)", str(error), re.DOTALL):
        return f"not well-formed XML near line {broken[1]}"
    text = ", ".join(" ".join(line.split()) for line in str(error).splitlines() if line.strip())
    for prefix in ("XML Error: ", "Error: "):
        text = text.removeprefix(prefix)
    text = text.replace("Element name '', ", "").replace("Element ", "element ").rstrip(": ")
    if "unrecognized element" in text and "'composite'" in text:
        text += " (MuJoCo 4 has no composite; use replicate or flexcomp)"
    return text or type(error).__name__
