"""Meshes too large to be read in reasonable time, refused before MuJoCo starts on them."""

from __future__ import annotations

import struct
from pathlib import Path

import mujoco
import numpy as np

from hzmp_planners.errors import SceneError

MAX_FACES = 1_000_000
"""A mesh of 1.3 million faces takes MuJoCo 17 s for each time that it compiles the world."""

_LEAST_BYTES = 8 * MAX_FACES  # "f 1 2 3\n": no smaller file holds so many faces
_CHUNK = 1 << 24


def refuse_enormous(spec: mujoco.MjSpec, file: Path) -> None:
    """Look at the size of a world's meshes without reading them as such.

    Args:
        spec: of the world, its mesh folder absolute.
        file: of the world, for the message.

    Raises:
        SceneError: a mesh has more than `MAX_FACES` faces.
    """
    for mesh in spec.meshes:
        faces = np.size(mesh.userface) // 3
        if mesh.file:
            faces = _faces(Path(spec.meshdir, mesh.file))
        if faces > MAX_FACES:
            where = f" ({Path(mesh.file).name})" if mesh.file else ""
            raise SceneError(
                f"{file}: mesh {mesh.name or Path(mesh.file).stem!r}{where} has {faces:,} faces, "
                f"more than {MAX_FACES:,}: simplify it first, its convex hull needs far fewer"
            )


def _faces(path: Path) -> int:
    """Faces of an OBJ or binary STL file; 0 for what is small, of another type, or not there."""
    if not path.is_file() or path.stat().st_size < _LEAST_BYTES:
        return 0
    with path.open("rb") as stream:
        if path.suffix.lower() == ".stl":
            header = stream.read(84)  # 80 bytes of anything, then the number of triangles
            return int(struct.unpack_from("<I", header, 80)[0])
        if path.suffix.lower() != ".obj":
            return 0
        count, last = 0, b"\n"
        while chunk := stream.read(_CHUNK):
            count += (last + chunk).count(b"\nf ")
            last = chunk[-2:]
        return count
