"""Non-convex meshes become convex pieces that physics and planner share."""

from hzmp_sim.scene.decomposition.pieces import Decomposition as Decomposition
from hzmp_sim.scene.decomposition.pieces import PieceReport as PieceReport
from hzmp_sim.scene.decomposition.pieces import decompose_meshes as decompose_meshes
from hzmp_sim.scene.decomposition.settings import ConvexDecomposition as ConvexDecomposition

__all__ = ["ConvexDecomposition", "Decomposition", "PieceReport", "decompose_meshes"]
