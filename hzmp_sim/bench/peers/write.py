"""The files of a run: peers.json comes last, so that a folder with it is complete."""

from __future__ import annotations

from pathlib import Path

from hzmp_sim.bench.folder import prepare_folder
from hzmp_sim.bench.peers.figures import FIGURES, write_figures
from hzmp_sim.bench.peers.ompl_log import FOLDER, write_logs
from hzmp_sim.bench.peers.report import markdown
from hzmp_sim.bench.peers.results import Results
from hzmp_sim.output.artifacts import to_json, whole_file

JSON, PAGE = "peers.json", "peers.md"


def prepare(folder: Path) -> None:
    """Make the folder, and take away what an older run left there.

    Raises:
        OutputError: it cannot be made or written.
    """
    logs = [path.relative_to(folder).as_posix() for path in (folder / FOLDER).glob("*.log")]
    prepare_folder(folder, (JSON, PAGE, *FIGURES, *logs))


def write_results(results: Results, folder: Path) -> list[Path]:
    """Write figures, logs, peers.md and peers.json; returns the paths of all but the logs."""
    paths = write_figures(results, folder)
    write_logs(results, folder / FOLDER)
    page, data = folder / PAGE, folder / JSON
    text = markdown(results, [path.name for path in paths])
    page.write_text("# HZ-MP and other planners\n\n" + text, encoding="utf-8")
    with whole_file(data) as partial:
        partial.write_text(to_json(results.to_dict()), encoding="utf-8")
    return [*paths, folder / FOLDER, page, data]
