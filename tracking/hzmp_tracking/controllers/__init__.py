"""Feedback laws from a reference to actuator commands; plain floats, no simulator."""

from hzmp_tracking.controllers.base import BodyState, Controller, Reference
from hzmp_tracking.controllers.capability import REFERENCE_SHARE, rotor_limits
from hzmp_tracking.controllers.mixer import Mixer
from hzmp_tracking.controllers.observer import DisturbanceObserver
from hzmp_tracking.controllers.point import PointController
from hzmp_tracking.controllers.quadrotor import QuadrotorController

__all__ = [
    "REFERENCE_SHARE",
    "BodyState",
    "Controller",
    "DisturbanceObserver",
    "Mixer",
    "PointController",
    "QuadrotorController",
    "Reference",
    "rotor_limits",
]
