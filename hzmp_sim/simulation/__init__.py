"""The closed loop in MuJoCo: controllers, contact audit, metrics."""

from hzmp_sim.simulation.path_audit import Audit as Audit
from hzmp_sim.simulation.path_audit import audit as audit
from hzmp_sim.simulation.pipeline import simulate as simulate
from hzmp_sim.simulation.tube import clearance_for as clearance_for
from hzmp_sim.simulation.tube import tracking_tube as tracking_tube

__all__ = ["Audit", "audit", "clearance_for", "simulate", "tracking_tube"]
