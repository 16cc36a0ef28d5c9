"""What the planner takes for granted of each thing that moves, in words."""

from __future__ import annotations

from hzmp_sim.motion.resolve import driven_bodies
from hzmp_sim.scene import Scene
from hzmp_sim.scene.bodies import carriers
from hzmp_sim.settings import Replanning


def assumption(scene: Scene, geom: int, loop: Replanning) -> str:
    """How a moving geom is predicted as long as it does as assumed.

    Args:
        scene: the world.
        geom: id of the geom.
        loop: what is assumed of what is not announced.
    """
    model, own = scene.model, int(scene.model.geom_bodyid[geom])
    driven = {} if scene.motion is None else driven_bodies(scene.motion, model)
    motions = [driven[body] for body in carriers(model, own) if body in driven]
    if not motions:
        return "nothing but MuJoCo's dynamics moves it"
    secret = [motion for motion in motions if not motion.announced]
    if secret:
        return (
            f"{secret[0].describe()} is not announced: it goes on as it was seen, with at most "
            f"{loop.prediction_acceleration:g} m/s² of acceleration, until its velocity has "
            f"changed by {loop.prediction_speed_change:g} m/s"
        )
    if motions[0].kind == "actuator":
        return f"{motions[0].describe()} gets the input that was announced"
    return f"{motions[0].describe()} moves as announced"
