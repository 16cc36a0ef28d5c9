"""The files of a run: scale.json comes last, so that a folder with it is complete."""

from __future__ import annotations

from pathlib import Path

from hzmp_sim.bench.scale.figures import FIGURES, write_figures
from hzmp_sim.bench.scale.report import markdown
from hzmp_sim.bench.scale.results import Results
from hzmp_sim.output.artifacts import OutputError, check_directory, to_json, whole_file

JSON, PAGE = "scale.json", "scale.md"


def prepare(folder: Path) -> None:
    """Make the folder, and take away what an older run left there.

    Raises:
        OutputError: it cannot be made or written.
    """
    check_directory(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in (JSON, PAGE, *FIGURES):
            (folder / name).unlink(missing_ok=True)
        trial = folder / f".{JSON}"
        trial.touch()
        trial.unlink()
    except OSError as error:
        raise OutputError(
            f"folder {folder} cannot be written ({error.strerror or error}); "
            "name one in which you may create files"
        ) from error


def write_results(results: Results, folder: Path) -> list[Path]:
    """Write figures, scale.md and scale.json; returns their paths."""
    paths = write_figures(results, folder)
    page, data = folder / PAGE, folder / JSON
    page.write_text("# Free space at scale\n\n" + markdown(results, FIGURES), encoding="utf-8")
    with whole_file(data) as partial:
        partial.write_text(to_json(results.to_dict()), encoding="utf-8")
    return [*paths, page, data]
