"""Running CoACD where it can neither crash this process, nor hang it, nor write on its screen."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.errors import SceneError
from hzmp_sim.scene.decomposition.settings import ConvexDecomposition

_WORKER = Path(__file__).with_name("worker.py")


def run_coacd(
    name: str,
    vertices: Floats,
    faces: Ints,
    settings: ConvexDecomposition,
    *,
    worker: Path = _WORKER,
) -> list[Floats]:
    """Corners (k, 3) of the convex pieces of a mesh [m].

    Args:
        name: of the mesh, for messages.
        vertices: shape (v, 3) [m].
        faces: vertex indices, shape (f, 3).
        settings: how to cut.
        worker: the script that is run.

    Raises:
        SceneError: CoACD took too long, crashed, or found no piece.
    """
    with tempfile.TemporaryDirectory(prefix="hzmp-sim-") as folder:
        arguments, mesh, pieces = (
            str(Path(folder, part)) for part in ("arguments.json", "mesh.npz", "pieces.npz")
        )
        Path(arguments).write_text(json.dumps(settings.coacd_arguments()), encoding="utf-8")
        np.savez(mesh, vertices=vertices, faces=faces.astype(np.int32))
        try:
            # -P: the worker's folder is not searched for imports. `run` ends the worker when it
            # is itself ended, by the limit or by Ctrl-C.
            done = subprocess.run(
                [sys.executable, "-P", str(worker), arguments, mesh, pieces],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                timeout=settings.time_limit,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise SceneError(
                f"mesh {name!r}: CoACD found no pieces in {settings.time_limit:g} s; give it "
                "longer or a larger threshold (--coacd.time-limit, --coacd.threshold), or a "
                f"simpler mesh than this of {len(faces):,} faces"
            ) from error
        found = read_pieces(Path(pieces)) if done.returncode == 0 else []
    if not found:
        raise SceneError(
            f"mesh {name!r}: CoACD {_why(done.returncode, done.stderr)}; repair the mesh, try "
            "--coacd.preprocess on, or leave it as its hull (without --convex-decomposition)"
        )
    return found


def read_pieces(file: Path) -> list[Floats]:
    """The pieces that the worker wrote.

    Raises:
        OSError, ValueError, KeyError, zipfile.BadZipFile: it is no such file.
    """
    # Opened here: numpy leaves a damaged file open.
    with file.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
        vertices, counts = arrays["vertices"], arrays["counts"]
    if vertices.shape != (counts.sum(), 3) or not np.isfinite(vertices).all():
        raise ValueError(f"{file} does not hold the corners of convex pieces")
    return [np.array(part) for part in np.split(vertices, np.cumsum(counts)[:-1]) if len(part)]


def _why(code: int, said: bytes) -> str:
    if code == 0:
        return "found no pieces"
    if code < 0:
        return f"crashed (signal {-code})"
    lines = said.decode(errors="replace").strip().splitlines()
    return f"failed ({lines[-1] if lines else f'exit code {code}'})"
