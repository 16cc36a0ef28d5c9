"""The commands `hzmp-sim bench ...`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from hzmp_sim.bench.paper.settings import DEFAULT_OUT as PAPER_OUT
from hzmp_sim.bench.paper.settings import PaperBenchSettings
from hzmp_sim.bench.peers.settings import DEFAULT_OUT as PEERS_OUT
from hzmp_sim.bench.peers.settings import PeersSettings
from hzmp_sim.bench.scale.settings import DEFAULT_OUT, ScaleSettings

INEXACT = 1
"""Exit code of a benchmark that found a wrong answer: a defect, not a slow machine."""

bench = App(name="bench", help="Measure the library on this machine, beside others.")

_DEFAULT_SCALE = ScaleSettings()
_DEFAULT_PEERS = PeersSettings()
_DEFAULT_PAPER = PaperBenchSettings()


@bench.command
def scale(
    *,
    settings: Annotated[ScaleSettings, Parameter(name="*")] = _DEFAULT_SCALE,
    out: Path = DEFAULT_OUT,
) -> int:
    """Decompose large worlds: time, memory, leaves, exactness, moving obstacles, peers.

    Writes scale.json, scale.md and figures. The exit code is 0 also where a target is missed, and
    1 if leaves and obstacles do not fill the workspace exactly.

    Args:
        settings: what to measure.
        out: where the files go.
    """
    from hzmp_sim.bench.scale.report import tables_of
    from hzmp_sim.bench.scale.run import bench_scale
    from hzmp_sim.bench.scale.write import prepare, write_results
    from hzmp_sim.bench.tables import print_results

    prepare(out)
    results = bench_scale(settings, settings.command(out))
    print_results(tables_of(results), write_results(results, out))
    return 0 if results.exact else INEXACT


@bench.command
def peers(
    *,
    settings: Annotated[PeersSettings, Parameter(name="*")] = _DEFAULT_PEERS,
    out: Path = PEERS_OUT,
) -> int:
    """Plan beside OMPL, Drake, fastpathplanning and a visibility graph, on the same scenes.

    Writes peers.json, peers.md, figures and logs that OMPL's tools read. The exit code is 0 also
    where a peer wins, and 1 if a path or a lower bound of ours is wrong.

    Args:
        settings: what to measure.
        out: where the files go.
    """
    from hzmp_sim.bench.peers.report import tables_of
    from hzmp_sim.bench.peers.run import bench_peers
    from hzmp_sim.bench.peers.write import prepare, write_results
    from hzmp_sim.bench.tables import print_results

    prepare(out)
    results = bench_peers(settings, settings.command(out))
    print_results(tables_of(results), write_results(results, out))
    return INEXACT if results.defects else 0


@bench.command
def paper(
    *,
    settings: Annotated[PaperBenchSettings, Parameter(name="*")] = _DEFAULT_PAPER,
    out: Path = PAPER_OUT,
) -> int:
    """Run the experiments of the HZ-MP paper, and draw a counterpart of each of its figures.

    Writes paper.json, paper.md and figures. The exit code is 1 if a path or a lower bound is wrong.

    Args:
        settings: what to measure.
        out: where the files go.
    """
    from hzmp_sim.bench.paper.report import tables_of
    from hzmp_sim.bench.paper.run import bench_paper
    from hzmp_sim.bench.paper.write import prepare, write_results
    from hzmp_sim.bench.tables import print_results

    prepare(out)
    results = bench_paper(settings, settings.command(out))
    print_results(tables_of(results), write_results(results, out))
    return INEXACT if results.defects else 0
