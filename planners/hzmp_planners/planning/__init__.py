"""HZ-MP: paths through leaves, and the proofs that come with them."""

from hzmp_planners.planning.hzmp import plan as plan
from hzmp_planners.planning.plan import Plan as Plan
from hzmp_planners.planning.plan import PlanStatus as PlanStatus
from hzmp_planners.planning.verify import Verification as Verification
from hzmp_planners.planning.verify import verify as verify

__all__ = ["Plan", "PlanStatus", "Verification", "plan", "verify"]
