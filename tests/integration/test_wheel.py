"""The wheel, built from the sdist, has what it needs and works without the checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

import hzmp_sim

PACKAGES = {"hzmp_sim", "hzmp_planners", "hzmp_tracking"}

pytestmark = pytest.mark.slow


def run(*command: str | Path, cwd: Path) -> str:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def dist(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the sdist and the wheel that was built from it."""
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, root, cwd=folder)
    return folder


@pytest.fixture(scope="module")
def wheel(dist: Path) -> Path:
    (path,) = dist.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A virtual environment with the wheel; it borrows this one's dependencies."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, with_pip=False)
    interpreter = folder / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--python", interpreter, "install", "--no-index")
    run(*pip, "--no-deps", wheel, cwd=folder)
    # Folders named in a .pth come after site-packages and their own .pth files are not read, so an
    # editable install of the checkout is not seen.
    borrowed = [path for path in sys.path if "site-packages" in Path(path).parts]
    (site_packages(folder) / "borrowed.pth").write_text("\n".join(borrowed), encoding="utf-8")
    return folder


def site_packages(environment: Path) -> Path:
    base = {"base": str(environment), "platbase": str(environment)}
    return Path(sysconfig.get_path("purelib", scheme="venv", vars=base))


def test_wheel_takes_only_its_own_names(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == PACKAGES
    assert {f"{package}/py.typed" for package in PACKAGES} <= names


def test_wheel_ships_every_model(wheel: Path, root: Path) -> None:
    models = {
        path.relative_to(root / "models").as_posix()
        for path in (root / "models").rglob("*")
        if path.is_file()
    }
    with zipfile.ZipFile(wheel) as archive:
        shipped = {
            name.removeprefix("hzmp_sim/_models/")
            for name in archive.namelist()
            if name.startswith("hzmp_sim/_models/")
        }
    assert shipped == models
    assert {"enclosure/scene.xml", "maze/scene.xml", "narrow_passage/scene.xml"} <= shipped


def test_wheel_metadata(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (metadata,) = (name for name in names if name.endswith(".dist-info/METADATA"))
        text = archive.read(metadata).decode()
    assert f"\nVersion: {hzmp_sim.__version__}\n" in text
    assert "\nLicense-Expression: MIT\n" in text
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)


def test_sdist_can_be_tested(dist: Path) -> None:
    (path,) = dist.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {"Makefile", "README.md", "tests/conftest.py", "typings/mujoco/__init__.pyi"} <= names
    assert not {name for name in names if name.startswith((".venv", "runs", "dist"))}


def test_installed_packages_are_those_of_the_wheel(environment: Path, tmp_path: Path) -> None:
    code = f"import importlib as i; [print(i.import_module(p).__file__) for p in {PACKAGES}]"
    files = run(environment / "bin" / "python", "-c", code, cwd=tmp_path).split()
    assert {Path(file).parent for file in files} == {
        site_packages(environment) / package for package in PACKAGES
    }


def test_command_line_works_outside_the_checkout(environment: Path, tmp_path: Path) -> None:
    command = environment / "bin" / "hzmp-sim"
    assert hzmp_sim.__version__ in run(command, "--version", cwd=tmp_path)
    world = site_packages(environment) / "hzmp_sim" / "_models" / "enclosure" / "scene.xml"
    options = ("--body", "point", "--no-video", "--out", "flight")
    run(command, "run", world, *options, cwd=tmp_path)
    metrics = json.loads((tmp_path / "flight" / "metrics.json").read_text(encoding="utf-8"))
    assert metrics["status"] == "goal_reached"
    assert metrics["collision_steps"] == 0
    assert {path.name for path in tmp_path.iterdir()} == {"flight"}
