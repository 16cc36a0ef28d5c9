"""The planner of the HZ-MP paper (Xie, Betz and Alanwar 2026), step by step beside the paper.

`algorithm` is its algorithm 1, `reachable` its algorithm 2; each other module is one of the steps
that they name. `hzmp_planners.planning.plan(..., method="paper")` runs it.
"""

from hzmp_planners.planning.paper.settings import Iteration as Iteration
from hzmp_planners.planning.paper.settings import PaperSettings as PaperSettings

__all__ = ["Iteration", "PaperSettings"]
