"""Measure `hzmp-sim bench scale` and put its tables and figures into docs/scale_benchmark.md.

What stands above the first `made by` comment of the page is kept.

    python benchmarks/scale_page.py

measures anew (a quarter of an hour, with the peers of the extra `bench`);
`--results runs/bench_scale/scale.json` takes what was measured already.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import cyclopts

from hzmp_sim.bench.page import update_page
from hzmp_sim.bench.scale.figures import write_figures
from hzmp_sim.bench.scale.report import markdown
from hzmp_sim.bench.scale.results import Results
from hzmp_sim.bench.scale.run import bench_scale
from hzmp_sim.bench.scale.settings import ScaleSettings

COMMAND = "python benchmarks/scale_page.py"
_DEFAULT = ScaleSettings()


def main(
    page: Path = Path("docs/scale_benchmark.md"),
    *,
    results: Path | None = None,
    settings: Annotated[ScaleSettings, cyclopts.Parameter(name="*")] = _DEFAULT,
) -> None:
    """Write the generated part of the page, and its figures to the folder images beside it.

    Args:
        page: Markdown file.
        results: a scale.json; without it everything is measured.
        settings: what to measure.
    """
    if results is None:
        measured = bench_scale(settings, settings.command())
    else:
        measured = Results.from_dict(json.loads(results.read_text(encoding="utf-8")))
    update_page(
        page,
        lambda folder: write_figures(measured, folder, "scale_"),
        lambda links: markdown(measured, links, COMMAND),
    )


if __name__ == "__main__":
    cyclopts.run(main)
