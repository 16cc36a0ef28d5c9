"""Reading and compiling MJCF files; MuJoCo's messages become one line."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco

from hzmp_planners.errors import SceneError
from hzmp_sim.mujoco_warnings import mujoco_warnings
from hzmp_sim.scene.precheck import check_files


def read_spec(file: Path, label: Path) -> mujoco.MjSpec:
    """The editable model of an MJCF file, its asset folders made absolute.

    Args:
        file: the MJCF file.
        label: what messages call it.

    Raises:
        SceneError: the file cannot be read or parsed.
    """
    check_files(file, label)
    with mujoco_warnings() as notes:
        try:
            spec = mujoco.MjSpec.from_file(str(file))
        except (ValueError, mujoco.FatalError, OSError, UnicodeError) as error:
            raise SceneError(f"{label}: {one_line(error)}") from error
    for note in notes:
        if "NaN" in note:  # MuJoCo only warns, and goes on with a default value
            raise SceneError(f"{label}: {note}")
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
    must be what is written. If the text does not compile, the model is that of the spec, with a
    warning.
    """
    with mujoco_warnings() as notes:
        world = _written(spec, file)
    return replace(world, warnings=(*world.warnings, *notes))


def _written(spec: mujoco.MjSpec, file: Path) -> World:
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


def one_line(error: Exception) -> str:
    """A MuJoCo message without line breaks and repeated prefixes."""
    if broken := re.search(r"XML parse error.*Line number=(\d+)", str(error), re.DOTALL):
        return f"not well-formed XML near line {broken[1]}"
    text = ", ".join(" ".join(line.split()) for line in str(error).splitlines() if line.strip())
    for prefix in ("XML Error: ", "Error: "):
        text = text.removeprefix(prefix)
    text = text.replace("Element name '', ", "").replace("Element ", "element ").rstrip(": ")
    if "model type: 'mujocoinclude'" in text:
        text += " (a part that other files include: give the file that does)"
    if "unrecognized element" in text and "'composite'" in text:
        text += " (MuJoCo 4 has no composite; use replicate or flexcomp)"
    return text or type(error).__name__
