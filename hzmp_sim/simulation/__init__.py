"""The closed loop in MuJoCo: controllers, contact audit, metrics."""

from hzmp_sim.simulation.simulate import simulate as simulate

__all__ = ["simulate"]
