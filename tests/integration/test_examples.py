from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "examples"
EXAMPLES = sorted(FOLDER.glob("*.py"))


def test_examples_are_numbered_from_one_without_gaps() -> None:
    numbers = [re.match(r"(\d\d)_[a-z0-9_]+\.py$", path.name) for path in EXAMPLES]
    assert all(numbers), [path.name for path in EXAMPLES]
    assert [int(n[1]) for n in numbers if n] == list(range(1, len(EXAMPLES) + 1))
    assert EXAMPLES


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_has_a_docstring_and_a_main(path: Path) -> None:
    module = ast.parse(path.read_text(encoding="utf-8"))
    assert ast.get_docstring(module)
    assert "main" in {node.name for node in module.body if isinstance(node, ast.FunctionDef)}
    assert ast.unparse(module.body[-1]) == "if __name__ == '__main__':\n    main()"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs_headless_from_any_folder(
    path: Path, tmp_path: Path, python: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    done = python("-W", "error", path, cwd=tmp_path, timeout=60.0)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
