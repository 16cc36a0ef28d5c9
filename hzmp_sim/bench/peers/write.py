"""The files of a run: peers.json comes last, so that a folder with it is complete."""

from __future__ import annotations

from pathlib import Path

from hzmp_sim.bench.folder import prepare_folder, write_page_and_data
from hzmp_sim.bench.peers.figures import FIGURES, write_figures
from hzmp_sim.bench.peers.ompl_log import FOLDER, write_logs
from hzmp_sim.bench.peers.report import markdown
from hzmp_sim.bench.peers.results import Results

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
    text = "# HZ-MP and other planners\n\n" + markdown(results, [path.name for path in paths])
    return [*paths, folder / FOLDER, *write_page_and_data(folder / PAGE, text, results.to_dict())]
