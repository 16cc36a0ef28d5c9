"""Checking a plan after the fact: path, length, leaves, bound and verdict."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners._linprog import minimize_linear
from hzmp_planners.constants import FACE_TOL, MEMBERSHIP_TOL, NORMAL_TOL, PLANE_TOL
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.checks.bounds import certified_bound
from hzmp_planners.planning.checks.cases import case_bound, missed_goal, wrong_ends
from hzmp_planners.planning.queries.any_of import Choice
from hzmp_planners.planning.result import Plan, PlanStatus, path_length
from hzmp_planners.sets import Polytope

_SAMPLES = 2000  # points of the workspace that must be in a leaf or in an obstacle


@dataclass(frozen=True)
class Verification:
    """Residuals of a plan's claims, recomputed; all are lengths [m], 0 is perfect."""

    residuals: dict[str, float]
    """`endpoints`, `path_outside_leaves`, `length`, `leaf_inside_obstacle`; `bound_excess`: how far
    the claimed bound exceeds the recomputed one; `gap_excess`: how much longer an OPTIMAL path is
    than its bound and the asked gap allow; `uncovered`: how far outside of all obstacles a
    sampled point is that is in no leaf; for an infeasible plan `missed_face`: width of a face that
    would connect what the plan calls separate, or overlap of a leaf with an obstacle, inf when the
    plan has a path after all. Of a choice also `ends`: how far the path's ends are from the starts
    and goals; `missed_goal`: how far a sampled goal is from those of all cases."""
    tolerance: float
    """What round-off explains [m]."""

    @property
    def ok(self) -> bool:
        """Whether every residual is within the tolerance."""
        return all(value <= self.tolerance for value in self.residuals.values())

    def describe(self) -> str:
        """One line for a person."""
        worst = max(self.residuals, key=lambda name: self.residuals[name])
        verdict = "all claims hold" if self.ok else f"FAILED: {worst}"
        return f"{verdict}; largest residual {self.residuals[worst]:.2g} m ({worst})"


def verify(plan: Plan | Choice) -> Verification:
    """Re-check a plan's path, length, lower bound and verdict; of a choice, those of all cases.

    Nothing is searched or optimised again. The bound follows by arithmetic from the plan's
    certificate (`checks.bounds`). That leaves keep out of obstacles, and that separate parts really
    are separate, is checked by linear programs; that leaves and obstacles fill the workspace, by
    seeded samples (evidence, not proof), and so is that the cases of a choice hold all its goals.
    """
    if isinstance(plan, Choice):
        return _verify_choice(plan)
    space, tolerance = plan.space, _tolerance(plan.space, path_length(plan.waypoints))
    if plan.status is PlanStatus.INFEASIBLE:
        bare = math.isinf(plan.cost) and math.isinf(plan.lower_bound) and not len(plan.waypoints)
        missed = _missed_face(plan) if bare else math.inf
        return Verification({"missed_face": missed, "uncovered": _uncovered(space)}, tolerance)
    residuals = {
        "bound_excess": plan.lower_bound - certified_bound(plan),
        "uncovered": _uncovered(space),
    }
    if plan.status is PlanStatus.OPTIMAL:
        residuals["gap_excess"] = plan.cost - plan.lower_bound * (1.0 + plan.asked_gap)
    if plan.status is not PlanStatus.TIME_LIMIT or len(plan.waypoints) or math.isfinite(plan.cost):
        residuals |= _path_residuals(plan)
    return Verification(_checked(residuals), tolerance)


def _verify_choice(choice: Choice) -> Verification:
    """Residuals of the best path, and of the bound of all cases together."""
    space, best = choice.space, choice.plan
    tolerance = _tolerance(space, best.cost if best is not None else 0.0)
    known: dict[int, float] = {}
    bounds = [case_bound(case, _proved, known) for case in choice.cases]
    bound = min(bounds, default=math.inf)
    residuals = {
        # inf - inf: what is proved infeasible.
        "bound_excess": 0.0 if bound == choice.lower_bound else choice.lower_bound - bound,
        "uncovered": _uncovered(space),
        "missed_goal": missed_goal(choice),
    }
    if choice.status is PlanStatus.OPTIMAL:
        cost = math.inf if best is None else best.cost
        residuals["gap_excess"] = cost - choice.lower_bound * (1.0 + choice.asked_gap)
    if best is not None:
        residuals |= _path_residuals(best) | {"ends": wrong_ends(choice, best)}
    return Verification(_checked(residuals), tolerance)


def _proved(plan: Plan) -> float:
    """The bound that a plan's evidence supports [m]."""
    if plan.status is not PlanStatus.INFEASIBLE:
        return certified_bound(plan)
    return math.inf if _missed_face(plan) <= _tolerance(plan.space, 0.0) else -math.inf


def _tolerance(space: FreeSpace, length: float) -> float:
    """What round-off explains [m].

    Bounds are safe by a share of themselves, and a path may be far longer than the world is wide.
    """
    return 10.0 * MEMBERSHIP_TOL * max(space.scale, length if math.isfinite(length) else 0.0)


