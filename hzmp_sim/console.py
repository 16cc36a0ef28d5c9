"""What the command line prints: scenes, plans and runs in a few lines, or as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from hzmp_planners._arrays import finite
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning import Plan, PlanStatus, Verification
from hzmp_sim.run import Run
from hzmp_sim.scene import Scene
from hzmp_sim.scene.passage import Passage

_PIPED_WIDTH = 140  # columns of a table that no terminal sizes
_LISTED = 4  # geoms that are no obstacles, for one reason, before they share a row


def run_summary(run: Run, directory: Path) -> str:
    """Outcome of a run, the numbers that decide it, and where its files are."""
    m = run.metrics
    lines = [
        f"{m['status'].replace('_', ' ')}: {_outcome(run)}",
        plan_line(run.plan, moving=bool(run.scene.moving)),
    ]
    if run.log is not None:
        lines.append(
            f"flight    {m['trajectory_duration_s']:.2f} s, "
            f"{m['collision_steps']} collision steps, "
            f"containment {m['containment_m']:.2g} m, "
            f"tracking error max {1e3 * m['tracking_error_max_m']:.1f} mm, "
            f"least clearance {_millimetres(m['min_clearance_m'])} "
            f"(planned for {1e3 * run.scene.clearance:.0f} mm)"
        )
        if run.flight_plan is not None:
            latency = m["replan_latency_ms"]
            lines.append(
                f"replans   {m['replans']} of {m['plans_asked']} plans taken, "
                f"{latency['median'] or 0.0:.0f} ms in the median, waited {m['waited_s']:.1f} s, "
                f"{m['unproved_s']:.1f} s without a proof"
            )
        if m["disturbed_by"]:
            lines.append(f"against   {m['disturbed_by']}")
        lines.append(
            f"speed     simulated at {m['realtime_factor']:.0f} x real time; whole run "
            f"{sum(m['timings_s'].values()):.1f} s"
        )
    for name, contact in m["contacts"].items():
        lines.append(
            f"contact   with {name} in {contact['steps']} steps, first at "
            f"{contact['first_s']:.3f} s, up to {1e3 * contact['depth_m']:.0f} mm deep: "
            f"{contact['explanation']}"
        )
    lines += [f"warning   {text}" for text in m["warnings"] if text not in run.scene.warnings]
    if not m["plan_verified"]:
        lines.append("plan      VERIFICATION FAILED: do not trust this plan, and report this")
    if m["video"] != "run.mp4":
        lines.append(f"no video  {m['video']}")
    names = ["report.html", "run.rrd", "run.mp4", "metrics.json"]
    files = [directory / name for name in names if (directory / name).exists()]
    lines.append("files     " + "\n          ".join(str(file) for file in files))
    return "\n".join(lines)


def _outcome(run: Run) -> str:
    if run.log is None:
        plane = "" if run.scene.height is None else f" (in the plane z = {run.scene.height:g} m)"
        return run.plan.status.value + plane
    return f"the body ended {1e3 * run.metrics['goal_distance_m']:.1f} mm from the goal"


def _millimetres(value: float) -> str:
    return f"{1e3 * value:.0f} mm" if math.isfinite(value) else "unbounded (no obstacles)"


def plan_line(plan: Plan, *, moving: bool = False) -> str:
    """Length, bound and gap of a plan in one line; in a world that moves, among what does not."""
    no_path = "no path among what stands still" if moving else "no path"
    if plan.status is PlanStatus.INFEASIBLE:
        return "plan      proved infeasible"
    if not math.isfinite(plan.cost):
        return f"plan      nothing found; {no_path} is shorter than {plan.lower_bound:.4f} m"
    return (
        f"plan      {plan.status.name.lower()}: {plan.cost:.4f} m through {len(plan.leaves)} "
        f"leaves, {no_path} is shorter than {plan.lower_bound:.4f} m (gap {100.0 * plan.gap:.3f} %)"
    )


def plan_summary(plan: Plan, report: Verification, blame: str, *, moving: bool = False) -> str:
    """A plan, what blocks the way if that is known, its waypoints, and its verification."""
    lines = [plan_line(plan, moving=moving)]
    if blame:
        lines.append(f"blocked   {blame}")
    points = ["(" + ", ".join(f"{x:.4f}" for x in point) + ")" for point in plan.waypoints.tolist()]
    if points:
        lines.append("waypoints " + "\n          ".join(points))
    lines.append(f"verified  {report.describe()}")
    return "\n".join(lines)


def plan_as_dict(plan: Plan, report: Verification, blame: str) -> dict[str, Any]:
    """A plan as JSON-ready values; null for what is not a finite number."""
    return plan.as_dict() | {
        "blocked_by": blame or None,
        "verified": report.ok,
        "residuals_m": {name: finite(value) for name, value in report.residuals.items()},
    }


def scene_as_dict(scene: Scene, space: FreeSpace, passage: Passage) -> dict[str, Any]:
    """How a world was read, as JSON-ready values."""
    return {
        "path": str(scene.path),
        "body": scene.body,
        "dimension": scene.n,
        "workspace": [corner.tolist() for corner in scene.workspace],
        "start": scene.start.tolist(),
        "goal": scene.goal.tolist(),
        "radius_m": scene.radius,
        "shape": scene.shape.as_dict(),
        "clearance_m": scene.clearance,
        "tolerance_m": scene.tolerance,
        "height_m": scene.height,
        "obstacles": len(scene.obstacles),
        "leaves": len(space),
        "faces": len(space.graph),
        "components": int(space.graph.components.max(initial=-1)) + 1,
        "free_volume": space.volume,
        "widest_body": {
            "radius_m": _widest_radius(scene, passage),
            "extra_radius_m": passage.passes,
            "blocked_from_extra_radius_m": passage.blocked,
        },
        "warnings": list(scene.warnings),
        "meshes": [asdict(mesh) for mesh in scene.meshes],
        "decomposed_meshes": [asdict(report) for report in scene.pieces],
        "geoms": [
            {
                "name": geom.name,
                "type": geom.type,
                "role": geom.role,
                "parts": geom.parts,
                "facets": geom.facets,
                "error_m": geom.error,
                "reason": geom.reason,
            }
            for geom in scene.geoms
        ],
    }


def print_scene(
    scene: Scene, space: FreeSpace, passage: Passage, files: Mapping[str, Path | None]
) -> None:
    """How a world was read, as a table of geoms and a few lines; then the files written."""
    facts = scene_as_dict(scene, space, passage)
    console = wide_console()
    table = Table("geom", "type", "role", "parts", "facets", r"error \[mm]", "reason", box=None)
    for row in _geom_rows(facts["geoms"]):
        table.add_row(*row)
    console.print(table)
    sizes = " x ".join(f"[{lo:g}, {hi:g}]" for lo, hi in zip(*scene.workspace, strict=True))
    console.print(
        f"body      {scene.body}: {scene.n}-D, radius {1e3 * scene.radius:.0f} mm, "
        f"clearance {1e3 * scene.clearance:.0f} mm",
        f"shape     {scene.shape.describe()}",
        f"workspace {sizes} m",
        f"space     {facts['obstacles']} obstacles -> {facts['leaves']} leaves, "
        f"{facts['faces']} shared faces, {facts['components']} components, "
        f"{facts['free_volume']:.4g} m^{scene.n} free",
        f"passage   {passage_line(scene, passage)}",
        *(f"{kind:<9} {path}" for kind, path in files.items() if path is not None),
        sep="\n",
        markup=False,
        soft_wrap=True,
    )


def _geom_rows(geoms: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    """A row for each geom, but one for all that are no obstacles for the same reason, if many are.

    Worlds made to be looked at have hundreds of geoms that touch nothing.
    """
    alike: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for geom in geoms:
        alike.setdefault((geom["role"], geom["reason"]), []).append(geom)
    rows: list[tuple[str, ...]] = []
    for geom in geoms:
        role, reason = geom["role"], geom["reason"]
        same = alike[role, reason]
        name, types, numbers = geom["name"], geom["type"], ("", "", "")
        if role == "obstacle":
            numbers = (str(geom["parts"]), str(geom["facets"]), f"{1e3 * geom['error_m']:.1f}")
        elif len(same) > _LISTED:
            if geom is not same[0]:
                continue
            name = f"{len(same)} geoms (--json names them)"
            types = ", ".join(dict.fromkeys(other["type"] for other in same))
        rows.append((name, types, role, *numbers, reason))
    return rows


def passage_line(scene: Scene, passage: Passage) -> str:
    """What is proved of wider bodies, at the same clearance."""
    if passage.passes is None:
        return "start and goal are not connected for this body"
    if scene.shape.kind != "ball":
        return (
            f"the body still gets from start to goal when {1e3 * passage.passes:.1f} mm larger all "
            f"around, not when {1e3 * passage.blocked:.1f} mm"
        )
    through, blocked = scene.radius + passage.passes, scene.radius + passage.blocked
    return (
        f"a body of radius {1e3 * through:.1f} mm ({1e3 * passage.passes:+.1f} mm) still gets from "
        f"start to goal, one of {1e3 * blocked:.1f} mm does not"
    )


def _widest_radius(scene: Scene, passage: Passage) -> float | None:
    """Radius of the widest ball [m]; None for other shapes, which have no such number."""
    if passage.passes is None or scene.shape.kind != "ball":
        return None
    return scene.radius + passage.passes


def wide_console(piped: int = _PIPED_WIDTH) -> Console:
    """A console on stdout that leaves tables room, so many columns, when they are piped."""
    terminal = Console().is_terminal
    return _Console(highlight=False, width=None if terminal else piped)


class _Console(Console):
    """It leaves a pipe that nobody reads to `cli.main`, as `print` does."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError
