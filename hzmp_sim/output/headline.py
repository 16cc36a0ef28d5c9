"""The numbers of a run in words: the same verdict and table in the recording and the report."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple, TypeGuard

if TYPE_CHECKING:
    from hzmp_planners.planning import Plan
    from hzmp_sim.run import Run


class Verdict(NamedTuple):
    """Outcome of a run."""

    good: bool
    title: str
    reason: str


class Figure(NamedTuple):
    """One number with its unit and meaning."""

    label: str
    value: str
    unit: str = ""
    good: bool | None = None
    """Whether it is as it should be; None when it is neither good nor bad."""


_VERDICTS = {
    "goal_reached": ("Goal reached", "The body arrived and MuJoCo reported no collision."),
    "collision": ("Collision", "MuJoCo reported contact of the body with {geoms}."),
    "goal_not_reached": ("Goal not reached", "The flight ended away from the goal."),
    "infeasible": ("Proved infeasible", ""),
    "time_limit": ("No path found in the time limit", ""),
}


def verdict(run: Run) -> Verdict:
    """The headline of a run, from its status."""
    status = str(run.metrics["status"])
    title, reason = _VERDICTS[status]
    contacts = run.metrics.get("contacts") or {}
    reason = reason.format(geoms=", ".join(contacts) or "an obstacle")
    if contacts and not any(contact["predicted"] for contact in contacts.values()):
        reason += " What it met was not where it had been predicted."
    # Without a flight the planner's own words say why, and what would help.
    return Verdict(
        status == "goal_reached", title, reason or f"{run.plan.status.value}.".capitalize()
    )


def headline_figures(run: Run) -> list[Figure]:
    """The numbers a reader asks for first; only those that this run has."""
    m = run.metrics
    clear, wanted = m.get("min_clearance_m"), run.scene.clearance
    containment, gap = m.get("containment_m"), m.get("optimality_gap")
    among = ", among what stands still" if run.scene.moving else ""
    rows: list[Figure] = []
    if run.log is not None:
        hits = int(m["collision_steps"])
        rows.append(Figure("Collision steps", f"{hits}", f"of {len(run.log.time)}", hits == 0))
    if _known(clear):
        rows.append(
            Figure("Smallest clearance", number(clear), "m", None if clear >= wanted else clear > 0)
        )
    if _known(gap):
        rows.append(Figure("Optimality gap", percent(gap), f"%{among}"))
    if _known(containment):
        rows.append(Figure("Containment", number(containment), "m", containment <= 0.0))
    if _known(m.get("path_length_m")):
        rows.append(Figure("Path length", number(m["path_length_m"]), f"m{among}"))
    if run.flight_plan is not None:
        unproved = float(m["unproved_s"])
        rows.append(Figure("Flown without a proof", number(unproved), "s", unproved == 0.0))
    if _known(m.get("trajectory_duration_s")):
        rows.append(Figure("Duration", number(m["trajectory_duration_s"]), "s"))
    if _known(m.get("tracking_error_max_m")):
        error = m["tracking_error_max_m"]
        covered = None if error <= wanted else False
        rows.append(Figure("Largest tracking error", number(error), "m", covered))
    return rows


def summary_markdown(run: Run) -> str:
    """Verdict, headline numbers and timings as Markdown."""
    result = verdict(run)
    lines = [f"# {result.title}", "", result.reason, "", "| Quantity | Value |", "|---|---|"]
    lines += [f"| {f.label} | {f.value} {f.unit} |" for f in headline_figures(run)]
    counts = ", ".join(
        f"{run.metrics[key]} {key}"
        for key in ("obstacles", "leaves", "faces")
        if run.metrics.get(key) is not None
    )
    timings = run.metrics.get("timings_s") or {}
    lines += [f"| Free space | {counts} |", ""]
    if run.plan.history:
        lines += ["The search is on the timeline `plan_time`, the flight on `sim_time`.", ""]
    lines += ["| Stage | Time [ms] |", "|---|---|"]
    lines += [f"| {name} | {1e3 * s:.1f} |" for name, s in timings.items() if _known(s)]
    return "\n".join(lines)


def informed_times(plan: Plan) -> list[float]:
    """Times [s] from the call of plan at which the cost improved: one for each informed set."""
    first: dict[float, float] = {}
    for seconds, cost, _ in plan.history:
        if math.isfinite(cost):
            first.setdefault(cost, float(seconds))
    return list(first.values())


def percent(ratio: float) -> str:
    """A ratio in percent; what is below the solver's accuracy is not spelled out."""
    return "< 0.001" if ratio < 1e-5 else f"{100 * ratio:.3g}"


def number(value: Any) -> str:
    """Four significant digits, or "n/a" for what is not a finite number."""
    return f"{value:.4g}" if _known(value) else "n/a"


def _known(value: Any) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and math.isfinite(value)
