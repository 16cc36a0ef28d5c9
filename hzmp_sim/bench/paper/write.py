"""The files of a run: paper.json comes last, so that a folder with it is complete."""

from __future__ import annotations

from pathlib import Path

from hzmp_sim.bench.folder import prepare_folder, write_page_and_data
from hzmp_sim.bench.paper.figures.all_figures import FIGURES, write_figures
from hzmp_sim.bench.paper.report import markdown
from hzmp_sim.bench.paper.results import Results

JSON, PAGE, FOLDER = "paper.json", "paper.md", "figures"


def prepare(folder: Path) -> None:
    """Make the folder, and take away what an older run left there.

    Raises:
        OutputError: it cannot be made or written.
    """
    prepare_folder(folder, (JSON, PAGE, *(f"{FOLDER}/{name}" for name in FIGURES)))


def write_results(results: Results, folder: Path) -> list[Path]:
    """Write figures, paper.md and paper.json; returns their paths."""
    paths = write_figures(results, folder / FOLDER)
    links = [path.relative_to(folder).as_posix() for path in paths]
    text = "# The experiments of the HZ-MP paper\n\n" + markdown(results, links)
    return [*paths, *write_page_and_data(folder / PAGE, text, results.to_dict())]
