"""What a run proves or measured, and under which assumptions."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from hzmp_planners.planning import PlanStatus
from hzmp_sim.output.headline import number, percent

if TYPE_CHECKING:
    from hzmp_sim.run import Run


class Claim(NamedTuple):
    """One statement about a run."""

    kind: str
    """ "proved" or "measured"."""
    holds: bool
    statement: str
    assumptions: str


def claims(run: Run) -> list[Claim]:
    """The statements that this run supports, proofs first."""
    found = [*_plan_claims(run)]
    m, scene = run.metrics, run.scene
    if run.trajectory is not None:
        value = float(run.trajectory.containment)
        found.append(
            Claim(
                "proved",
                value <= 0.0,
                f"At every instant the reference stays in its convex cells: the largest signed "
                f"distance to a facet is {number(value)} m (at most 0 is inside).",
                "Extrema of each cubic piece against each facet in closed form, in double "
                "precision. It is the reference that is proved; the flown way differs by the "
                f"tracking error, at most {number(m.get('tracking_error_max_m'))} m here.",
            )
        )
    if run.flight_plan is not None:
        unproved = float(m["unproved_s"])
        broken = ", ".join(one["geom"] for one in m["broken_predictions"])
        found.append(
            Claim(
                "proved",
                unproved == 0.0 and not broken,
                "At every instant the body had a trajectory that ends at rest, clear of everything "
                f"that moves; {number(unproved)} s were flown without one."
                + (f" What was assumed of {broken} did not hold." if broken else ""),
                "Of what moves as it was predicted: by its script and MuJoCo's own dynamics, or by "
                "what was seen of it with an uncertainty that grows; until the guard time after "
                "the body has come to rest. Bezier points of each piece against planes of what "
                "each geom sweeps in 50 ms.",
            )
        )
    if run.log is not None:
        hits, steps = int(m["collision_steps"]), len(run.log.time)
        found.append(
            Claim(
                "measured",
                hits == 0,
                f"MuJoCo reported the body in penetrating contact at {hits} of {steps} physics "
                f"steps; the smallest distance to an obstacle was "
                f"{number(m.get('min_clearance_m'))} m ({scene.clearance:g} m was planned).",
                "Contacts and distances of the colliding geoms at each physics step, not between "
                f"steps. The flight was disturbed by {m.get('disturbed_by') or 'nothing'}.",
            )
        )
    return found


def _plan_claims(run: Run) -> list[Claim]:
    plan, scene = run.plan, run.scene
    verified = bool(run.metrics["plan_verified"])
    model = (
        f"The body is {scene.shape.describe()}, "
        f"kept {scene.clearance:g} m from obstacles; each obstacle is a convex polytope "
        f"around the geom, at most {number(scene.tolerance)} m too large."
    )
    if plan.status is PlanStatus.INFEASIBLE:
        return [
            Claim(
                "proved",
                verified,
                "No path exists: start and goal lie in parts of the free space that no shared "
                "face of two leaves connects.",
                model + " A body that fits only when turned, or without the clearance, may pass.",
            )
        ]
    if plan.status is PlanStatus.TIME_LIMIT:
        return []
    return [
        Claim(
            "proved",
            verified,
            f"No path is shorter than {number(plan.lower_bound)} m, so this one of "
            f"{number(plan.cost)} m is too long by {percent(plan.gap)} % at most"
            + (", among what does not move." if scene.moving else "."),
            model + " Length of the centre's path, in double precision; the evidence was "
            f"checked anew, with a largest residual of {number(run.metrics['plan_residual_m'])} m.",
        )
    ]
