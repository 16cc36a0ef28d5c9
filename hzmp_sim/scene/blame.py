"""Why there is no path: whether the hulls of non-convex meshes are in the way."""

from __future__ import annotations

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space import FreeSpace
from hzmp_sim.scene.meshes import listed
from hzmp_sim.scene.scene import Scene


def connected(space: FreeSpace, start: Floats, goal: Floats) -> bool:
    """Whether shared faces lead from a leaf that holds start to one that holds goal, (n,) each."""
    return space.graph.connects(space.leaves_at(start), space.leaves_at(goal))


def blocking_hulls(scene: Scene, space: FreeSpace) -> str:
    """One line on the meshes whose hulls close the way from start to goal; "" if they do not.

    They do when start and goal are connected without them: the pieces of a mesh lie in its hull, so
    when even that does not help, cutting it into pieces cannot.

    Args:
        scene: as read.
        space: its free space, in which start and goal are apart.
    """
    dented = [mesh for mesh in scene.meshes if not mesh.convex]
    if not dented:
        return ""
    hulls = {geom for mesh in dented for geom in mesh.geoms}
    gone = {i: None for i, geom in enumerate(scene.obstacle_geoms) if geom in hulls}
    if not connected(space.with_obstacles(gone), scene.start, scene.goal):
        return ""
    names = listed([f"{mesh.name!r} ({mesh.loss})" for mesh in dented])
    what = f"mesh {names} is treated as its" if len(dented) == 1 else f"meshes {names} as their"
    return (
        f"{what} convex hull, as MuJoCo does, and without it there is a way: "
        "--convex-decomposition cuts it into convex pieces"
    )
