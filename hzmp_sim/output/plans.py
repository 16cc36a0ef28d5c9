"""What was planned in flight, as a table of the report and as plans.json."""

from __future__ import annotations

import json
import math
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from hzmp_sim.output.headline import number

if TYPE_CHECKING:
    from hzmp_sim.replanning import FlightPlan, PlanRecord


_MEANINGS = {
    "onward": "on the way to the goal; not taken if what is flown is as good",
    "opened": "a way to the goal has opened, after a wait",
    "approach": "no way is open: nearer to where it is blocked",
    "threat": "what was flown is not proved any more: stop, get round, or get away",
    "wait": "no way is open, and where the body is it is safe",
    "late": "the answer came after it should have taken effect, and was dropped",
}


class ReasonRow(NamedTuple):
    """All decisions for one reason."""

    reason: str
    meaning: str
    asked: int
    taken: int
    unproved: int
    """After how many nothing proved was flown."""


class PlanRow(NamedTuple):
    """One line: a decision, or several alike one after the other."""

    time: str
    """[s]"""
    asked: int
    reason: str
    taken: int
    length: str
    """Of the last path to the goal [m]."""
    bound: str
    """No path was shorter [m]."""
    latency: str
    """Largest [ms]."""
    conflict: str
    """What the trajectory flown before would have met, and when."""


def reason_rows(planned: FlightPlan) -> list[ReasonRow]:
    """How many decisions there were for each reason, in the order of their first."""
    rows = []
    for reason in dict.fromkeys(record.reason for record in planned.records):
        chosen = [record for record in planned.records if record.reason == reason]
        taken = sum(record.taken for record in chosen)
        unproved = sum(not record.proved for record in chosen)
        rows.append(ReasonRow(reason, _MEANINGS[reason], len(chosen), taken, unproved))
    return rows


def plan_rows(planned: FlightPlan) -> list[PlanRow]:
    """Decisions in order, those alike in a row summed up."""
    groups = [list(group) for _, group in groupby(planned.records, key=_kind)]
    return [_row(group) for group in groups]


def write_plans(planned: FlightPlan, path: Path) -> None:
    """Write every decision as JSON: a list of objects, times in s, lengths in m."""
    entries = []
    for record in planned.records:
        entry = dict(vars(record))
        for name in ("goal", "waypoints"):
            entry[name] = entry[name].tolist()
        for name, value in entry.items():
            if isinstance(value, float) and not math.isfinite(value):
                entry[name] = None
        entries.append(entry)
    path.write_text(json.dumps(entries, indent=1, allow_nan=False), encoding="utf-8")


def _kind(record: PlanRecord) -> tuple[str, bool, str]:
    return record.reason, record.proved, record.conflict


def _row(group: list[PlanRecord]) -> PlanRow:
    first, last = group[0], group[-1]
    span = f"{first.time:.2f}" if len(group) == 1 else f"{first.time:.2f} to {last.time:.2f}"
    conflict = f"{last.conflict} at {last.conflict_time:.2f} s" if last.conflict else ""
    return PlanRow(
        time=span,
        asked=len(group),
        reason=last.reason if last.proved else f"{last.reason}, not proved",
        taken=sum(record.taken for record in group),
        length=number(last.cost),
        bound=number(last.lower_bound),
        latency=f"{1e3 * max(record.latency for record in group):.1f}",
        conflict=conflict,
    )
