"""Measure `hzmp-sim bench peers` and put its tables and figures into docs/peers_benchmark.md.

What stands above the first `made by` comment of the page is kept.

    python benchmarks/peers_page.py

measures anew (half an hour, with the peers of the extra `bench`);
`--results runs/bench_peers/peers.json` takes what was measured already.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import cyclopts

from hzmp_sim.bench.page import update_page
from hzmp_sim.bench.peers.figures import write_figures
from hzmp_sim.bench.peers.report import markdown
from hzmp_sim.bench.peers.results import Results
from hzmp_sim.bench.peers.run import bench_peers
from hzmp_sim.bench.peers.settings import PeersSettings

COMMAND = "python benchmarks/peers_page.py"
_DEFAULT = PeersSettings()


def main(
    page: Path = Path("docs/peers_benchmark.md"),
    *,
    results: Path | None = None,
    settings: Annotated[PeersSettings, cyclopts.Parameter(name="*")] = _DEFAULT,
) -> None:
    """Write the generated part of the page, and its figures to the folder images beside it.

    Args:
        page: Markdown file.
        results: a peers.json; without it everything is measured.
        settings: what to measure.
    """
    if results is None:
        measured = bench_peers(settings, settings.command())
    else:
        measured = Results.from_dict(json.loads(results.read_text(encoding="utf-8")))
    update_page(
        page,
        lambda folder: write_figures(measured, folder, "peers_"),
        lambda links: markdown(measured, links, COMMAND),
    )


if __name__ == "__main__":
    cyclopts.run(main)
