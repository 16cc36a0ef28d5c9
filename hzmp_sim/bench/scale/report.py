"""The results as tables."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from hzmp_sim.bench.machine import hardware, software
from hzmp_sim.bench.page import page_text
from hzmp_sim.bench.scale.fits import SERIES, series
from hzmp_sim.bench.scale.results import Results, Target, WorldResult
from hzmp_sim.bench.tables import Table, percent, seconds, short


def tables_of(results: Results) -> list[Table]:
    """All tables, targets first."""
    tables = [_targets(results), _times(results), _leaves(results), _use(results)]
    if results.moving:
        tables.append(_moving(results))
    if results.peers or results.skipped:
        tables.append(_peers(results))
    return tables


def markdown(results: Results, figures: Sequence[str] = (), maker: str | None = None) -> str:
    """The tables, what they were measured on, and pictures, as Markdown.

    Args:
        results: what was measured.
        figures: paths of pictures, as they are to be linked.
        maker: the command that makes this text, if not the one that measured.
    """
    facts = results.machine
    introduction = (
        f"{hardware(facts)}, and the decompositions had a processor for "
        f"{percent(results.cpu_share)} of their time; {software(facts)}. "
        f"`{results.command}` took {results.seconds:,.0f} s."
    )
    return page_text(maker or results.command, introduction, tables_of(results), figures)


def _targets(results: Results) -> Table:
    rows = [
        (target.asked, _bare(target, target.limit), _bare(target, target.measured), target.verdict)
        for target in results.targets
    ]
    return Table("Targets", ("asked", "at most", "measured", "verdict"), rows)


def _bare(target: Target, value: float | None) -> str:
    return "-" if value is None else f"{short(value)} {target.unit}".strip()


def _times(results: Results) -> Table:
    """Times, and the exponents that they grow with."""
    exponents = {fit.family: fit for fit in results.fits}
    rows = []
    for world in _ordered(results.worlds):
        fit = exponents.get(world.family)
        last = fit is not None and world.obstacles == fit.counts[-1]
        rows.append(
            (
                _name(world),
                f"{world.obstacles:,}",
                f"{world.leaves:,}",
                f"{world.faces:,}",
                seconds(statistics.median(world.decompose_s)),
                seconds(statistics.median(world.graph_s)),
                seconds(world.total_s),
                seconds(world.cpu_s),
                short(1e6 * world.total_s / max(world.leaves, 1)),
                f"{fit.exponent:.2f} ({fit.last:.2f})" if fit is not None and last else "",
            )
        )
    return Table(
        "Time",
        (
            "world", "obstacles", "leaves", "shared faces", "decompose", "leaf graph", "both",
            "processor", "us per leaf", "exponent (last step)",
        ),
        rows,
        "Medians; processor is the mean time on a processor, less than both on a busy machine. The "
        "exponent is that of time over obstacles at constant density, fitted to the whole series; "
        "in brackets, between its two largest worlds.",
    )  # fmt: skip


def _leaves(results: Results) -> Table:
    rows = [
        (
            _name(world),
            f"{world.obstacles:,}",
            short(_each(world, world.leaves)),
            short(_each(world, world.naive)),
            percent(world.leaf_ratio),
            short(_each(world, world.naive_reach)),
            percent(world.leaves / world.naive_reach if world.naive_reach else None),
            short(_each(world, world.overlapping)),
            seconds(world.overlapping_s),
        )
        for world in _ordered(results.worlds)
    ]
    return Table(
        "Leaves per obstacle",
        (
            "world", "obstacles", "ours", "naive", "ours / naive", "greatest reach first",
            "ours / that", "ours, overlapping", "time of that",
        ),
        rows,
        "Naive: each obstacle in turn cuts the cells that it meets by its facets in the given "
        "order; the stronger variant takes the facet first beyond which the cell reaches most.",
    )  # fmt: skip


def _use(results: Results) -> Table:
    rows = [
        (
            _name(world),
            f"{world.obstacles:,}",
            f"{world.peak_mb:,.0f} ({world.peak_mb - world.base_mb:,.0f})",
            seconds(world.locate_s * 1e6 / world.points),
            f"{short(world.file_mb)} MB, {seconds(world.save_s)}, {seconds(world.load_s)}",
            f"{world.cover_error:.0e}",
            f"{world.misplaced} / {world.points:,}",
        )
        for world in _ordered(results.worlds)
    ]
    return Table(
        "Memory, point location, files, exactness",
        (
            "world", "obstacles", "peak memory [MB] (of it new)", "locate 1,000,000 points",
            "file, save, load", "cover error", "points on the wrong side",
        ),
        rows,
        "Peak memory is the largest resident memory (VmHWM) of a fresh process that decomposes "
        "once; new is what that adds to the interpreter, the libraries and the obstacles. The "
        "cover error is |leaves + union of obstacles - workspace| / workspace.",
    )  # fmt: skip


def _moving(results: Results) -> Table:
    rows = [
        (
            f"{row.title}: {row.moved} of {row.obstacles} move",
            _spread(row.static_s),
            _spread(row.numbered_s),
            seconds(row.first_s),
            seconds(statistics.median(row.fresh_s)),
            short(statistics.median(row.fresh_s) / statistics.median(row.static_s)),
            f"{row.leaves:,.0f} / {row.fresh_leaves:,.0f}",
            f"{row.cover_error:.0e}",
        )
        for row in results.moving
    ]
    return Table(
        "Obstacles that move",
        (
            "world", "on the space of the others", "by their numbers", "the first of these",
            "decomposed anew", "times faster", "leaves, updated / anew", "cover error",
        ),
        rows,
        "Each step with its leaf graph: median (99th percentile).",
    )  # fmt: skip


def _spread(times: Sequence[float]) -> str:
    if not times:
        return "-"
    worst = sorted(times)[min(int(0.99 * len(times)), len(times) - 1)]
    return f"{seconds(statistics.median(times))} ({seconds(worst)})"


def _peers(results: Results) -> Table:
    rows = [
        (
            row.peer,
            row.does,
            f"{row.title}, {row.obstacles}",
            f"{row.our_leaves:,}",
            seconds(row.our_s),
            "-" if row.pieces is None else f"{row.pieces:,}",
            seconds(row.seconds),
            "-" if row.seconds is None else short(row.seconds / row.our_s),
            percent(row.lost),
            percent(row.leaked),
            row.note,
        )
        for row in results.peers
    ]
    note = (
        "Lost is the part of the free volume that no piece covers, leaked the volume of the pieces "
        "inside obstacles relative to it; both are 0 for our leaves, up to round-off."
    )
    return Table(
        "Peers",
        (
            "peer", "what it does", "world, obstacles", "our leaves", "our time", "its pieces",
            "its time", "its time / ours", "lost", "leaked", "note",
        ),
        rows,
        note if rows else "",
        results.skipped,
    )  # fmt: skip


def _ordered(worlds: Sequence[WorldResult]) -> list[WorldResult]:
    """Series by count, then the others as they came."""
    listed = [world for family in SERIES for world in series(worlds, family)]
    return listed + [world for world in worlds if world.family not in SERIES]


def _name(world: WorldResult) -> str:
    """Its title; worlds of one kind and size are told apart by their seeds."""
    return f"{world.title}, seed {world.seed}" if world.family == "dense" else world.title


def _each(world: WorldResult, count: int | None) -> float | None:
    return None if count is None or not world.obstacles else count / world.obstacles
