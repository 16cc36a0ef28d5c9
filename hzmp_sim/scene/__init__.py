"""MJCF in, convex obstacles of the body's centre out."""

from hzmp_sim.scene.load import load_scene as load_scene
from hzmp_sim.scene.scene import GeomReport as GeomReport
from hzmp_sim.scene.scene import Scene as Scene

__all__ = ["GeomReport", "Scene", "load_scene"]
