"""Checking a choice among starts and goals: the bound of each case, and that none is missed."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.constants import MEMBERSHIP_TOL
from hzmp_planners.planning.queries.any_of import Case, Choice
from hzmp_planners.planning.queries.targets import Target, entrances
from hzmp_planners.planning.result import Plan
from hzmp_planners.sets import Polytope

_SAMPLES = 100  # points of each goal region


def case_bound(case: Case, proved: Callable[[Plan], float], known: dict[int, float]) -> float:
    """The lower bound that a case's evidence supports [m].

    Args:
        case: a start and a target.
        proved: the bound that a plan's evidence supports.
        known: those of plans asked about before, by their `id`: cases share plans.
    """
    corners, start, plan = case.target.corners, case.start, case.plan
    toward = case.target.nearest(start) - start
    length = float(np.linalg.norm(toward))
    straight = float(((corners - start) @ toward).min()) / length if length > 0.0 else 0.0
    if plan is None or not np.array_equal(plan.start, start):
        return straight
    space = plan.space
    tol = 4.0 * MEMBERSHIP_TOL * space.scale
    leaves = [space.leaf(leaf) for leaf in space.leaves_at(plan.goal).tolist()]
    if not any(leaf.contains(corners, tol).all() for leaf in leaves):
        return straight
    if id(plan) not in known:
        known[id(plan)] = proved(plan)
    farthest = max(math.dist(corner, plan.goal) for corner in corners.tolist())
    return max(straight, known[id(plan)] - farthest)


def wrong_ends(choice: Choice, plan: Plan) -> float:
    """How far the ends of a path are from the starts and goals [m]."""
    off = float(np.linalg.norm(choice.starts - plan.start, axis=1).min())
    away = [
        float(goal.violation(plan.goal)[0])
        if isinstance(goal, Polytope)
        else math.dist(goal, plan.goal)
        for goal in choice.goals
    ]
    return max(off, min(away))


def missed_goal(choice: Choice) -> float:
    """How far a goal that a start may reach is from all targets of that start [m].

    Goals are sampled. What is smaller than the samples are dense is found by its measure: the parts
    of each entrance of a region add up to it; inf where they do not.
    """
    rng = np.random.default_rng(0)
    space = choice.space
    sampled = np.concatenate([_points(goal, rng) for goal in choice.goals])
    free = sampled[space.contains(sampled)]
    regions = [goal for goal in choice.goals if isinstance(goal, Polytope)]
    whole = [entrance for region in regions for entrance in entrances(space, region)]
    worst = 0.0
    for start in choice.starts:
        targets = [case.target for case in choice.cases if np.array_equal(case.start, start)]
        if any(region.contains(start)[0] for region in regions):
            worst = max(worst, _apart(start, targets))
            continue
        worst = max([worst, *(_apart(point, targets) for point in free)])
        parts = {target.corners.tobytes(): target for target in targets}
        tol = MEMBERSHIP_TOL * space.scale
        for entrance in whole:
            held = [t.measure for t in parts.values() if _apart(t.centre, [entrance]) <= tol]
            if sum(held) < entrance.measure * (1.0 - 1e-9):
                return math.inf
    return worst


def _apart(point: Floats, targets: list[Target]) -> float:
    """Distance from a point to the nearest of some targets [m]; inf without any."""
    nearest = math.inf
    for target in targets:
        centre = target.centre
        if math.dist(centre, point) - target.farthest(centre) < nearest:
            nearest = min(nearest, math.dist(target.nearest(point), point))
    return nearest


def _points(goal: Polytope | Floats, rng: np.random.Generator) -> Floats:
    """A goal point; or points of a region where a path may enter it, shape (k, n) [m]."""
    if not isinstance(goal, Polytope):
        return goal[None]
    inner = goal.sample(_SAMPLES, rng)
    if goal.affine_dimension() < goal.n:
        return inner
    directions = rng.normal(size=inner.shape)
    slope, room = directions @ goal.A.T, goal.b - inner @ goal.A.T
    steps = np.where(slope > 0.0, room / np.where(slope > 0.0, slope, 1.0), np.inf).min(axis=1)
    return np.asarray(inner + steps[:, None] * directions)
