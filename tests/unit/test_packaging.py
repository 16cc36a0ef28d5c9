"""The public names, the changelog, the stubs and what must never be in a tracked file."""

from __future__ import annotations

import ast
import datetime
import importlib
import inspect
import re
import shutil
import subprocess
import tomllib
import types
from pathlib import Path

import pytest

import hzmp_sim

ROOT = Path(__file__).resolve().parents[2]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))

CONTRACT = {
    "ConstrainedZonotope": (),
    "Ellipsotope": (),
    "FreeSpace": ("decompose", "hybrid_zonotope", "contains"),
    "HybridZonotope": (),
    "HzmpError": (),
    "Limits": (),
    "PlanStatus": ("OPTIMAL", "FEASIBLE", "INFEASIBLE", "TIME_LIMIT"),
    "Polytope": ("from_box", "from_vertices", "from_halfspaces"),
    "Zonotope": (),
    "load_scene": (),
    "plan": (),
    "simulate": (),
    "time_parameterize": (),
    "verify": (),
}
SIGNATURES = {
    "load_scene": ["path", "body", "start", "goal", "workspace", "clearance"],
    "plan": ["space", "start", "goal", "time_limit", "gap", "seed"],
    "simulate": ["scene", "out"],
    "time_parameterize": [
        "waypoints", "cells", "limits", "start_velocity", "start_acceleration",
    ],
    "verify": ["plan"],
}  # fmt: skip


@pytest.mark.parametrize("name", CONTRACT)
def test_contract_name_is_public(name: str) -> None:
    assert name in hzmp_sim.__all__
    thing = getattr(hzmp_sim, name)
    assert [member for member in CONTRACT[name] if not hasattr(thing, member)] == []


@pytest.mark.parametrize("name", SIGNATURES)
def test_contract_signature(name: str) -> None:
    parameters = list(inspect.signature(getattr(hzmp_sim, name)).parameters)
    assert [parameter for parameter in SIGNATURES[name] if parameter not in parameters] == []
    assert parameters[0] == SIGNATURES[name][0]


def test_every_public_name_can_be_imported_and_is_documented() -> None:
    assert len(set(hzmp_sim.__all__)) == len(hzmp_sim.__all__)
    for name in hzmp_sim.__all__:
        thing = getattr(hzmp_sim, name)
        assert inspect.isclass(thing) or inspect.isfunction(thing) or name == "__version__", name
        assert name == "__version__" or inspect.getdoc(thing), name


# --- changelog ------------------------------------------------------------------------------------

CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
KINDS = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


def test_changelog_keeps_the_format() -> None:
    assert CHANGELOG.startswith("# Changelog\n")
    for section in CHANGELOG.split("\n## ")[1:]:
        heading, _, body = section.partition("\n")
        release = re.fullmatch(r"\[(Unreleased|\d+\.\d+\.\d+)\](?: - (\d{4}-\d\d-\d\d))?", heading)
        assert release, heading
        assert (release[1] == "Unreleased") == (release[2] is None), heading
        assert release[2] is None or datetime.date.fromisoformat(release[2])
        groups = body.split("\n### ")[1:]
        assert groups, f"{heading} has no entries"
        for group in groups:
            kind, _, entries = group.partition("\n")
            assert kind in KINDS, kind
            assert entries.strip().startswith("- "), f"{heading}, {kind} has no entries"


def parts(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split("."))


def test_changelog_covers_this_version() -> None:
    released = [parts(found) for found in re.findall(r"^## \[([\d.]+)\]", CHANGELOG, re.MULTILINE)]
    assert released == sorted(released, reverse=True)
    version = parts(hzmp_sim.__version__)
    if released[:1] != [version]:
        assert "## [Unreleased]" in CHANGELOG
        assert not released or version > released[0]


# --- make -----------------------------------------------------------------------------------------


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_make_test_runs_every_check() -> None:
    command = ["make", "--dry-run", "test"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    steps = ["ruff format --check", "ruff check", "mypy", "pyright", "lint-imports", "-m pytest"]
    places = [re.search(rf"/?{step}\b", done.stdout) for step in steps]
    assert all(places), done.stdout
    assert [place.start() for place in places if place] == sorted(
        place.start() for place in places if place
    )


def test_import_contract_is_the_designed_direction() -> None:
    linter = PYPROJECT["tool"]["importlinter"]
    direction = ["hzmp_sim", "hzmp_tracking", "hzmp_planners"]
    assert linter["root_packages"] == direction
    assert [contract["layers"] for contract in linter["contracts"]] == [direction]


# --- stubs ----------------------------------------------------------------------------------------

STUBS = sorted((ROOT / "typings").rglob("*.pyi"))


@pytest.mark.parametrize(
    "stub", STUBS, ids=lambda path: path.relative_to(ROOT / "typings").as_posix()
)
def test_stub_describes_what_is_there(stub: Path) -> None:
    parts = stub.relative_to(ROOT / "typings").with_suffix("").parts
    library = importlib.import_module(".".join(parts).removesuffix(".__init__"))
    missing = []
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_"):
            if not hasattr(library, node.name):
                missing.append(node.name)
            elif isinstance(node, ast.ClassDef):
                missing += missing_members(getattr(library, node.name), node)
    assert missing == []


def missing_members(kind: type, node: ast.ClassDef) -> list[str]:
    python_class = isinstance(vars(kind).get("__init__"), types.FunctionType)
    missing = []
    for member in node.body:
        value = ...
        if isinstance(member, ast.FunctionDef):
            name = member.name
        elif isinstance(member, ast.AnnAssign) and isinstance(member.target, ast.Name):
            if python_class:
                continue  # its attributes are set in __init__: not seen from the class
            name = member.target.id
        elif isinstance(member, ast.Assign) and isinstance(member.targets[0], ast.Name):
            name, value = member.targets[0].id, ast.literal_eval(member.value)
        else:
            continue
        if not hasattr(kind, name) or value not in (..., getattr(getattr(kind, name), "value", 0)):
            missing.append(f"{node.name}.{name}")
    return missing


# --- what is tracked ------------------------------------------------------------------------------

FORBIDDEN = {
    "path of one machine": re.compile(r"(?<![\w.~/*])/(?:work|tmp|home|root|Users)/\w"),
    "package registry": re.compile(
        r"(?:pypi|npmjs|pythonhosted)\.org/(?!project/|package/)\w|index[-]url"
    ),
    "credential": re.compile(r"(?:gh[pousr]_|sk-|AKIA)[A-Za-z0-9]{16}|BEGIN [A-Z ]*PRIVATE KEY"),
}


def test_no_tracked_file_names_a_machine_or_a_registry() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    found = []
    for name in filter(None, listed.split("\0")):
        try:
            text = (ROOT / name).read_text(encoding="utf-8")
        except (UnicodeDecodeError, FileNotFoundError, IsADirectoryError):
            continue  # not text, or deleted and not yet committed
        for line, content in enumerate(text.splitlines(), 1):
            found += [
                f"{name}:{line}: {kind}" for kind, p in FORBIDDEN.items() if p.search(content)
            ]
    assert found == []


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("path of one machine", "open('/ho" + "me/someone/x')"),
        ("package registry", "https://pypi" + ".org/simple"),
        ("credential", "ghp" + "_" + 20 * "a"),
    ],
)
def test_forbidden_text_is_noticed(kind: str, text: str) -> None:
    assert FORBIDDEN[kind].search(text)