def _checked(residuals: dict[str, float]) -> dict[str, float]:
    """Without negative ones; what cannot be computed proves nothing."""
    return {name: math.inf if math.isnan(r) else max(0.0, r) for name, r in residuals.items()}


def _path_residuals(plan: Plan) -> dict[str, float]:
    """Endpoints, length and leaves of the path; inf where a segment has no leaf."""
    points, leaves, space = plan.waypoints, plan.leaves.tolist(), plan.space
    if not leaves or len(points) != len(leaves) + 1 or max(leaves) >= len(space):
        return {"path_outside_leaves": math.inf}
    outside = [
        space.leaf(leaf).A @ points[[k, k + 1]].T - space.leaf(leaf).b[:, None]
        for k, leaf in enumerate(leaves)
    ]
    return {
        "endpoints": float(np.abs(points[[0, -1]] - [plan.start, plan.goal]).max()),
        "length": abs(math.fsum(math.dist(a, b) for a, b in pairwise(points)) - plan.cost),
        "path_outside_leaves": float(np.concatenate(outside).max()),
        "leaf_inside_obstacle": max(_overlap(space.leaf(leaf), space) for leaf in set(leaves)),
    }


def _uncovered(space: FreeSpace) -> float:
    """How far outside of all obstacles a sampled point is that is in no leaf [m]."""
    rng = np.random.default_rng(0)
    points = rng.uniform(*space.bounds, (_SAMPLES, space.n))
    stray = points[~space.contains(points)]
    if not len(stray):
        return 0.0
    outside = [block.violation(stray) for block in space.obstacles]
    return max(0.0, float(np.min(outside, axis=0).max())) if outside else math.inf


def _overlap(leaf: Polytope, space: FreeSpace) -> float:
    """Radius of the largest ball that fits into the leaf and an obstacle at once [m]."""
    lo, hi = leaf.interval_hull()
    worst = 0.0
    for block, (low, high) in zip(space.obstacles, space.obstacle_boxes, strict=True):
        if (low < hi).all() and (high > lo).all():
            A = np.vstack([leaf.A, block.A])
            worst = max(worst, _largest_ball(A, np.concatenate([leaf.b, block.b]), np.ones(len(A))))
    return worst


def _missed_face(plan: Plan) -> float:
    """Widest common facet between the leaves reachable from the start and all others [m].

    Also inf when start and goal are in one reachable part after all.
    """
    space = plan.space
    components = space.graph.components
    mine = set(components[space.leaves_at(plan.start)].tolist())
    if mine & set(components[space.leaves_at(plan.goal)].tolist()):
        return math.inf
    near = [i for i, part in enumerate(components.tolist()) if part in mine]
    rest = [i for i, part in enumerate(components.tolist()) if part not in mine]
    boxes = [leaf.interval_hull() for leaf in space.leaves]
    lows, highs = np.array([b[0] for b in boxes]), np.array([b[1] for b in boxes])
    tol, plane_tol = FACE_TOL * space.scale, PLANE_TOL * space.scale
    widest = max((_overlap(space.leaves[i], space) for i in near), default=0.0)
    for i in near:
        touching = (lows[rest] <= highs[i] + tol).all(axis=1) & (highs[rest] >= lows[i] - tol).all(
            axis=1
        )
        for j in np.flatnonzero(touching).tolist():
            two = space.leaves[rest[j]]
            widest = max(widest, _common_facet(space.leaves[i], two, plane_tol))
    return 0.0 if widest <= tol else widest


def _common_facet(one: Polytope, two: Polytope, tol: float) -> float:
    """Radius of the largest disc on a plane that bounds both, from opposite sides [m]."""
    best = 0.0
    for normal, offset in zip(one.A, one.b, strict=True):
        # Closer than the leaves can be thin: the far side of a sliver is not a common plane.
        opposite = np.abs(two.A + normal).max(axis=1) < NORMAL_TOL
        opposite &= np.abs(two.b + offset) < tol
        if not opposite.any():
            continue
        A = np.vstack([one.A, two.A])
        along = A - np.outer(A @ normal, normal)
        size = np.linalg.norm(along, axis=1)
        free = size > 1e-8
        b = np.concatenate([one.b, two.b])
        best = max(best, _largest_ball(A[free], b[free], size[free], (normal, float(offset))))
    return best


def _largest_ball(
    A: Floats, b: Floats, growth: Floats, plane: tuple[Floats, float] | None = None
) -> float:
    """Max r with A x + growth r <= b (and x on the plane), 0 when there is none [m]."""
    n = A.shape[1]
    optimum = minimize_linear(
        np.append(np.zeros(n), -1.0),
        upper=(np.hstack([A, growth[:, None]]), b),
        equal=None if plane is None else (np.append(plane[0], 0.0)[None], np.array([plane[1]])),
        lo=np.append(np.full(n, -math.inf), 0.0),
        purpose="verification",
    )
    return 0.0 if optimum is None else float(optimum.x[-1])
