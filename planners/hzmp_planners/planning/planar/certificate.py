"""A bound for the plane that a few lines of arithmetic can check: potentials at corners.

If phi(z) - phi(x) <= |z - x| holds for any two of start, corners and goal that see each other, then
every path is at least phi(goal) - phi(start) long: sum it along the bends of the shortest one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Floats, Ints, frozen
from hzmp_planners.planning.planar.mesh import Mesh
from hzmp_planners.planning.planar.taut_search import TautSearch


@dataclass(frozen=True, eq=False)
class CornerCertificate:
    """Potentials at the corners that a path shorter than the bound may bend at.

    The potential of the start is 0, that of the goal the bound.
    """

    corners: Floats
    """Shape (C, 2) [m]."""
    leaves: Ints
    """A leaf at each corner, on the side where a path may bend, shape (C,)."""
    potentials: Floats
    """Shape (C,) [m]."""
    bound: float
    """No path is shorter [m]."""


def certify(mesh: Mesh, search: TautSearch, start: Floats, goal: Floats) -> CornerCertificate:
    """Potentials that prove the bound of a search.

    The length of the shortest string to a corner, but at most what the bound leaves for a straight
    way on to the goal: the search has found all corners for which that makes no difference.
    """
    ahead = np.linalg.norm(mesh.corners - start, axis=1)
    back = np.linalg.norm(mesh.corners - goal, axis=1)
    chosen = np.flatnonzero(ahead + back < search.bound)
    reached = np.array([search.reached.get(i, np.inf) for i in chosen.tolist()])
    return CornerCertificate(
        frozen(mesh.corners[chosen]),
        frozen(mesh.corner_leaves[chosen]),
        frozen(np.minimum(reached.reshape(-1), search.bound - back[chosen])),
        search.bound,
    )
