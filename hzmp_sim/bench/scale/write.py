"""The files of a run: scale.json comes last, so that a folder with it is complete."""

from __future__ import annotations

from pathlib import Path

from hzmp_sim.bench.folder import prepare_folder
from hzmp_sim.bench.scale.figures import FIGURES, write_figures
from hzmp_sim.bench.scale.report import markdown
from hzmp_sim.bench.scale.results import Results
from hzmp_sim.output.artifacts import to_json, whole_file

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
    page, data = folder / PAGE, folder / JSON
    page.write_text("# Free space at scale\n\n" + markdown(results, FIGURES), encoding="utf-8")
    with whole_file(data) as partial:
        partial.write_text(to_json(results.to_dict()), encoding="utf-8")
    return [*paths, page, data]
