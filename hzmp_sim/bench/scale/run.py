"""Measure everything that the settings ask for, each in a fresh process."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import asdict
from typing import Any

from hzmp_sim.bench.fresh import FreshProcesses, TaskError, TaskTimeoutError
from hzmp_sim.bench.machine import machine
from hzmp_sim.bench.scale.fits import SERIES, fits_of
from hzmp_sim.bench.scale.peers import PEERS, Peer
from hzmp_sim.bench.scale.results import MovingResult, PeerResult, Results, WorldResult
from hzmp_sim.bench.scale.settings import ScaleSettings, Sizes, sizes_of
from hzmp_sim.bench.scale.targets import targets_of
from hzmp_sim.bench.worlds import WorldSpec, read_scene
from hzmp_sim.progress import progress

_SCALE = "hzmp_sim.bench.scale"
_LIBRARIES = ("numpy", "scipy")

MOVING = ("boxes", "turned")
"""Families in which obstacles move."""


def bench_scale(settings: ScaleSettings, command: str) -> Results:
    """Run the benchmark.

    Args:
        settings: what to measure.
        command: how to call it again, for the record.

    Raises:
        TaskError: a world that could not be measured, which is a defect.
        SceneError: a scene file that cannot be read.
    """
    began = time.monotonic()
    sizes = sizes_of(settings)
    worlds = list(_worlds(settings, sizes))
    moving = [WorldSpec(family, sizes.moving, settings.seed) for family in MOVING]
    asked = [peer for peer in PEERS if settings.peers]
    there = [peer for peer in asked if peer.missing is None]
    libraries = [name for peer in there for name in peer.distributions]
    facts = machine([*_LIBRARIES, *libraries])
    limit = settings.peer_time or sizes.peer_time
    rivals = [(peer, count) for peer in there for count in peer.counts(sizes)]
    with ExitStack() as stack:
        modules = [f"{_SCALE}.static", f"{_SCALE}.moving"]
        processes = stack.enter_context(FreshProcesses(*modules))
        total = len(worlds) + len(moving) + len(rivals)
        advance = stack.enter_context(progress("Measuring", total))

        def measured(task: str, **arguments: Any) -> dict[str, Any]:
            found: dict[str, Any] = processes.run(f"{_SCALE}.{task}", arguments)
            advance(1)
            return found

        world_results = [
            WorldResult(
                **measured(
                    "static:measure_world",
                    spec=asdict(spec),
                    repeats=settings.repeats,
                    points=sizes.points,
                    naive=spec.count <= sizes.naive or spec.family == "dense",
                    grow=spec.count <= sizes.overlapping,
                )
            )
            for spec in worlds
        ]
        moving_results = [
            MovingResult(
                **measured(
                    "moving:measure_moving",
                    spec=asdict(spec),
                    moved=sizes.moved,
                    steps=sizes.steps,
                    checks=sizes.checks,
                )
            )
            for spec in moving
        ]
        peer_results = []
        for peer, count in rivals:
            spec = WorldSpec(peer.family, count, settings.seed)
            peer_results.append(_beside(processes, peer, spec, limit))
            advance(1)
    fits = fits_of(world_results)
    return Results(
        command=command,
        machine=facts,
        settings=asdict(settings) | {"sizes": asdict(sizes)},
        worlds=world_results,
        moving=moving_results,
        peers=peer_results,
        skipped=[line for peer in asked if (line := _left_out(peer, sizes)) is not None],
        fits=fits,
        targets=targets_of(world_results, moving_results, fits),
        seconds=time.monotonic() - began,
    )


def _worlds(settings: ScaleSettings, sizes: Sizes) -> Iterator[WorldSpec]:
    """The worlds that stand still."""
    for family in SERIES:
        for count in getattr(sizes, family):
            yield WorldSpec(family, count, settings.seed)
    yield WorldSpec("squares", sizes.squares**2)
    for seed in range(settings.seed, settings.seed + sizes.dense_seeds):
        yield WorldSpec("dense", sizes.dense, seed)
    if settings.scenes is not None:
        for path in sorted(settings.scenes.glob("*.json")):
            yield WorldSpec("scene", len(read_scene(path).obstacles), path=str(path))


def _left_out(peer: Peer, sizes: Sizes) -> str | None:
    """Why a peer is not measured, None if it is."""
    if peer.missing is None and not peer.counts(sizes):
        return f"{peer.name}: left out of a quick run"
    return peer.missing


def _beside(processes: FreshProcesses, peer: Peer, spec: WorldSpec, limit: float) -> PeerResult:
    """A peer and our decomposition on one world; failures of the peer are results too."""
    ours: dict[str, Any] = processes.run(f"{_SCALE}.static:measure_ours", {"spec": asdict(spec)})
    arguments = {"spec": asdict(spec), "limit": limit}
    theirs: dict[str, Any]
    try:
        theirs = processes.run(peer.task, arguments, limit=limit + peer.patience)
    except TaskTimeoutError:
        theirs = {"note": f"did not end within {limit:g} s"}
    except TaskError as error:
        theirs = {"note": f"failed: {error}"}
    return PeerResult(peer=peer.name, does=peer.does, **ours, **theirs)
