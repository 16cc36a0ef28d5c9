"""What `hzmp-sim audit` prints: the nearest obstacles as a table, or everything as JSON."""

from __future__ import annotations

from typing import Any

from rich.markup import escape
from rich.table import Table

from hzmp_planners._arrays import finite
from hzmp_sim.console import wide_console
from hzmp_sim.simulation.path_audit import DISTANCE_TOL, Audit, ObstacleAudit

_SHOWN = 25  # rows of the table: the nearest ones tell


def audit_as_dict(audit: Audit) -> dict[str, Any]:
    """An audit as JSON-ready values."""
    return {
        "clearance_holds": audit.holds,
        "planner_agrees": audit.agrees,
        "min_clearance_m": finite(audit.clearance),
        "required_m": audit.required,
        "distance_tolerance_m": DISTANCE_TOL,
        "poses": audit.poses,
        "largest_step_m": audit.step,
        "length_m": audit.length,
        "progress_unit": audit.unit,
        "obstacles": [
            {
                "name": row.name,
                "role": row.role,
                "clearance_m": row.clearance,
                "progress": row.progress,
                "position_m": row.position,
                "shortfall_m": finite(row.shortfall),
                "disagreement_m": finite(row.disagreement),
                "blocked_poses": row.blocked,
            }
            for row in audit.obstacles
        ],
    }


def print_audit(audit: Audit) -> None:
    """The nearest obstacles and the verdicts."""
    console = wide_console()
    table = Table(
        "obstacle", "role", r"clearance \[mm]", rf"at \[{audit.unit}]", r"centre there \[m]",
        "holds", "planner agrees", box=None,
    )  # fmt: skip
    for row in audit.obstacles[:_SHOWN]:
        table.add_row(escape(row.name), row.role, *_cells(row))
    console.print(table)
    more = audit.obstacles[_SHOWN:]
    lines = [f"          and {len(more)} more, farther away"] if more else []
    lines += [
        f"clearance {'holds' if audit.holds else 'DOES NOT HOLD'}: least "
        + ("unbounded" if finite(audit.clearance) is None else f"{1e3 * audit.clearance:.1f} mm")
        + f", planned {1e3 * audit.required:.0f} mm, less what the body was off its reference",
        f"planner   {'agrees' if audit.agrees else 'DOES NOT AGREE'}: nothing that it calls free "
        + ("is" if audit.agrees else "should be")
        + f" nearer than planned (to {1e3 * DISTANCE_TOL:g} mm)",
        f"motion    {audit.length:.3f} m in {audit.poses} poses, at most "
        f"{1e3 * audit.step:.1f} mm apart",
    ]
    console.print(*lines, sep="\n", markup=False, soft_wrap=True)


def _cells(row: ObstacleAudit) -> tuple[str, str, str, str, str]:
    """Clearance, progress, position and both verdicts of a row, as text."""
    return (
        f"{1e3 * row.clearance:.1f}",
        f"{row.progress:.3f}",
        "(" + ", ".join(f"{value:.3f}" for value in row.position) + ")",
        "yes" if row.shortfall <= DISTANCE_TOL else f"NO, {1e3 * row.shortfall:.1f} mm short",
        _agreement(row),
    )


def _agreement(row: ObstacleAudit) -> str:
    """Whether planner and MuJoCo agree on an obstacle; a dash where the planner said nothing.

    That is so of geoms that are none of its obstacles, such as those that move.
    """
    if finite(row.disagreement) is None:
        return "-"
    if row.disagreement <= DISTANCE_TOL:
        return "yes"
    return f"NO, by {1e3 * row.disagreement:.1f} mm"
