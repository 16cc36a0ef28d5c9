"""CoACD in a process of its own: `python worker.py ARGUMENTS.json MESH.npz PIECES.npz`.

Started as a file, not as a module: it needs numpy and coacd, and nothing of this package.
"""

import json
import sys

import coacd
import numpy as np


def main() -> None:
    """Read a mesh, write the corners of each piece and where each piece begins."""
    arguments, source, target = sys.argv[1:]
    with np.load(source) as mesh:
        surface = coacd.Mesh(mesh["vertices"], mesh["faces"])
    with open(arguments, encoding="utf-8") as file:
        settings = json.load(file)
    coacd.set_log_level("off")
    pieces = [np.asarray(points) for points, _ in coacd.run_coacd(surface, **settings)]
    np.savez(
        target,
        vertices=np.vstack([np.zeros((0, 3)), *pieces]),
        counts=np.array([len(points) for points in pieces], dtype=np.int64),
    )


if __name__ == "__main__":
    main()
