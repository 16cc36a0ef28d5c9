"""The results as tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hzmp_sim.bench.peers.analysis import (
    GRID,
    NEAR,
    NEARER,
    Timed,
    effort,
    groups,
    is_free,
    scene_medians,
    summary,
    timed,
)
from hzmp_sim.bench.peers.convex_report import convex_sets
from hzmp_sim.bench.peers.planners import PLANNERS, is_sampler
from hzmp_sim.bench.peers.results import COLD, OURS, WARM, Results
from hzmp_sim.bench.peers.statistics import cost_at, median, ratio
from hzmp_sim.bench.peers.words import costs, times
from hzmp_sim.bench.tables import Table, percent, short

_CHECKS = {
    "exact": "edges checked exactly",
    "states": "edges checked state by state",
}


def tables_of(results: Results) -> list[Table]:
    """All tables, what is asked first."""
    checks = list(effort(results)["checks"])
    tables = [_ratios(results, checks[0]), *(_planners(results, check) for check in checks)]
    tables += [_curves(results, check) for check in checks]
    tables += [convex_sets(results), _rechecks(results), _scenes(results)]
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
    made = f"<!-- made by: {maker or results.command} -->"
    facts, done = results.machine, effort(results)
    versions = ", ".join(f"{name} {number}" for name, number in facts["versions"].items())
    lines = [
        made,
        f"{facts['processor']}, {facts['cores']} cores, one thread used; load {facts['load']:g} "
        f"before the run; {facts['system']}, Python {facts['python']}; {versions}. {done['runs']} "
        f"runs of {done['budget']:g} s per scene and planner. `{results.command}` took "
        f"{results.seconds:,.0f} s.\n",
    ]
    lines += [table.markdown() for table in tables_of(results)]
    for figure in figures:
        lines += [f"{made}\n![{figure.rsplit('/', 1)[-1].split('.')[0]}]({figure})\n"]
    return "\n".join(lines) + "\n"


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


def _rechecks(results: Results) -> Table:
    scenes = {scene.name: scene for scene in results.scenes}
    rows = []
    for planner in PLANNERS:
        runs = [run for run in results.runs if run.planner == planner.name]
        paths = [run for run in runs if run.claimed is not None]
        if not runs:
            continue
        deepest = max((run.depth for run in paths), default=0.0)
        astray = sum(not is_free(run, scenes[run.scene]) for run in paths)
        excess = [
            run.lower_bound / best - 1.0
            for run in runs
            if run.lower_bound and (best := scenes[run.scene].reference) is not None
        ]
        notes = [run.note for run in runs if run.note.startswith(("failed", "did not end"))]
        rows.append(
            (
                planner.title,
                f"{len(paths):,}",
                f"{astray:,}",
                "0" if deepest == 0.0 else f"{deepest:.1e} m",
                f"{max(excess):+.1e}" if excess else "",
                str(len(notes)) if notes else "",
            )
        )
    lines = [f"DEFECT: {defect}" for defect in results.defects]
    return Table(
        "Every returned path, checked again",
        ("planner", "paths", "not free", "deepest in an obstacle", "bound over best", "failures"),
        rows,
        "By code that no planner uses: segments against obstacles, exactly. A path is free if no "
        "point of it is deeper than a millionth of the workspace in an obstacle, which is what "
        "convex solvers leave, and its ends are start and goal. Bound over best: the largest lower "
        "bound relative to the best path known in its scene; above 0, it is wrong by so much.",
        lines,
    )


def _scenes(results: Results) -> Table:
    known = {planner.name: planner.title for planner in PLANNERS}
    rows = []
    for scene in results.scenes:
        best = scene.reference
        ours = [run for run in results.runs if run.scene == scene.name and run.planner in OURS]
        offline = median(run.offline_s for run in ours if run.planner == COLD)
        rows.append(
            (
                scene.name,
                scene.group,
                f"{scene.obstacles:,}",
                f"{scene.leaves:,}",
                f"{scene.faces:,}",
                times(offline),
                short(scene.straight, 4),
                "-" if best is None else f"{best:.6g}",
                known.get(scene.source, scene.source),
                "-" if best is None else costs(scene.lower_bound / best, 5),
            )
        )
    return Table(
        "Scenes",
        (
            "scene", "group", "obstacles", "leaves", "shared faces", "decomposition with graph",
            "start to goal [m]", "best path [m]", "found by", "our bound / best",
        ),
        rows,
        "The decomposition is ours, median of the runs. In 2-D the best path is the optimum, by an "
        "exact visibility graph; in 3-D nobody knows more than the best path that was found, and "
        "the lower bounds.",
    )  # fmt: skip
