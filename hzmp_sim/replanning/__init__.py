"""The planner in the loop: what moves is predicted, and every plan taken ends at rest, proved."""

from __future__ import annotations

from hzmp_sim.replanning.guided import replanning_guide
from hzmp_sim.replanning.records import FlightPlan, PlanRecord
from hzmp_sim.replanning.replanner import Replanner

__all__ = ["FlightPlan", "PlanRecord", "Replanner", "replanning_guide"]
