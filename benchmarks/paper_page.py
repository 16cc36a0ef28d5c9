"""Measure `hzmp-sim bench paper` and put its tables and figures into docs/paper.md.

What stands above the first `made by` comment of the page is kept.

    python benchmarks/paper_page.py

measures anew (two minutes); `--results runs/bench_paper/paper.json` takes what was measured
already.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import cyclopts

from hzmp_sim.bench.page import update_page
from hzmp_sim.bench.paper.figures.all_figures import write_figures
from hzmp_sim.bench.paper.report import markdown
from hzmp_sim.bench.paper.results import Results
from hzmp_sim.bench.paper.run import bench_paper
from hzmp_sim.bench.paper.settings import PaperBenchSettings

COMMAND = "python benchmarks/paper_page.py"
_DEFAULT = PaperBenchSettings()


def main(
    page: Path = Path("docs/paper.md"),
    *,
    results: Path | None = None,
    settings: Annotated[PaperBenchSettings, cyclopts.Parameter(name="*")] = _DEFAULT,
) -> None:
    """Write the generated part of the page, and its figures to the folder images beside it.

    Args:
        page: Markdown file.
        results: a paper.json; without it everything is measured.
        settings: what to measure.
    """
    if results is None:
        measured = bench_paper(settings, settings.command())
    else:
        measured = Results.from_dict(json.loads(results.read_text(encoding="utf-8")))
    update_page(
        page,
        lambda folder: write_figures(measured, folder, "paper_"),
        lambda links: markdown(measured, links, COMMAND),
    )


if __name__ == "__main__":
    cyclopts.run(main)
