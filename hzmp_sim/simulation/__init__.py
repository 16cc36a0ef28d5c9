"""The closed loop in MuJoCo: controllers, contact audit, metrics."""

from hzmp_sim.simulation.pipeline import simulate as simulate

__all__ = ["simulate"]
