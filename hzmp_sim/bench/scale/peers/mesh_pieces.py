"""Off the shelf: free space as one mesh by booleans (manifold3d), cut into hulls by CoACD.

CoACD (Wei et al. 2022) is made for collision shapes: its pieces are hulls that approximate the
mesh up to a threshold, so they may reach into obstacles. By how much is measured exactly, with
booleans.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from hzmp_sim.bench.scale.cover import union_volume
from hzmp_sim.bench.worlds import WorldSpec

THRESHOLD = 0.1
"""Concavity that CoACD lets pass. With its default, 0.05, three obstacles took three minutes."""


def measure_mesh_pieces(spec: Mapping[str, Any], limit: float) -> dict[str, Any]:
    """Subtract the obstacles of a 3-D world from its workspace and let CoACD cut the rest.

    Args:
        spec: fields of a `WorldSpec`.
        limit: the caller ends this process after it [s].

    Returns:
        Some fields of a `PeerResult`.
    """
    meshes: Any = importlib.import_module("manifold3d")
    coacd: Any = importlib.import_module("coacd")
    body, add = meshes.Manifold, meshes.OpType.Add
    world = WorldSpec(**spec).make()
    began = time.perf_counter()
    hulls = [body.hull_points(block.vertices()) for block in world.obstacles]
    solid = body.batch_boolean(hulls, add)
    room = body.cube((world.hi - world.lo).tolist()).translate(world.lo.tolist())
    free = room - solid
    mesh = free.to_mesh64()
    cut = time.perf_counter()
    coacd.set_log_level("error")
    surface = coacd.Mesh(
        np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, dtype=np.int32)
    )
    pieces = coacd.run_coacd(surface, threshold=THRESHOLD)
    spent = time.perf_counter()
    cover = body.batch_boolean([body.hull_points(np.array(points)) for points, _ in pieces], add)
    volume = float(free.volume())
    known = float(np.prod(world.hi - world.lo)) - union_volume(world.lo, world.hi, world.obstacles)
    return {
        "pieces": len(pieces),
        "seconds": spent - began,
        "lost": float((free - cover).volume()) / volume,
        "leaked": float((cover ^ solid).volume()) / volume,
        "note": f"booleans alone {1e3 * (cut - began):.1f} ms, for a mesh of "
        f"{free.num_tri():,} triangles with its volume off by {abs(volume / known - 1.0):.0e}",
    }
