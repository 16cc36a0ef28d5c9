"""Places nearby that nothing comes to for a while: where to wait when the way is blocked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space import FreeSpace

if TYPE_CHECKING:
    from hzmp_sim.motion.source import Slabs

_RINGS = (0.35, 0.7, 1.4, 2.8)  # [m]
_ANGLES = {2: 12, 3: 26}
_MARGIN = 0.02  # [m] to what is swept


def refuges(space: FreeSpace, slabs: Slabs, position: Floats, most: int) -> Floats:
    """Points around a position that are free now and for as long as is predicted, nearest first.

    Args:
        space: of the static obstacles.
        slabs: where the centre must not be.
        position: shape (n,) [m].
        most: how many points.

    Returns:
        Shape (k, n) [m], k <= most.
    """
    directions = _around(space.n)
    points = np.concatenate([[position], *(position + ring * directions for ring in _RINGS)])
    points = points[space.contains(points)]
    if slabs.b.size and len(points):
        heights = np.einsum("kn,gfn->kgf", points, slabs.A)
        apart = (heights[None] - slabs.b[:, None]).max(axis=3)  # slab, point, obstacle
        points = points[(apart > _MARGIN).all(axis=(0, 2))]
    return points[:most]


def _around(n: int) -> Floats:
    if n == 2:
        angle = np.linspace(0.0, 2.0 * np.pi, _ANGLES[2], endpoint=False)
        return np.column_stack([np.cos(angle), np.sin(angle)])
    grid = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    grid = grid[np.abs(grid).any(axis=1)]
    return np.asarray(grid / np.linalg.norm(grid, axis=1, keepdims=True))
