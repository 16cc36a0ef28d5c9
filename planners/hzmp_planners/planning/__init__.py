"""HZ-MP: paths through leaves, and the proofs that come with them."""

from hzmp_planners.planning.planner import plan as plan
from hzmp_planners.planning.result import Plan as Plan
from hzmp_planners.planning.result import PlanStatus as PlanStatus
from hzmp_planners.planning.verification import Verification as Verification
from hzmp_planners.planning.verification import verify as verify

__all__ = ["Plan", "PlanStatus", "Verification", "plan", "verify"]
