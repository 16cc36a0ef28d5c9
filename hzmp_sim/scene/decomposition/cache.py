"""Pieces of meshes that were cut before, in the user's cache folder, by content."""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from importlib.metadata import version
from pathlib import Path

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_sim.scene.decomposition.coacd_process import read_pieces
from hzmp_sim.scene.decomposition.settings import ConvexDecomposition


def cache_folder() -> Path:
    """`$XDG_CACHE_HOME/hzmp-sim/pieces`, by default below `~/.cache` (XDG base directories)."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    root = Path(base) if os.path.isabs(base) else Path.home() / ".cache"
    return root / "hzmp-sim" / "pieces"


def cache_file(vertices: Floats, faces: Ints, settings: ConvexDecomposition) -> Path:
    """Where the pieces of this mesh by these settings and this version of CoACD are kept."""
    digest = hashlib.sha256()
    about = {"coacd": version("coacd"), **settings.coacd_arguments()}
    digest.update(json.dumps(about, sort_keys=True).encode())
    for array, kind in ((vertices, "<f8"), (faces, "<i4")):
        digest.update(f"{array.shape}".encode())
        digest.update(np.ascontiguousarray(array, dtype=kind).tobytes())
    return cache_folder() / f"{digest.hexdigest()}.npz"


def cached_pieces(file: Path) -> list[Floats] | None:
    """The pieces in a cache file; None when it is missing or damaged."""
    try:
        return read_pieces(file) or None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def keep_pieces(file: Path, pieces: list[Floats]) -> str:
    """Write a cache file, whole or not at all; returns why it could not be written, or ""."""
    from hzmp_sim.output.artifacts import OutputError, whole_file  # slow: brings all of the output

    try:
        with whole_file(file) as partial:
            np.savez(
                partial,
                vertices=np.vstack(pieces),
                counts=np.array([len(points) for points in pieces], dtype=np.int64),
            )
    except OutputError as error:
        return str(error)
    return ""
