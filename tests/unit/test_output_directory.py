"""A run directory is there as a whole or not at all."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hzmp_sim.output import OutputError, RunDirectory
from hzmp_sim.output.artifacts import to_json


def write(files: RunDirectory, text: str) -> None:
    files.path("run.rrd").write_text(text)
    files.path("figures/path.png").write_text(text)
    files.write_metrics({"status": text})


def listing(directory: Path) -> set[str]:
    return {path.relative_to(directory).as_posix() for path in directory.rglob("*")}


def test_files_appear_only_at_the_end(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "run"
    with RunDirectory(out) as files:
        write(files, "one")
        assert not out.exists()
    assert listing(out) == {"metrics.json", "run.rrd", "figures", "figures/path.png"}
    assert listing(tmp_path / "deep") == {"run"} | {f"run/{name}" for name in listing(out)}
    assert out.stat().st_mode & 0o777 == out.parent.stat().st_mode & 0o777


def test_an_older_run_is_replaced_as_a_whole_and_foreign_files_stay(tmp_path: Path) -> None:
    with RunDirectory(tmp_path) as files:
        write(files, "old")
        files.path("run.mp4").write_text("old")
        files.path("figures/flight.png").write_text("old")
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "figures" / "mine.svg").write_text("mine")
    with RunDirectory(tmp_path) as files:
        write(files, "new")
    assert listing(tmp_path) == {
        "metrics.json", "run.rrd", "figures", "figures/path.png", "notes.txt", "figures/mine.svg",
    }  # fmt: skip
    assert (tmp_path / "run.rrd").read_text() == "new"
    assert json.loads((tmp_path / "metrics.json").read_text()) == {"status": "new"}


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_exception_leaves_nothing_of_the_new_run(
    tmp_path: Path, error: type[BaseException]
) -> None:
    out = tmp_path / "run"
    with RunDirectory(out) as files:
        write(files, "old")

    def fail() -> None:
        with RunDirectory(out) as files:
            write(files, "new")
            raise error

    with pytest.raises(error):
        fail()
    assert listing(tmp_path) == {"run"} | {f"run/{name}" for name in listing(out)}
    assert (out / "run.rrd").read_text() == "old"


def test_a_killed_process_leaves_no_file_under_its_final_name(tmp_path: Path) -> None:
    program = f"""
import os, signal
from hzmp_sim.output.artifacts import RunDirectory
with RunDirectory({str(tmp_path / "run")!r}) as files:
    files.path("run.rrd").write_text("x")
    files.write_metrics({{"status": "goal_reached"}})
    os.kill(os.getpid(), signal.SIGKILL)
"""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    ended = subprocess.run([sys.executable, "-c", program], env=environment)
    assert ended.returncode == -signal.SIGKILL
    assert not (tmp_path / "run").exists()
    assert all(path.name.startswith(".run.") for path in tmp_path.iterdir())


def test_metrics_come_last_when_a_directory_is_refilled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with RunDirectory(tmp_path) as files:
        write(files, "old")
    placed: list[str] = []
    move = Path.replace

    def spy(self: Path, target: Path) -> Path:
        assert not (tmp_path / "metrics.json").exists()
        placed.append(self.name)
        return move(self, target)

    monkeypatch.setattr(Path, "replace", spy)
    with RunDirectory(tmp_path) as files:
        write(files, "new")
    assert placed[-1] == "metrics.json"
    assert len(placed) == 3


def test_a_file_is_no_run_directory(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(OutputError, match="file") as error, RunDirectory(out):
            pass
        assert "\n" not in str(error.value)
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("name", ["other.txt", "../run.rrd", "figures/x.svg", "/etc/passwd"])
def test_only_artefacts_of_a_run_are_written(tmp_path: Path, name: str) -> None:
    with RunDirectory(tmp_path / "x") as files, pytest.raises(OutputError, match="not an artefact"):
        files.path(name)


def test_json_is_strict_and_stable() -> None:
    text = to_json(
        {
            "b": np.float64(0.25),
            "a": {"nan": float("nan"), "inf": np.inf, "count": np.int64(3)},
            "c": (1, True, None, np.array([1.0, np.nan])),
            "d": Path("x") / "y",
        }
    )
    assert json.loads(text) == {
        "a": {"count": 3, "inf": None, "nan": None},
        "b": 0.25,
        "c": [1, True, None, [1.0, None]],
        "d": "x/y",
    }
    assert text.index('"a"') < text.index('"b"') < text.index('"c"')
    with pytest.raises(TypeError):
        to_json({"a": object()})
