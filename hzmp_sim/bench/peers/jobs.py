"""What there is to do in one scene, and doing it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from hzmp_sim.bench.boxes.scene import BoxScene
from hzmp_sim.bench.boxes.visibility import MOST_BOXES
from hzmp_sim.bench.fresh import FreshProcesses, TaskError, TaskTimeoutError
from hzmp_sim.bench.peers.cells import cells_of, face_pairs
from hzmp_sim.bench.peers.convex_graph import GCS
from hzmp_sim.bench.peers.fast_paths import FAST_PATHS
from hzmp_sim.bench.peers.planners import Planner, is_sampler
from hzmp_sim.bench.peers.results import OURS, WARM, Run
from hzmp_sim.bench.peers.settings import Effort, PeersSettings
from hzmp_sim.bench.peers.visible import VISIBILITY

_PEERS = "hzmp_sim.bench.peers"
_SLACK_S, _SLACK = 30.0, 5.0
"""A sampling planner's process is ended after its budget times the one and plus the other [s]."""


@dataclass(frozen=True)
class Job:
    """One task for a fresh process."""

    task: str
    arguments: dict[str, Any]
    failed: tuple[Run, ...] = ()
    """What to note when it fails."""
    limit: float = 600.0
    """How long it may take [s]."""
    ours: bool = False
    """Whether a failure is a defect."""


def jobs_of(
    scene: BoxScene, peers: Sequence[Planner], settings: PeersSettings, effort: Effort
) -> tuple[list[Job], list[str]]:
    """All jobs of a scene, and why some are left out.

    Args:
        scene: where to plan.
        peers: that are installed and asked for.
        settings: what is measured.
        effort: and how much.
    """
    data = scene.to_dict()
    seeds = list(range(settings.seed, settings.seed + effort.runs))
    jobs = [
        Job(
            f"{_PEERS}.ours:measure_ours",
            {
                "scene": data, "seed": seed, "budget": effort.budget, "gap": settings.gap,
                "verified": seed == seeds[0],
            },
            tuple(Run(scene.name, name, "", seed, [], effort.budget) for name in OURS),
            ours=True,
        )
        for seed in seeds
    ]  # fmt: skip
    left_out: list[str] = []
    exact = scene.n == 2 and len(scene.low) <= MOST_BOXES
    if not exact or not any(one.name == VISIBILITY for one in peers):
        arguments = {"scene": data, "limit": effort.reference_time}
        failed = (Run(scene.name, WARM, "", settings.seed, [], effort.reference_time),)
        jobs.append(Job(f"{_PEERS}.ours:reference", arguments, failed, ours=True))
    for peer in peers:
        if is_sampler(peer.name):
            jobs += _sampling(scene.name, data, peer.name, seeds, settings, effort)
        elif peer.name == VISIBILITY and exact:
            jobs.append(_once(scene, data, peer.name, "visible:measure_visibility", seeds, effort))
        elif peer.name == FAST_PATHS:
            jobs.append(
                _once(scene, data, peer.name, "fast_paths:measure_fast_paths", seeds, effort)
            )
        elif peer.name == GCS:
            low, _, edges = cells_of(scene)
            pairs = face_pairs(len(low), edges)
            if pairs > settings.gcs_pairs:
                left_out.append(
                    f"{peer.title}: left out of {scene.name}, {len(low):,} cells with {pairs:,} "
                    "pairs of faces"
                )
                continue
            job = _once(scene, data, peer.name, "convex_graph:measure_convex_graph", seeds, effort)
            arguments = {"scene": data, "seed": seeds[0]}
            jobs.append(Job(job.task, arguments, job.failed[:1], job.limit))
    return jobs, left_out


def _sampling(
    scene: str, data: dict[str, Any], planner: str, seeds: Sequence[int],
    settings: PeersSettings, effort: Effort,
) -> list[Job]:  # fmt: skip
    """A process for each run: OMPL's random numbers have one seed per process."""
    return [
        Job(
            f"{_PEERS}.ompl.measure:measure_ompl",
            {
                "scene": data, "planner": planner, "check": check, "seed": seed,
                "budget": effort.budget, "resolution": settings.resolution,
            },
            (Run(scene, planner, check, seed, [], effort.budget),),
            _SLACK * effort.budget + _SLACK_S,
        )
        for check in effort.checks
        for seed in seeds
    ]  # fmt: skip


def _once(
    scene: BoxScene, data: dict[str, Any], planner: str, task: str, seeds: list[int], effort: Effort
) -> Job:
    """One process for all runs of a planner that has no random numbers."""
    failed = tuple(Run(scene.name, planner, "", seed, [], effort.peer_time) for seed in seeds)
    arguments = {"scene": data, "seeds": seeds}
    return Job(f"{_PEERS}.{task}", arguments, failed, effort.peer_time)


def run_job(processes: FreshProcesses, job: Job) -> dict[str, Any]:
    """The answer of a job; failures are results too."""
    try:
        answer: dict[str, Any] = processes.run(job.task, job.arguments, limit=job.limit)
    except TaskTimeoutError:
        return _failed(job, f"did not end within {job.limit:g} s")
    except TaskError as error:
        return _failed(job, f"failed: {error}")
    return answer


def _failed(job: Job, note: str) -> dict[str, Any]:
    defects = [note] if job.ours else []
    return {"runs": [asdict(run) | {"note": note, "defects": defects} for run in job.failed]}
