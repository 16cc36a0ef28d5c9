"""The results as tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hzmp_sim.bench.machine import hardware, software
from hzmp_sim.bench.page import page_text
from hzmp_sim.bench.peers.analysis import (
    GRID,
    NEAR,
    NEARER,
    Timed,
    effort,
    groups,
    scene_medians,
    summary,
    timed,
)
from hzmp_sim.bench.peers.convex_report import convex_sets
from hzmp_sim.bench.peers.planners import PLANNERS, is_sampler
from hzmp_sim.bench.peers.results import COLD, WARM, Results
from hzmp_sim.bench.peers.scene_report import rechecks, scenes
from hzmp_sim.bench.statistics import cost_at, median, ratio
from hzmp_sim.bench.tables import Table, percent
from hzmp_sim.bench.words import costs, times

_CHECKS = {
    "exact": "edges checked exactly",
    "states": "edges checked state by state",
}


def tables_of(results: Results) -> list[Table]:
    """All tables, what is asked first."""
    checks = list(effort(results)["checks"])
    tables = [_ratios(results, checks[0]), *(_planners(results, check) for check in checks)]
    tables += [_curves(results, check) for check in checks]
    tables += [convex_sets(results), rechecks(results), scenes(results)]
    if results.skipped or results.remarks:
        remarks = [*results.skipped, *results.remarks]
        tables.append(Table("Not measured", (), (), remarks=remarks))
    return tables


def markdown(results: Results, figures: Sequence[str] = (), maker: str | None = None) -> str:
    """The tables, what they were measured on, and pictures, as Markdown.

    Args:
        results: what was measured.
        figures: paths of pictures, as they are to be linked.
        maker: the command that makes this text, if not the one that measured.
    """
    facts, done = results.machine, effort(results)
    introduction = (
        f"{hardware(facts)}; {software(facts)}. {done['runs']} runs of {done['budget']:g} s per "
        f"scene and planner. `{results.command}` took {results.seconds:,.0f} s."
    )
    return page_text(maker or results.command, introduction, tables_of(results), figures)


def _ratios(results: Results, check: str) -> Table:
    """How much longer each peer takes than HZ-MP to get equally far."""
    rows = []
    asked = (None, NEAR, NEARER)
    for group in groups(results):
        warm, cold = (timed(results, name, check, group) for name in (WARM, COLD))
        for planner in PLANNERS:
            theirs = timed(results, planner.name, check, group)
            if planner.name == WARM or not theirs:
                continue
            cells = [_faster(theirs, ours, excess) for ours in (warm, cold) for excess in asked]
            rows.append((group, planner.title, *(cells[:3] if planner.name == COLD else cells)))
            if planner.name == COLD:
                rows[-1] += ("", "", "")
    near = [f"to {percent(excess)}" for excess in (NEAR, NEARER)]
    goals = ["first path", *near]
    return Table(
        "Time of each planner over the time of HZ-MP",
        (
            "scenes", "planner", *(f"{goal} / warm" for goal in goals),
            *(f"{goal} / cold" for goal in goals),
        ),
        rows,
        f"Above 1, HZ-MP is faster; {_CHECKS[check]}. Warm: free space is decomposed before; cold: "
        "the decomposition counts. Times are those to the first path, and to one at most 1 % and "
        "0.1 % longer than the best. The ratio of the median times in each scene, and its median "
        "over the scenes; in brackets, in how many of them HZ-MP is faster (both failed: in "
        'neither). "inf": in half of the scenes or more, HZ-MP gets there and the other does not '
        "in half of its runs; 0: the other way round.",
    )  # fmt: skip


def _faster(theirs: Sequence[Timed], ours: Sequence[Timed], excess: float | None) -> str:
    one, two = scene_medians(theirs, excess), scene_medians(ours, excess)
    shared = [scene for scene in one if scene in two]
    ratios = [ratio(one[scene], two[scene]) for scene in shared]
    faster = sum(value > 1.0 for value in ratios)
    if all(math.isinf(one[scene]) and math.isinf(two[scene]) for scene in shared):
        return "- (neither)"
    return f"{costs(median(ratios), 2)} ({faster}/{len(ratios)})"


def _planners(results: Results, check: str) -> Table:
    budget = effort(results)["budget"]
    rows = []
    for group in groups(results):
        for planner in PLANNERS:
            runs = timed(results, planner.name, check, group)
            if not runs:
                continue
            found = summary(runs, budget)
            low, high = found.interval
            sampler = is_sampler(planner.name)
            first = times(found.first_s)
            rows.append(
                (
                    group,
                    planner.title,
                    f"{found.early}/{found.runs}",
                    f"{found.success}/{found.runs} ({low:.2f}-{high:.2f})",
                    f"{first} ({times(found.first_bare_s)})" if sampler else first,
                    costs(found.first_cost),
                    costs(found.early_cost),
                    costs(found.cost),
                    costs(found.worst),
                    costs(found.edges_first, 0) if sampler else "",
                    costs(found.states_first, 0) if sampler else "",
                    percent(found.python) if sampler else "",
                )
            )
    tenth, whole = times(budget / 10.0), times(budget)
    return Table(
        f"Planners, {_CHECKS[check]}",
        (
            "scenes", "planner", f"success in {tenth}", f"in {whole} (95 %)",
            "first path (without Python)", "its cost", f"cost at {tenth}", f"at {whole}", "worst",
            "edges to it", "states to it", "Python",
        ),
        rows,
        "Costs are ratios to the best path known, in 2-D the optimum. Medians over all runs of all "
        "scenes of a group; a run without a path counts as infinite. Edges and states are those "
        "checked until the first path; Python is the estimated part of the time in which OMPL's "
        "calls into Python are under way, the check itself not counted.",
    )  # fmt: skip


def _curves(results: Results, check: str) -> Table:
    budget = effort(results)["budget"]
    grid = [when for when in GRID if when <= 1.0001 * budget] or [budget]
    rows = []
    for group in groups(results):
        for planner in PLANNERS:
            runs = timed(results, planner.name, check, group)
            if runs:
                found = [median(cost_at(run.history, when) for run in runs) for when in grid]
                rows.append((group, planner.title, *(costs(cost, 4) for cost in found)))
    return Table(
        f"Cost over time, {_CHECKS[check]}",
        ("scenes", "planner", *(times(when) for when in grid)),
        rows,
        "Medians as above. A planner that was stopped, or late, appears at the time it reported.",
    )
