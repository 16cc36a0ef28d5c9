"""From a scene in which something moves to the stages of its loop."""

from __future__ import annotations

import mujoco

from hzmp_planners._arrays import Floats
from hzmp_planners.errors import QueryError
from hzmp_planners.free_space import FreeSpace
from hzmp_sim.motion.drives import Drives
from hzmp_sim.motion.forecast import Forecaster, NothingMoves
from hzmp_sim.motion.prediction import Predictor
from hzmp_sim.replanning.candidates import Dynamics
from hzmp_sim.replanning.goals import Goals
from hzmp_sim.replanning.pilot import Pilot
from hzmp_sim.replanning.replanner import Replanner
from hzmp_sim.scene import Scene
from hzmp_sim.scene.placement import check_inside
from hzmp_sim.settings import RunSettings
from hzmp_sim.simulation.actuation_base import Actuation


def replanning_guide(
    scene: Scene, space: FreeSpace, actuation: Actuation, settings: RunSettings
) -> tuple[Replanner, Drives]:
    """The guide of a flight among what moves in a scene, and what drives that.

    Args:
        scene: the world.
        space: free space of what does not move.
        actuation: of the body, which says what it can follow.
        settings: of the run.

    Raises:
        QueryError: a goal of the motion script or the command line is not in the free space.
    """
    goals = Goals.of(scene)
    for position in goals.positions:
        _check_goal(position, space)
    # Boxes within the norms: what is planned in a hurry has bounds on axes only.
    limits = settings.limits(actuation.default_limits).inner(scene.n)
    pilot = Pilot(space, Dynamics(limits, scene.n), settings.replanning)
    predictor: Forecaster = NothingMoves(scene.n)
    if scene.moving:
        loop = settings.replanning
        predictor = Predictor(scene, loop.prediction_acceleration, loop.prediction_speed_change)
    drives = Drives(scene.model, scene.motion)
    data = mujoco.MjData(scene.model)
    data.qpos[:] = scene.initial_qpos
    drives.apply(data, 0.0)
    mujoco.mj_kinematics(scene.model, data)
    pilot.rehearse(scene.start, scene.goal, predictor.predict(data, 0.0))
    guide = Replanner(scene, space, pilot, predictor, goals, limits, settings, actuation.smoothing)
    return guide, drives


def _check_goal(position: Floats, space: FreeSpace) -> None:
    check_inside("goal", position, space.bounds)
    if space.leaf_of(position)[0] < 0:
        where = ", ".join(f"{value:g}" for value in position.tolist())
        raise QueryError(
            f"goal ({where}) is inside an obstacle, or nearer to it than the body and its clearance"
        )
