"""The files of a run: paper.json comes last, so that a folder with it is complete."""

from __future__ import annotations

from pathlib import Path

from hzmp_sim.bench.folder import prepare_folder
from hzmp_sim.bench.paper.figures import FIGURES, write_figures
from hzmp_sim.bench.paper.report import markdown
from hzmp_sim.bench.paper.results import Results
from hzmp_sim.output.artifacts import to_json, whole_file

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
    page, data = folder / PAGE, folder / JSON
    text = markdown(results, [path.relative_to(folder).as_posix() for path in paths])
    page.write_text("# The experiments of the HZ-MP paper\n\n" + text, encoding="utf-8")
    with whole_file(data) as partial:
        partial.write_text(to_json(results.to_dict()), encoding="utf-8")
    return [*paths, page, data]
