"""HZ-MP: paths through leaves, and the proofs that come with them."""

from hzmp_planners.planning.attempt import Improvement as Improvement
from hzmp_planners.planning.planner import Planner as Planner
from hzmp_planners.planning.planner import plan as plan
from hzmp_planners.planning.queries.any_of import Choice as Choice
from hzmp_planners.planning.queries.any_of import plan_any as plan_any
from hzmp_planners.planning.queries.corridors import plan_corridors as plan_corridors
from hzmp_planners.planning.queries.many import plan_many as plan_many
from hzmp_planners.planning.result import Plan as Plan
from hzmp_planners.planning.result import PlanStatus as PlanStatus
from hzmp_planners.planning.verification import Verification as Verification
from hzmp_planners.planning.verification import verify as verify

__all__ = [
    "Choice",
    "Improvement",
    "Plan",
    "PlanStatus",
    "Planner",
    "Verification",
    "plan",
    "plan_any",
    "plan_corridors",
    "plan_many",
    "verify",
]
