"""MJCF in, convex obstacles of the body's centre out."""

from hzmp_sim.scene.body_shape import BodyShape as BodyShape
from hzmp_sim.scene.decomposition import ConvexDecomposition as ConvexDecomposition
from hzmp_sim.scene.decomposition import PieceReport as PieceReport
from hzmp_sim.scene.load import load_scene as load_scene
from hzmp_sim.scene.scene import GeomReport as GeomReport
from hzmp_sim.scene.scene import Scene as Scene

__all__ = ["BodyShape", "ConvexDecomposition", "GeomReport", "PieceReport", "Scene", "load_scene"]
