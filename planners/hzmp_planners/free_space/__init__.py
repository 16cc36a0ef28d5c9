"""Obstacles in, convex leaves and their shared faces out."""

from hzmp_planners.free_space.free_space import FreeSpace as FreeSpace
from hzmp_planners.free_space.leaf_graph import LeafGraph as LeafGraph
from hzmp_planners.free_space.leaf_graph import SharedFace as SharedFace

__all__ = ["FreeSpace", "LeafGraph", "SharedFace"]
