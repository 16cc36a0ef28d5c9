"""The files of a run: scale.json comes last, so that a folder with it is complete."""

from __future__ import annotations

from pathlib import Path

from hzmp_sim.bench.folder import prepare_folder, write_page_and_data
from hzmp_sim.bench.scale.figures import FIGURES, write_figures
from hzmp_sim.bench.scale.report import markdown
from hzmp_sim.bench.scale.results import Results

JSON, PAGE = "scale.json", "scale.md"


def prepare(folder: Path) -> None:
    """Make the folder, and take away what an older run left there.

    Raises:
        OutputError: it cannot be made or written.
    """
    prepare_folder(folder, (JSON, PAGE, *FIGURES))


def write_results(results: Results, folder: Path) -> list[Path]:
    """Write figures, scale.md and scale.json; returns their paths."""
    paths = write_figures(results, folder)
    text = "# Free space at scale\n\n" + markdown(results, FIGURES)
    return [*paths, *write_page_and_data(folder / PAGE, text, results.to_dict())]
