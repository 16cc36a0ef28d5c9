"""Motion planning with hybrid zonotopes, closed in a MuJoCo loop: plans with proofs."""

from hzmp_planners.errors import HzmpError as HzmpError
from hzmp_planners.errors import LimitError as LimitError
from hzmp_planners.errors import QueryError as QueryError
from hzmp_planners.errors import SceneError as SceneError
from hzmp_planners.errors import ShapeError as ShapeError
from hzmp_planners.errors import SolverError as SolverError
from hzmp_planners.free_space import FreeSpace as FreeSpace
from hzmp_planners.free_space import LeafGraph as LeafGraph
from hzmp_planners.free_space import SharedFace as SharedFace
from hzmp_planners.planning import Choice as Choice
from hzmp_planners.planning import Improvement as Improvement
from hzmp_planners.planning import Plan as Plan
from hzmp_planners.planning import Planner as Planner
from hzmp_planners.planning import PlanStatus as PlanStatus
from hzmp_planners.planning import plan as plan
from hzmp_planners.planning import plan_any as plan_any
from hzmp_planners.planning import plan_corridors as plan_corridors
from hzmp_planners.planning import plan_many as plan_many
from hzmp_planners.planning import verify as verify
from hzmp_planners.sets import Activity as Activity
from hzmp_planners.sets import ConstrainedConvexGenerator as ConstrainedConvexGenerator
from hzmp_planners.sets import ConstrainedZonotope as ConstrainedZonotope
from hzmp_planners.sets import Contact as Contact
from hzmp_planners.sets import ContactKind as ContactKind
from hzmp_planners.sets import Ellipsotope as Ellipsotope
from hzmp_planners.sets import HybridZonotope as HybridZonotope
from hzmp_planners.sets import Polytope as Polytope
from hzmp_planners.sets import Zonotope as Zonotope
from hzmp_planners.sets import contact as contact
from hzmp_sim.motion.drives import Drives as Drives
from hzmp_sim.motion.paths import Callback as Callback
from hzmp_sim.motion.paths import Circle as Circle
from hzmp_sim.motion.paths import Swing as Swing
from hzmp_sim.motion.prediction import Prediction as Prediction
from hzmp_sim.motion.prediction import Predictor as Predictor
from hzmp_sim.motion.reading import read_motion as read_motion
from hzmp_sim.motion.script import Goal as Goal
from hzmp_sim.motion.script import Motion as Motion
from hzmp_sim.motion.script import MotionScript as MotionScript
from hzmp_sim.motion.source import Slabs as Slabs
from hzmp_sim.motion.waypoints import Keyframes as Keyframes
from hzmp_sim.motion.waypoints import Waypoints as Waypoints
from hzmp_sim.run import FlightLog as FlightLog
from hzmp_sim.run import Run as Run
from hzmp_sim.scene import ConvexDecomposition as ConvexDecomposition
from hzmp_sim.scene import Scene as Scene
from hzmp_sim.scene import load_scene as load_scene
from hzmp_sim.settings import Disturbance as Disturbance
from hzmp_sim.settings import Replanning as Replanning
from hzmp_sim.settings import RunSettings as RunSettings
from hzmp_sim.simulation import Audit as Audit
from hzmp_sim.simulation import audit as audit
from hzmp_sim.simulation import simulate as simulate
from hzmp_sim.simulation import tracking_tube as tracking_tube
from hzmp_tracking import Limits as Limits
from hzmp_tracking import RotorLimits as RotorLimits
from hzmp_tracking import Trajectory as Trajectory
from hzmp_tracking import rotor_demand as rotor_demand
from hzmp_tracking import stop_trajectory as stop_trajectory
from hzmp_tracking import time_parameterize as time_parameterize

__version__ = "0.1.0"

__all__ = [
    "Activity",
    "Audit",
    "Callback",
    "Choice",
    "Circle",
    "ConstrainedConvexGenerator",
    "ConstrainedZonotope",
    "Contact",
    "ContactKind",
    "ConvexDecomposition",
    "Disturbance",
    "Drives",
    "Ellipsotope",
    "FlightLog",
    "FreeSpace",
    "Goal",
    "HybridZonotope",
    "HzmpError",
    "Improvement",
    "Keyframes",
    "LeafGraph",
    "LimitError",
    "Limits",
    "Motion",
    "MotionScript",
    "Plan",
    "PlanStatus",
    "Planner",
    "Polytope",
    "Prediction",
    "Predictor",
    "QueryError",
    "Replanning",
    "RotorLimits",
    "Run",
    "RunSettings",
    "Scene",
    "SceneError",
    "ShapeError",
    "SharedFace",
    "Slabs",
    "SolverError",
    "Swing",
    "Trajectory",
    "Waypoints",
    "Zonotope",
    "__version__",
    "audit",
    "contact",
    "load_scene",
    "plan",
    "plan_any",
    "plan_corridors",
    "plan_many",
    "read_motion",
    "rotor_demand",
    "simulate",
    "stop_trajectory",
    "time_parameterize",
    "tracking_tube",
    "verify",
]
