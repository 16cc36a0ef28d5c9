"""Trajectories in time and the controllers that follow them. Knows nothing of MuJoCo."""

from hzmp_tracking.controllers import (
    BodyState,
    Controller,
    PointController,
    QuadrotorController,
    Reference,
)
from hzmp_tracking.flatness import RotorDemand, RotorLimits, rotor_demand
from hzmp_tracking.limits import Limits
from hzmp_tracking.safe_stop import stop_trajectory
from hzmp_tracking.timing import quick_trajectory, time_parameterize
from hzmp_tracking.trajectory import Sample, Trajectory

__all__ = [
    "BodyState",
    "Controller",
    "Limits",
    "PointController",
    "QuadrotorController",
    "Reference",
    "RotorDemand",
    "RotorLimits",
    "Sample",
    "Trajectory",
    "quick_trajectory",
    "rotor_demand",
    "stop_trajectory",
    "time_parameterize",
]
