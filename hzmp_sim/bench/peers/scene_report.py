"""The scenes, and every returned path checked again, as tables."""

from __future__ import annotations

from hzmp_sim.bench.peers.analysis import is_free
from hzmp_sim.bench.peers.planners import PLANNERS
from hzmp_sim.bench.peers.results import COLD, OURS, Results
from hzmp_sim.bench.statistics import median
from hzmp_sim.bench.tables import Table, short
from hzmp_sim.bench.words import costs, times


def rechecks(results: Results) -> Table:
    """What the re-check found, for each planner, and defects of ours."""
    known = {scene.name: scene for scene in results.scenes}
    rows = []
    for planner in PLANNERS:
        runs = [run for run in results.runs if run.planner == planner.name]
        paths = [run for run in runs if run.claimed is not None]
        if not runs:
            continue
        deepest = max((run.depth for run in paths), default=0.0)
        astray = sum(not is_free(run, known[run.scene]) for run in paths)
        excess = [
            run.lower_bound / best - 1.0
            for run in runs
            if run.lower_bound and (best := known[run.scene].reference) is not None
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


def scenes(results: Results) -> Table:
    """What is known about each scene."""
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
