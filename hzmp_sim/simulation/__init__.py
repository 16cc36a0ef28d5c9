"""The closed loop in MuJoCo: controllers, contact audit, metrics."""

from hzmp_sim.simulation.path_audit import Audit as Audit
from hzmp_sim.simulation.path_audit import audit as audit
from hzmp_sim.simulation.pipeline import simulate as simulate

__all__ = ["Audit", "audit", "simulate"]
